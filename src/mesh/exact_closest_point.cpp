#include "mesh/exact_closest_point.h"

#include <cmath>

#include "mesh/closest_point.h"

namespace ist {
namespace {

/// A float at or above a squared distance; large ones all count as infinitely far.
float ceil_distance2(double distance2) {
  return distance2 < 1e30 ? static_cast<float>(distance2) * (1 + 0x1p-20f) + 1e-37f : 1e35f;
}

}  // namespace

ClosestPoint exact_closest_point(const MeshView& mesh, const Eigen::Vector3d& p, double limit) {
  const float rounded[3] = {static_cast<float>(p.x()), static_cast<float>(p.y()),
                            static_cast<float>(p.z())};
  const float error =
      float_distance_error(static_cast<float>(p.cwiseAbs().maxCoeff()) * (1 + 0x1p-20f));
  // A triangle may lie within `distance2` only if its float distance² is at most this.
  const auto reach2 = [error](double distance2) {
    return prune_distance2(ceil_distance2(distance2), error);
  };
  ClosestPoint best;
  best.distance = limit;
  best.triangle = kNoTriangle;
  double best2 = limit * limit;
  float radius2 = reach2(best2);
  for_triangles_near(mesh, rounded, radius2, [&](const NearTriangle& near) {
    const std::uint32_t* t = mesh.triangles + 3 * std::size_t{near.triangle};
    const auto corner = [&](int i) { return mesh.vertices_exact + 3 * std::size_t{t[i]}; };
    const TriangleFrame<double> frame = make_triangle_frame(corner(0), corner(1), corner(2));
    const FramePoint<double> q = closest_in_frame(frame, p.data());
    if (q.distance2 < best2 ||
        (q.distance2 == best2 && near.triangle < best.triangle && best.triangle != kNoTriangle)) {
      best2 = q.distance2;
      best.triangle = near.triangle;
      for (int k = 0; k < 3; ++k)
        best.point[k] = frame.origin[k] + (q.x * frame.u[k] + q.y * frame.v[k]);
      radius2 = reach2(best2);
    }
    return radius2;
  });
  if (best.triangle != kNoTriangle) best.distance = std::sqrt(best2);
  return best;
}

}  // namespace ist
