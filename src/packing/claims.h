#pragma once

#include "packing/hashing.h"

namespace ist::packing {

struct ClaimTable {
  float width = 1;
  float inverse_width = 1;
  std::uint32_t mask = (1u << 20) - 1;
  IST_HD std::uint32_t index(float x, int d) const {
    return static_cast<std::uint32_t>(static_cast<int>((x + 4) * inverse_width) + d) & 0x1FFFFF;
  }
  IST_HD std::uint32_t bucket_of(Float3 p, int dx, int dy, int dz) const {
    const std::uint64_t cube =
        index(p.x, dx) | std::uint64_t{index(p.y, dy)} << 21 | std::uint64_t{index(p.z, dz)} << 42;
    return static_cast<std::uint32_t>(mixed(cube)) & mask;
  }
};

}  // namespace ist::packing
