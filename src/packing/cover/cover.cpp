#include "packing/cover/cover.h"

#include <numbers>

#include <ist/error.h>

#include "numerics/roots.h"
#include "numerics/rounding.h"
#include "packing/cover/cover_cells.h"
#include "stage/stage.h"

namespace ist {

std::vector<float> cover_radii(const MeshSolid& solid, SolidBackend& backend,
                               std::span<const Sphere> inner, const ProgressCallback& progress) {
  if (inner.empty()) throw Error("cover: no inner spheres");
  Stage stage("cover", progress);
  stage.step(inner.size(), 0);

  std::vector<CoverBall> balls;
  for (const Sphere& s : inner) balls.push_back({s.x, s.y, s.z, s.r});
  const Eigen::AlignedBox3d box(solid.frame().to_unit(solid.bounds().min()),
                                solid.frame().to_unit(solid.bounds().max()));
  const Eigen::Vector3d middle = box.center();
  const double mean_volume = solid.unit_volume() / static_cast<double>(inner.size());
  CoverTask task;
  task.balls = balls;
  task.slack = kCoverSlack * cube_root(3 * mean_volume / (4 * std::numbers::pi));
  for (int k = 0; k < 3; ++k) task.middle[k] = middle[k];
  task.half = 0.5 * box.sizes().maxCoeff() + 1e-9;  // the cube around the box, rounding included
  const std::vector<double> exact =
      backend.cover_radii(task, [&](int depth) { stage.step(inner.size(), 1 - 1.0 / depth); });
  std::vector<float> radii(inner.size());
  for (std::size_t k = 0; k < radii.size(); ++k) radii[k] = rounded_up(exact[k]);
  stage.step(inner.size(), 1);
  return radii;
}

}  // namespace ist
