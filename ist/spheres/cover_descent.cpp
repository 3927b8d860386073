#include "spheres/cover_descent.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "spheres/offset_surface.h"
#include "spheres/recentre.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kLastStep = 0.003;
constexpr int kPatience = 5;  ///< rounds at a level without gain

}  // namespace

/// All balls at one level, a little below that of the surface: where the solid is convex, the
/// largest ball shrinks as the level falls, and elsewhere nearly.
class CoverDescent::Round {
 public:
  Round(const CoverDescent& descent, const OffsetSurface& surface, double level,
        std::vector<Vector3d> centres)
      : descent_(descent),
        surface_(surface),
        level_(level),
        centres_(std::move(centres)),
        trust_(centres_.size(), 0.5 * level),
        holders_(descent.targets_.size(), 0) {
    for (const Vector3d& c : centres_) radii_.push_back(radius_at(c));
    for (std::size_t i = 0; i < centres_.size(); ++i) count(i, 1);
  }

  const std::vector<Vector3d>& centres() const { return centres_; }

  /// By how much the worst target is short of its nearest ball; 0 where all are held.
  double worst() const {
    double worst = 0;
    for (std::size_t x = 0; x < holders_.size(); ++x) {
      if (holders_[x] != 0) continue;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < centres_.size(); ++i)
        least = std::min(least,
                         std::sqrt((descent_.targets_[x] - centres_[i]).squaredNorm()) - radii_[i]);
      worst = std::max(worst, least);
    }
    return worst;
  }

  void move_all() {
    for (std::size_t i = 0; i < centres_.size(); ++i) move(i);
  }

 private:
  void count(std::size_t i, int by) {
    descent_.tree_.within(centres_[i], radii_[i],
                          [&](std::uint32_t x, double) { holders_[x] += by; });
  }

  double radius_at(const Vector3d& c) const {
    return surface_.radius(c) - (surface_.level() - level_);
  }

  void move(std::size_t i) {
    const double level = level_;
    if (!(radii_[i] > 0)) return;
    const double within2 = radii_[i] * radii_[i];
    needed_.clear();
    bool short_of_one = false;
    descent_.tree_.within(centres_[i], radii_[i] + kReach * level, [&](std::uint32_t x, double d2) {
      if (holders_[x] != (d2 <= within2 ? 1 : 0)) return;
      needed_.push_back(descent_.targets_[x]);
      short_of_one = short_of_one || d2 > within2;
    });
    if (!short_of_one) return;
    const double trust = trust_[i];
    walls_.clear();
    surface_.walls(centres_[i], radii_[i] + (surface_.level() - level) + 2 * trust, walls_);
    const Recentred moved = recentre(centres_[i], needed_, walls_, trust);
    const double radius = radius_at(moved.centre);
    const double way = std::sqrt((moved.centre - centres_[i]).squaredNorm());
    trust_[i] = std::clamp(way > 0 ? 2 * way : 0.5 * trust, 0.02 * level, 0.7 * level);
    if (!(radius > 0) || !(way > 0)) return;
    count(i, -1);
    centres_[i] = moved.centre;
    radii_[i] = radius;
    count(i, 1);
  }

  static constexpr double kReach = 0.7;  ///< levels beyond its surface a ball looks at

  const CoverDescent& descent_;
  const OffsetSurface& surface_;
  const double level_;
  std::vector<Vector3d> centres_;
  std::vector<double> radii_, trust_;
  std::vector<int> holders_;  ///< balls that hold a target
  std::vector<Vector3d> needed_, walls_;
};

LevelCover CoverDescent::improve(LevelCover cover, double step, int rounds) const {
  const OffsetSurface surface(solid_, sampled_, cover.level);
  while (step > kLastStep && rounds > 0) {
    const double aim = cover.level * (1 - step);
    Round round(*this, surface, aim, cover.centres);
    double best_here = std::numeric_limits<double>::infinity();
    bool gained = false;
    for (int idle = 0; idle < kPatience && rounds > 0; --rounds) {
      round.move_all();
      const double level = aim + round.worst();
      if (level < cover.level * (1 - 1e-4)) {
        cover = {round.centres(), level};
        gained = true;
      }
      if (level <= aim) break;
      if (level < best_here * (1 - 1e-3)) {
        best_here = level;
        idle = 0;
      } else {
        ++idle;
      }
    }
    if (!gained) step *= 0.5;
  }
  return cover;
}

}  // namespace ist
