#pragma once

#include <memory>

#include <ist/mesh.h>

#include "arrays.h"

namespace ist::python {

/// From a Mesh, a path, a pair of arrays, or an object with `vertices` and `faces` (or
/// `triangles`), as in trimesh and Open3D; else TypeError.
std::shared_ptr<TriangleMesh> mesh_of(const py::object& value);

/// The same, closed; a ClosedMesh unchanged. Raises Error like close_mesh().
std::shared_ptr<ClosedMesh> closed_of(const py::object& value, const py::object& scale);

}  // namespace ist::python
