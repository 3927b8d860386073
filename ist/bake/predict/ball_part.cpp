#include "bake/predict/ball_part.h"

#include <algorithm>
#include <numbers>

#include "query/probe/patch_sums.h"

namespace ist {

using Eigen::Vector3d;

double ball_part(const MeshSolid& solid, const Vector3d& centre, double radius) {
  const MeshView& mesh = solid.arrays();
  const Vector3d at = solid.frame().to_unit(centre);
  ProbeBalls one = {};
  one.r[0] = one.reach = radius / solid.frame().scale();
  for (int k = 0; k < 3; ++k) one.origin[k] = at[k];
  const auto add = [&](const ProbeBalls& balls, ProbeSums& sums) {
    for (std::uint32_t first = 0; first < mesh.triangle_count; first += kWidth) {
      TriangleCorners corners = {};
      const std::uint32_t count = std::min(kWidth, mesh.triangle_count - first);
      for (std::uint32_t i = 0; i < count; ++i)
        for (std::uint32_t c = 0; c < 3; ++c) {
          const double* const x =
              mesh.vertices + std::size_t{3} * mesh.triangles[std::size_t{3} * (first + i) + c];
          corners.x[c][i] = x[0];
          corners.y[c][i] = x[1];
          corners.z[c][i] = x[2];
        }
      SurfacePatch patch;
      make_patch(corners, patch);
      const std::uint32_t near = triangles_near(patch, balls.origin, balls.reach);
      if (near != 0) add_patch(patch, near, balls, 1, sums);
    }
  };
  ProbeSums sums;
  add(one, sums);
  off_edges(one, sums, add);
  const double r = one.r[0], whole = 4 * std::numbers::pi / 3 * (r * r * r);
  const double held = solid.inside(at) ? whole : 0;
  const double volume = std::clamp(held + ((sums.met & 1) != 0 ? sums.cones[0] : 0), 0.0, whole);
  const double unit = solid.frame().scale();
  return volume * (unit * unit * unit);
}

}  // namespace ist
