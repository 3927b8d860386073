#include "query/exact/exact_parts.h"

#include <algorithm>
#include <cstring>

namespace ist {

/// A hash of the names of crossings and their ends, in order, and of what is inside. These
/// determine what is connected, unless an edge is pierced more than twice or a curve is in one
/// triangle.
std::uint64_t ExactParts::hash_of_names() const noexcept {
  std::uint64_t hash = out_.crossings;
  const auto mix = [&](std::uint64_t name) {
    hash = (hash ^ name) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  const Crossings& crossings = scratch_.crossings;
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    const auto edge = [&](int e) {
      return static_cast<std::uint64_t>(static_cast<int>(crossings.end(e, Crossings::kEdge)[i]));
    };
    mix(std::uint64_t{crossings.triangle(0, i)} << (kTriangleBits + 8) |
        std::uint64_t{crossings.triangle(1, i)} << 8 | edge(0) << 4 | edge(1));
  }
  for (const Side& own : sides_) {
    for (std::uint32_t c = 0; c < own.marks.count; ++c) {
      const CrossedBlock& crossed = own.marks.blocks[c];
      std::uint64_t apexes[2];
      std::memcpy(apexes, crossed.apex, sizeof apexes);
      for (const std::uint64_t name : {std::uint64_t{crossed.inside}, apexes[0], apexes[1]})
        mix(name);
    }
    for (std::uint32_t w = 0; w < (own.mesh.level[0].count + 63) / 64; ++w)
      mix(own.marks.inside[w]);
  }
  return std::max(hash, std::uint64_t{1});
}

std::uint32_t ExactParts::divide() noexcept {
  if (kept_ == nullptr) return OverlapParts::divide();
  const std::uint64_t names = hash_of_names();
  const bool known = kept_->one == names;
  start(known);
  if (!known) join();
  name_parts();
  if (!known) {
    one_ = are_one();
    kept_->one = one_ && by_names_ ? names : 0;
  }
  return finish();
}

}  // namespace ist
