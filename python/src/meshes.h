#pragma once

#include <memory>

#include <ist/mesh.h>

#include "arrays.h"

namespace ist::python {

/// Of a Mesh, a path, a pair of arrays, or an object with `vertices` and `faces` (or `triangles`),
/// as trimesh and Open3D have them; else TypeError.
std::shared_ptr<TriangleMesh> mesh_of(const py::object& value);

/// The same, closed; a ClosedMesh as it is. Raises Error as close_mesh() does.
std::shared_ptr<ClosedMesh> closed_of(const py::object& value, const py::object& scale);

}  // namespace ist::python
