#pragma once

#include <string>

namespace ist {

/// Why a mesh is not resolved. Thrown and caught within the unit.
struct Unresolvable {
  std::string reason;
};

}  // namespace ist
