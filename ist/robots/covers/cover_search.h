#pragma once

#include <ist/cover_spheres.h>
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "mesh/mesh_solid.h"
#include "robots/covers/offset_surface.h"

namespace ist {

/// Centres, and the level at which the largest balls around them (OffsetSurface::radius) contain
/// the surface.
struct LevelCover {
  std::vector<Eigen::Vector3d> centres;  ///< unit frame
  double level = 0;                      ///< unit frame
};

struct LookedCover {
  LevelCover cover;
  std::vector<CoverSphere> balls;  ///< unit frame
};

/// Moves centres so that the level falls, one ball at a time: it minimises the distance of the
/// farthest of the targets that no other ball contains at a slightly lower level.
///
/// Refines the samples as it proceeds: places of the surface outside all balls become targets, and
/// places that a ball reaches beyond the level become rays.
class [[gnu::visibility("hidden")]] CoverDescent {
 public:
  /// `sampled` receives the targets and rays that are found.
  CoverDescent(const MeshSolid& solid, SampledSolid& sampled) : solid_(solid), sampled_(sampled) {}

  /// Starts from centres that contain the samples, at about the given level, and ends when the
  /// level falls by less than a few thousandths, or after so many rounds over all balls. The
  /// resulting level is approximately that of the surface itself (open_corners(), rays), unproven.
  /// `look` is called now and then.
  LookedCover improve(LevelCover start, int rounds, const std::function<void()>& look);

 private:
  struct Balls;
  class Round;
  double add_targets(const std::vector<CoverSphere>& balls, double level);
  double add_void(const std::vector<CoverSphere>& balls, double level);
  double add_rays(const OffsetSurface& surface, const std::vector<CoverSphere>& balls);

  const MeshSolid& solid_;
  SampledSolid& sampled_;
  std::vector<CoverSphere> vouched_;    ///< centres, and levels that they were found to keep
  std::vector<std::uint32_t> holders_;  ///< by triangle, from the last examination
};

/// Largest protrusion by count of spheres, for the counts tried; at least one.
using TriedCounts = std::map<std::size_t, double>;

/// The largest protrusion of so many spheres: the least one found with as many or fewer, else an
/// estimate between and beyond the counts tried.
double estimated_protrusion(const TriedCounts& tried, std::size_t count);

/// Counts of at least 1 whose sum, `copies` times each, is at most `total`, so that the largest
/// estimated protrusion is as small as possible, then the second largest, and so on.
/// `total` ≥ the sum of `copies`.
std::vector<std::size_t> share_out(std::span<const TriedCounts> tried,
                                   std::span<const std::size_t> copies, std::size_t total);

/// Balls, and how far they protrude where the share of the level is 1; unit frame.
struct LeveledBalls {
  std::vector<CoverSphere> balls;
  double level = 0;
};

/// Searches for few balls that contain a solid and protrude little; unit frame. Results are proven
/// to contain the solid.
class [[gnu::visibility("hidden")]] CoverSearch {
 public:
  /// `look`: called now and then, from any thread, with a lower bound of the finished share [0, 1];
  /// exceptions from it end the search. `share`, `most`: as in SampledSolid.
  CoverSearch(const MeshSolid& solid, std::uint64_t seed, std::function<void(double)> look,
              LevelShare share = {}, double most = std::numeric_limits<double>::infinity())
      : solid_(solid), seed_(seed), look_(std::move(look)), share_(std::move(share)), most_(most) {}

  /// `count` balls, or fewer if these are as good. The level is proven only without shares.
  LeveledBalls with_count(std::size_t count) const;

  /// The number of balls that a plain greedy choice needs to protrude by no more than `level`; a
  /// smaller number if it exceeds `enough`.
  std::size_t greedy_count(double level, std::size_t enough = kMostCoverSpheres) const;

 private:
  const MeshSolid& solid_;
  const std::uint64_t seed_;
  const std::function<void(double)> look_;
  const LevelShare share_;
  const double most_;
};

/// A choice of `count` of the candidates that together contain all targets that any contains, if
/// one is found within so many exchanges and steps; else empty, also if none contains more than one
/// target in so many.
///
/// Starts greedily with the candidates that contain most of the remaining targets, and continues as
/// a tabu search: for some open target, the candidate that would help most is added, the one whose
/// removal costs least is removed, and targets that stay open gain weight. If candidates contain
/// much, an exchange takes many steps. `steps`: the remaining ones; those taken are subtracted, and
/// the search ends soon after none are left.
std::vector<std::uint32_t> choose_cover(std::span<const CoverSphere> candidates,
                                        std::span<const Eigen::Vector3d> targets, std::size_t count,
                                        std::size_t exchanges, std::uint64_t seed,
                                        std::int64_t& steps, std::size_t one_in = 50);

/// The same without exchanges and with as many as needed: the plain greedy choice.
std::vector<std::uint32_t> choose_greedily(std::span<const CoverSphere> candidates,
                                           std::span<const Eigen::Vector3d> targets);

}  // namespace ist
