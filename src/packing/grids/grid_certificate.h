#pragma once

#include "packing/base/certificate.h"
#include "packing/grids/grid_candidate.h"
#include "packing/grids/local_winding.h"
#include "packing/grids/nearest_primitive.h"

namespace ist::packing {

/// The radius that surface and spheres leave to a candidate, in double (docs/design.md 3.2); 0 if
/// its centre is not in the solid. Other winners of its round are checked by overlap().
template <class Team>
IST_HD double certified_room(const Team& team, const GridScene& scene,
                             const GridCandidate& candidate) {
  if (!inside_solid(team, scene, candidate.centre)) return 0;
  const double p[3] = {candidate.centre.x, candidate.centre.y, candidate.centre.z};
  double room = candidate.radius;
  for_primitives_near(
      team, scene.grid, candidate.centre, [&] { return candidate.radius; },
      [&](std::uint32_t tag) {
        if (distance_to(scene, tag, candidate.centre) > candidate.radius + kSearchMargin) return;
        double gap = 0;
        if ((tag & kTriangleTag) != 0) {
          const Corners t = corners_of(scene, tag & ~kTriangleTag);
          double point[3];
          gap = gap_to_surface(std::sqrt(exact_closest_in(t, p, point)));
        } else {
          gap = gap_to_sphere(candidate.centre, scene.spheres[tag]);
        }
        room = gap < room ? gap : room;
      },
      [] {});
  return team.min(room);
}

}  // namespace ist::packing
