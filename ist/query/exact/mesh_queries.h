#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/relative_pose.h"
#include "query/exact/inside_search.h"

// What a point and a ray are told by a mesh. Nothing allocates, locks or throws; the answers are
// the same on every instruction set.

namespace ist {

bool is_inside(const MeshOfPair& solid, const exact::Point& p,
               const exact::Point& aside = {0, 0, 0}) noexcept;

/// Where a way enters or leaves a mesh first.
struct MeshHit {
  double t = HUGE_VAL;           ///< of the way, 0 … 1; HUGE_VAL: nowhere
  std::uint32_t triangle = ~0u;  ///< 16 · block + lane
  exact::Point normal = {};      ///< outward, twice the area long
};

/// Along the way from p to q, unit frame. Signs are exact: no way slips through an edge or vertex.
MeshHit first_hit(const MeshTree& mesh, const exact::Point& p, const exact::Point& q) noexcept;

/// The point of a mesh that is nearest to p, unit frame; none, if all are as far as `limit`.
struct MeshFoot {
  double squared = HUGE_VAL;  ///< distance
  exact::Point at = {};
  std::uint32_t triangle = ~0u;  ///< 16 · block + lane; of equally near ones any
  exact::Point normal = {};      ///< outward, twice the area long
};
MeshFoot nearest_on(const MeshTree& mesh, const exact::Point& p, double limit = HUGE_VAL) noexcept;

}  // namespace ist
