#pragma once

#include <ist/solid.h>

namespace ist {

/// Throws Error, naming a place, if a signed distance is not finite or, between two of some
/// thousand points in and around the bounds, changes by more than their distance. What passes may
/// still do so elsewhere.
void require_lipschitz(const Solid& solid);

}  // namespace ist
