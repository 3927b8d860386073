#pragma once

#include <ist/asset_layout.h>

#include "bake/cluster/ball_lanes.h"

namespace ist {

using PrototypeValues = std::array<double, kWidth>;

/// Up to sixteen places to which balls are drawn; unused ones are at the origin.
struct Prototypes {
  alignas(64) PrototypeValues x{}, y{}, z{};
  std::size_t count = 0;
};

/// Σ weight · centre and Σ weight over the balls, for each prototype.
struct GasPull {
  alignas(64) PrototypeValues x{}, y{}, z{}, total{};
};

/// The pull of the balls in `part`, in that order. A ball counts by r³ and by the kernel at the
/// prototype's rank: the number of prototypes nearer to the ball, or equally near and earlier.
GasPull pull_of(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                const Prototypes& prototypes, const PrototypeValues& kernel);

/// Squared distances from the centres of the balls in `part` to the prototypes, a row a ball;
/// infinite in unused prototypes.
void measure_all(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                 const Prototypes& prototypes, PrototypeValues* distances2);

/// The lead of prototype `own` over each other one (how much nearer it is), for the member that
/// prefers it least. `members` are rows of measure_all().
PrototypeValues least_leads(const PrototypeValues* distances2,
                            std::span<const std::uint32_t> members, std::size_t own);

/// A group of one to sixteen balls that may exchange members.
struct SwapGroup {
  BallLanes members;
  Ball ball;                         ///< around the members
  std::array<Ball, kWidth> without;  ///< around all members but one
  std::uint32_t touching = 0;        ///< one bit a member: `without` may differ from `ball`
  /// Radii of `without`; infinite in unused lanes.
  alignas(64) std::array<double, kWidth> radius_without;
  double least_radius = 0;  ///< of `without` and of `ball`
};

/// Computes everything that follows from the members.
void measure_group(SwapGroup& group);

/// An exchange of a member of one group for a member of another.
struct MemberSwap {
  double gain = 0;  ///< 0: there is none
  std::uint32_t s = 0, t = 0;
};

inline constexpr std::size_t kNoMember = kWidth;

/// The exchange of members between two groups that reduces Σ (R + reach)³ most, the first among
/// equals, if by more than a share `least_gain`. `pinned`: members that stay, or kNoMember.
MemberSwap best_swap(const SwapGroup& a, const SwapGroup& b, double reach, double least_gain,
                     std::size_t pinned_a, std::size_t pinned_b);

}  // namespace ist
