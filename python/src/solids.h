#pragma once

#include <memory>
#include <variant>

#include <ist/bake.h>
#include <ist/shapes.h>

#include "arrays.h"

namespace ist::python {

/// A shape and whoever owns the memory that it points to.
struct OwnedShape {
  ist::Shape shape;
  py::dict arguments;  ///< that it was made of
  std::shared_ptr<const void> owner;
};

/// What may stand first in a query: a view. Whoever asks holds the Python object meanwhile.
using Solid = std::variant<AssetView, ist::Shape>;

/// Its mesh, (vertices, triangles); Error where there is none.
py::tuple kept_mesh_of(const Asset& asset);

/// Of an Asset or a Shape, else TypeError. `name`: of the argument.
Solid solid_of(const py::handle& object, const char* name);

/// Of an Asset, else TypeError that says why a shape will not do.
AssetView tree_of(const py::handle& object, const char* name);

}  // namespace ist::python
