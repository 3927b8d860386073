#pragma once

#include <cstddef>
#include <cstdint>

namespace ist {

/// Boxes of several bodies, side by side.
struct BodyBlock {
  static constexpr std::size_t kCount = 8;

  // What of a body does not change [u], and its pose.
  double middle[3][kCount], half[3][kCount], wider[kCount];
  double q[4][kCount], t[3][kCount];
  // What place_boxes() writes: the same bits as SolidBox::placed() and WorldBox::write().
  float low[3][kCount], high[3][kCount];
  std::uint32_t placed;  ///< bit k: the k-th pose is usable and floats hold its box
};

void place_boxes(BodyBlock& block) noexcept;

}  // namespace ist
