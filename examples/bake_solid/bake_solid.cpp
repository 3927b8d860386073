// Solids without a mesh file: one from boxes and balls, one from a function. Links ist::ist.
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main() try {
  const ist::PackingSettings settings{.max_spheres = 1'000};
  const auto mould =
      ist::make_difference(ist::make_box({0, 0, 0}, {1, 1, 0.5}), ist::make_ball({0, 0, 0.5}, 0.6));
  // A wavy rod: a slope of 1 along the radius and of 0.6 along x, so it is divided by both.
  const auto rod = ist::make_function_solid(
      [](const Eigen::Vector3d& x) {
        const double radius = 0.4 + 0.1 * std::sin(6 * x.x());
        const double around = (std::hypot(x.y(), x.z()) - radius) / std::hypot(1, 0.6);
        return std::max(around, std::abs(x.x()) - 1.5);
      },
      {Eigen::Vector3d(-1.6, -0.6, -0.6), Eigen::Vector3d(1.6, 0.6, 0.6)});
  const ist::Asset a = ist::bake(*mould, settings);
  const ist::Asset b = ist::bake(*rod, settings);
  const ist::Pose pose_b{.t = {0, 0, 0.6}};
  ist::Workspace scratch;
  const ist::Penetration p = ist::penetration({a.view(), {}}, {b.view(), pose_b}, {}, scratch);
  std::size_t violations = 0;
  for (const ist::Invariant& one : ist::check(b, *rod)) violations += one.violations;
  std::printf("overlap %g, %zu violations\n", p.volume, violations);
  return violations == 0 && p.volume > 0 ? 0 : 1;
} catch (const ist::Error& error) {
  return std::fprintf(stderr, "%s\n", error.what()), 1;
}
