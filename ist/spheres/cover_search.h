#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include <ist/cover_spheres.h>

#include <Eigen/Core>
#include "mesh/mesh_solid.h"
#include "spheres/sampled_solid.h"

namespace ist {

/// Looks for few balls that hold a solid and protrude little; unit frame. What it finds is proven
/// to hold the solid before it is handed out.
class [[gnu::visibility("hidden")]] CoverSearch {
 public:
  /// `look`: called now and then, from any thread, with the share [0, 1] that is done at least;
  /// what it throws ends the search.
  /// `tight`: unit frame.
  CoverSearch(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look,
              std::vector<TightPlace> tight = {})
      : solid_(solid), seed_(seed), look_(std::move(look)), tight_(std::move(tight)) {}

  /// `count` balls, or fewer where fewer do as well.
  std::vector<CoverSphere> with_count(std::size_t count) const;

  /// How many balls a plain greedy choice takes to protrude by no more than `level`.
  std::size_t greedy_count(double level) const;

 private:
  const MeshSolid& solid_;
  const std::uint64_t seed_;
  const std::function<void(double)> look_;
  const std::vector<TightPlace> tight_;
};

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
