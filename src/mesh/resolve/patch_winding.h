#pragma once

#include <cstdint>
#include <vector>

#include "mesh/resolve/arrangement.h"

namespace ist {

/// Pieces that hang together where nothing else meets them, so that the winding numbers on their
/// two sides are the same all over.
struct Patches {
  std::vector<std::uint32_t> of_piece;
  std::vector<int> in_front;  ///< [patch] the winding number there
};

/// Exact. On the caller's TBB threads; the answer does not depend on their number.
/// Throws Unresolvable, and as `work` does.
Patches find_patches(const std::vector<Triangle>& triangles, const Arrangement& arrangement,
                     WatchedWork& work);

}  // namespace ist
