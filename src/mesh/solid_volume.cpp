#include "mesh/solid_volume.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace ist {
namespace {

constexpr int kMaxLevel = 20;
constexpr std::uint64_t kMaxUndecided = 1'000'000;

/// What an octree's levels make of the volume, in units of the root cell.
struct Levels {
  int finest = 0;
  std::array<double, kMaxLevel + 1> volume{};  ///< if refinement ended at this level
  std::uint64_t undecided = 0;                 ///< cells at the finest level
};

void visit(const Solid& solid, const Eigen::Vector3d& centre, double half, int level,
           Levels& levels) {
  const double cell = std::ldexp(1.0, -3 * level);
  const double distance = solid.signed_distance(centre);
  const double half_diagonal = half * 1.7320508075688774;
  if (std::abs(distance) >= half_diagonal) {
    if (distance > 0)
      for (int finer = level; finer <= levels.finest; ++finer)
        levels.volume[std::size_t(finer)] += cell;
    return;
  }
  // Exact for planes along the axes, right on average for all others.
  levels.volume[std::size_t(level)] += cell * std::clamp(0.5 + distance / (2 * half), 0.0, 1.0);
  if (level == levels.finest) {
    ++levels.undecided;
    return;
  }
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d side((i & 1) ? half : -half, (i & 2) ? half : -half,
                               (i & 4) ? half : -half);
    visit(solid, centre + side / 2, half / 2, level + 1, levels);
  }
}

}  // namespace

IntegratedVolume integrate_volume(const Solid& solid) {
  const Eigen::AlignedBox3d bounds = solid.bounds();
  const double half = (bounds.max() / 2 - bounds.min() / 2).maxCoeff();
  Levels levels;
  for (int finest = 6; finest <= kMaxLevel; ++finest) {
    levels = Levels();
    levels.finest = finest;
    visit(solid, bounds.min() / 2 + bounds.max() / 2, half, 0, levels);
    if (4 * levels.undecided > kMaxUndecided) break;
  }
  const double* last = &levels.volume[std::size_t(levels.finest)];
  const double change = std::max(2 * std::abs(last[0] - last[-1]), std::abs(last[-1] - last[-2]));
  const double chance = std::sqrt(double(levels.undecided)) * std::ldexp(0.2, -3 * levels.finest);
  const double root = 8 * half * half * half;
  return {root * last[0], root * (change + chance)};
}

}  // namespace ist
