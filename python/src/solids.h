#pragma once

#include <memory>
#include <variant>

#include <ist/bake.h>
#include <ist/shapes.h>

#include "arrays.h"

namespace ist::python {

/// A shape and the owner of its memory.
struct OwnedShape {
  ist::Shape shape;
  py::dict arguments;  ///< that it was constructed from
  std::shared_ptr<const void> owner;
};

/// The first argument of a query: a view. The caller keeps the Python object alive.
using Solid = std::variant<AssetView, ist::Shape>;

/// Its mesh, (vertices, triangles); Error if there is none.
py::tuple kept_mesh_of(const Asset& asset);

/// From an Asset or a Shape, else TypeError. `name`: of the argument.
Solid solid_of(const py::handle& object, const char* name);

/// From an Asset, else TypeError that explains why a shape is not accepted.
AssetView tree_of(const py::handle& object, const char* name);

}  // namespace ist::python
