#include "mesh/winding.h"

#include <algorithm>

#include "mesh/line_lattice.h"
#include "mesh/triangles_in_box.h"

namespace ist {

int winding_number(const MeshView& mesh, const double p[3]) {
  int winding = 0;
  const RayBox box = RayBox::ray(p);
  none_about_box(mesh, box.lower, box.upper, [&](const Corners& t) {
    winding += ray_winding(t, p);
    return false;
  });
  return winding;
}

void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out) {
  out.clear();
  const double yz[2] = {y, z};
  const RayBox box = RayBox::line(y, z);
  none_about_box(mesh, box.lower, box.upper, [&](const Corners& t) {
    const int facing = pierced(t, yz);
    if (facing != 0) out.push_back({crossing_x(t, yz), -facing});
    return false;
  });
  std::sort(out.begin(), out.end(), comes_before);
}

}  // namespace ist
