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

/// A cover at its level, and its balls as they were looked at.
struct LookedCover {
  LevelCover cover;
  std::vector<CoverSphere> balls;  ///< unit frame
};

/// Moves centres so that the level falls. One ball at a time: of the targets that no other ball
/// contains at a level a little lower, its farthest is brought as near as can be.
///
/// What samples do not tell is looked for as it goes on: places of the surface outside all balls
/// become targets, and places that a ball reaches beyond the level become rays.
class [[gnu::visibility("hidden")]] CoverDescent {
 public:
  /// `sampled`: takes the targets and rays that are found.
  CoverDescent(const MeshSolid& solid, SampledSolid& sampled) : solid_(solid), sampled_(sampled) {}

  /// Starts from centres that contain the samples, at about the level given, and ends when the
  /// level falls by a few thousandths no more, or after so many rounds over all balls. The level
  /// that comes back is about that of the surface itself (open_corners(), rays): a guess. `look` is
  /// called now and then.
  LookedCover improve(LevelCover start, int rounds, const std::function<void()>& look);

 private:
  struct Balls;
  class Round;
  double add_targets(const std::vector<CoverSphere>& balls, double level);
  double add_void(const std::vector<CoverSphere>& balls, double level);
  double add_rays(const OffsetSurface& surface, const std::vector<CoverSphere>& balls);

  const MeshSolid& solid_;
  SampledSolid& sampled_;
  std::vector<CoverSphere> vouched_;    ///< centres, and levels which they were seen to keep to
  std::vector<std::uint32_t> holders_;  ///< of triangles, at the last look
};

/// Largest protrusion by count of spheres, of the counts that were tried; at least one.
using TriedCounts = std::map<std::size_t, double>;

/// The largest protrusion of so many spheres: the least one that was tried with as many or fewer,
/// else an estimate between and beyond the counts tried.
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
