#pragma once

#include <memory>
#include <string>
#include <variant>

#include <ist/bake.h>
#include <ist/field.h>

#include "arrays.h"

namespace ist::python {

/// A field and whoever owns the memory that it points to.
struct OwnedField {
  Field field;
  py::dict arguments;  ///< that it was made of
  std::shared_ptr<const void> owner;
};

/// What may stand first in a query: a view. Whoever asks holds the Python object meanwhile.
using Solid = std::variant<TreeView, Field>;

/// Its mesh, (vertices, triangles); Error where there is none.
py::tuple surface_of(const Asset& asset);

/// Of an Asset or a Field, else TypeError. `name`: of the argument.
Solid solid_of(const py::handle& object, const char* name);

/// Of an Asset, else TypeError that says why a field will not do.
TreeView tree_of(const py::handle& object, const char* name);

}  // namespace ist::python
