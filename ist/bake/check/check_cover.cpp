#include <cmath>
#include <numeric>

#include "bake/check/check_spheres.h"

namespace ist {
namespace {

constexpr int kTaskDepth = 3;
constexpr double kSmallestCell = 1e-7;      // half edge, unit frame: smaller cells stay unproven
constexpr std::size_t kEnoughFailures = 8;  // a task stops after so many

struct Cell {
  Eigen::Vector3d centre;
  double half = 0;
  int depth = 0;
  bool inside = false;  ///< wholly inside the solid
};

using BallList = std::vector<std::uint32_t>;

/// Proves a cell covered: one cover ball contains it, or it lies outside the solid, or its octants
/// are proven. An uncovered point of the solid, or a cell too small to divide, is a violation.
class CoverProof {
 public:
  CoverProof(const AssetHeader& asset, const CheckedSolid& checked)
      : spheres_(at<Sphere>(asset, asset.inner_spheres)),
        covers_(at<float>(asset, asset.cover_radii)),
        checked_(checked) {}

  void prove(Cell cell, const BallList& parent, Tally& tally,
             std::vector<std::pair<Cell, BallList>>* later) const {
    if (tally.violations >= kEnoughFailures) return;
    const double corner = std::sqrt(3.0) * cell.half * (1 + 1e-12);
    BallList list;
    double gap = 10;  // from the cell's centre to the nearest cover ball
    std::size_t nearest = 0;
    for (const std::uint32_t i : parent) {
      const double c = covers_[i];
      const Eigen::Vector3d d =
          (cell.centre - Eigen::Vector3d(spheres_[i].x, spheres_[i].y, spheres_[i].z)).cwiseAbs();
      if ((d.array() + cell.half).matrix().norm() <= c) {
        tally.add(-1.0, i);
        return;
      }
      if ((d.array() - cell.half).cwiseMax(0.0).matrix().norm() <= c) list.push_back(i);
      if (d.norm() - c < gap) {
        gap = d.norm() - c;
        nearest = i;
      }
    }
    if (!cell.inside) {
      const double distance = checked_.distance(cell.centre, corner);
      if (distance > 0 && (gap > 0 || distance >= corner)) {
        const bool inside = checked_.winding(cell.centre) >= 1;
        if (!inside && distance >= corner) return;
        if (inside && gap > 0) return tally.add(gap, nearest);
        cell.inside = inside && distance >= corner;
      }
    } else if (gap > 0) {
      return tally.add(gap, nearest);
    }
    if (cell.half < kSmallestCell) return tally.add(cell.half, nearest);
    if (later != nullptr && cell.depth == kTaskDepth)
      return later->emplace_back(cell, list), void();
    for (int k = 0; k < 8; ++k) {
      const double h = cell.half / 2;
      const Eigen::Vector3d shift((k & 1) != 0 ? h : -h, (k & 2) != 0 ? h : -h,
                                  (k & 4) != 0 ? h : -h);
      prove({cell.centre + shift, h, cell.depth + 1, cell.inside}, list, tally, later);
    }
  }

 private:
  const Sphere* spheres_;
  const float* covers_;
  const CheckedSolid& checked_;
};

}  // namespace

Invariant check_cover(const AssetHeader& asset, const CheckedSolid& checked) {
  const CoverProof proof(asset, checked);
  BallList all(asset.sphere_count);
  std::iota(all.begin(), all.end(), 0u);
  const Cell root = {checked.bounds().center(), checked.bounds().sizes().maxCoeff() / 2 + 1e-9, 0,
                     false};
  std::vector<std::pair<Cell, BallList>> tasks;
  Tally tally;
  proof.prove(root, all, tally, &tasks);
  tally.add(tally_all(tasks.size(), [&](std::size_t i, Tally& part) {
    proof.prove(tasks[i].first, tasks[i].second, part, nullptr);
  }));
  return tally.named("solid covered",
                     "distance of a point of the solid from the nearest cover ball, or the size of "
                     "an unproven cell; −1 if all cells are proven, unit frame");
}

}  // namespace ist
