#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <ist/cover_spheres.h>

#include <Eigen/Core>
#include "mesh/mesh_solid.h"
#include "robots/covers/sampled_solid.h"

namespace ist {

/// Balls, and how far they protrude where the share of the level is 1; unit frame.
struct LeveledBalls {
  std::vector<CoverSphere> balls;
  double level = 0;
};

/// Looks for few balls that contain a solid and protrude little; unit frame. What it finds is
/// proven to contain the solid before it is handed out.
class [[gnu::visibility("hidden")]] CoverSearch {
 public:
  /// `look`: called now and then, from any thread, with the share [0, 1] that is done at least;
  /// what it throws ends the search. `share`, `most`: as in SampledSolid.
  CoverSearch(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look,
              LevelShare share = {}, double most = std::numeric_limits<double>::infinity())
      : solid_(solid), seed_(seed), look_(std::move(look)), share_(std::move(share)), most_(most) {}

  /// `count` balls, or fewer where fewer do as well. The level is proven only without shares.
  LeveledBalls with_count(std::size_t count) const;

  /// How many balls a plain greedy choice takes to protrude by no more than `level`; less than
  /// that, if it is more than `enough`.
  std::size_t greedy_count(double level, std::size_t enough = kMostCoverSpheres) const;

 private:
  const MeshSolid& solid_;
  const std::uint64_t seed_;
  const std::function<void(double)> look_;
  const LevelShare share_;
  const double most_;
};

/// A choice of `count` of the candidates that together contain all targets that any contains, if
/// one is found within so many exchanges and steps; else empty, as where none contains more than
/// one target in so many.
///
/// It starts with the candidate that contains most of what is left, over and over, and goes on as a
/// tabu search: an open target is picked, the candidate that would help most comes in, the one that
/// is missed least goes out, and targets that stay open weigh more. Where candidates contain much
/// an exchange takes many steps. `steps`: what is left of them; those taken are subtracted, and it
/// ends soon after none are left.
std::vector<std::uint32_t> choose_cover(std::span<const CoverSphere> candidates,
                                        std::span<const Eigen::Vector3d> targets, std::size_t count,
                                        std::size_t exchanges, std::uint64_t seed,
                                        std::int64_t& steps, std::size_t one_in = 50);

/// The same without exchanges and with as many as it takes: the plain greedy choice.
std::vector<std::uint32_t> choose_greedily(std::span<const CoverSphere> candidates,
                                           std::span<const Eigen::Vector3d> targets);

}  // namespace ist
