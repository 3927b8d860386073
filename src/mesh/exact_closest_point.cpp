#include "mesh/exact_closest_point.h"

#include <cmath>

#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"

namespace ist {

ClosestPoint exact_closest_point(const MeshView& mesh, const Eigen::Vector3d& p, double limit) {
  const ExactReach reach(p.data());
  ClosestPoint best;
  best.distance = limit;
  best.triangle = kNoTriangle;
  double best2 = limit * limit;
  float radius2 = reach.reach2(best2);
  for_triangles_near(mesh, reach.p, radius2, [&](const NearTriangle& near) {
    const std::uint32_t* t = mesh.triangles + 3 * std::size_t{near.triangle};
    const auto corner = [&](int i) { return mesh.vertices + 3 * std::size_t{t[i]}; };
    double point[3];
    const double distance2 = exact_closest_in({corner(0), corner(1), corner(2)}, p.data(), point);
    if (distance2 < best2 ||
        (distance2 == best2 && near.triangle < best.triangle && best.triangle != kNoTriangle)) {
      best2 = distance2;
      best.triangle = near.triangle;
      best.point = {point[0], point[1], point[2]};
      radius2 = reach.reach2(best2);
    }
    return radius2;
  });
  if (best.triangle != kNoTriangle) best.distance = std::sqrt(best2);
  return best;
}

}  // namespace ist
