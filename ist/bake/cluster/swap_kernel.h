#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bake/cluster/ball_lanes.h"

namespace ist {

/// A group of one to sixteen balls that may trade members.
struct SwapGroup {
  BallLanes members;
  Ball ball;                         ///< around the members
  std::array<Ball, kWidth> without;  ///< around all members but one
  std::uint32_t touching = 0;  ///< one bit a member: `without` may be another ball than `ball`
  /// Radii of `without`; infinite behind the members.
  alignas(64) std::array<double, kWidth> radius_without;
  double least_radius = 0;  ///< of `without` and of `ball`
};

/// Fills all that follows from the members.
void measure_group(SwapGroup& group);

/// A member of one group for a member of another.
struct MemberSwap {
  double gain = 0;  ///< 0: there is none
  std::uint32_t s = 0, t = 0;
};

inline constexpr std::size_t kNoMember = kWidth;

/// Finds the swap of members between two groups that reduces Σ (R + reach)³ most, the first of
/// equals, if it reduces it by more than a share `least_gain`. `pinned`: members that stay, or
/// kNoMember.
MemberSwap best_swap(const SwapGroup& a, const SwapGroup& b, double reach, double least_gain,
                     std::size_t pinned_a, std::size_t pinned_b);

}  // namespace ist
