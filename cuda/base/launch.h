#pragma once

#include <algorithm>
#include <cstddef>

namespace ist::gpu {

/// The number of blocks of `each` items for so many items; at least one, as a grid may not be
/// empty.
inline unsigned blocks_for(std::size_t items, unsigned each) {
  return static_cast<unsigned>(std::max<std::size_t>((items + each - 1) / each, 1));
}

}  // namespace ist::gpu
