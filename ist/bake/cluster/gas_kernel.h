#pragma once

#include <ist/asset_layout.h>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "bake/cluster/bounding_ball.h"

namespace ist {

using PrototypeValues = std::array<double, kWidth>;

/// Up to sixteen places that balls are drawn to; those behind `count` are at the origin.
struct Prototypes {
  alignas(64) PrototypeValues x{}, y{}, z{};
  std::size_t count = 0;
};

/// Σ weight · centre and Σ weight over the balls, for each prototype.
struct GasPull {
  alignas(64) PrototypeValues x{}, y{}, z{}, total{};
};

/// The pull of the balls that `part` names, in that order. A ball counts by r³ and by the kernel at
/// the prototype's rank: how many are nearer to the ball, or as near and come before.
GasPull pull_of(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                const Prototypes& prototypes, const PrototypeValues& kernel);

/// Squared distances from the centres of the balls that `part` names to the prototypes, a row a
/// ball; infinite behind the prototypes.
void measure_all(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                 const Prototypes& prototypes, PrototypeValues* distances2);

/// By how much prototype `own` is nearer to the members than each other one, to the member that
/// prefers it least. `members` name rows of measure_all().
PrototypeValues least_leads(const PrototypeValues* distances2,
                            std::span<const std::uint32_t> members, std::size_t own);

}  // namespace ist
