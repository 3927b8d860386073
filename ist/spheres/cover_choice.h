#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include <ist/cover_spheres.h>

namespace ist {

/// A choice of `count` of the candidates that together hold all targets that any holds, if one is
/// found within so many exchanges and steps; else empty.
///
/// It starts with the candidate that holds most of what is left, over and over, and goes on as a
/// tabu search: an open target is picked, the candidate that would help most comes in, the one that
/// is missed least goes out, and targets that stay open weigh more. Where candidates hold much an
/// exchange takes many steps. `steps`: what is left of them; those taken are subtracted, and it
/// ends soon after none are left.
std::vector<std::uint32_t> choose_cover(std::span<const CoverSphere> candidates,
                                        std::span<const Eigen::Vector3d> targets, std::size_t count,
                                        std::size_t exchanges, std::uint64_t seed,
                                        std::int64_t& steps);

/// The same without exchanges and with as many as it takes: the plain greedy choice.
std::vector<std::uint32_t> choose_greedily(std::span<const CoverSphere> candidates,
                                           std::span<const Eigen::Vector3d> targets);

}  // namespace ist
