#pragma once

#include <cmath>
#include <cstdint>

#include "query/base/relative_pose.h"
#include "query/exact/inside_search.h"

// Queries of a mesh by points and rays. Nothing allocates, locks or throws. Answers are the same on
// every instruction set.

namespace ist {

bool is_inside(const MeshOfPair& solid, const exact::Point& p,
               const exact::Point& aside = {0, 0, 0}) noexcept;

/// The first point where a segment enters or leaves a mesh.
struct MeshHit {
  double t = HUGE_VAL;  ///< the position on the segment, 0 … 1; HUGE_VAL if there is none
  std::uint32_t triangle = ~0u;  ///< 16 · block + lane
  exact::Point normal = {};      ///< outward, twice the area long
};

/// The first hit of the segment from p to q, unit frame. Signs are exact, so no segment slips
/// through an edge or vertex.
MeshHit first_hit(const MeshTree& mesh, const exact::Point& p, const exact::Point& q) noexcept;

/// The point of a mesh that is nearest to p, unit frame; none if all are as far as `limit`.
struct MeshFoot {
  double squared = HUGE_VAL;  ///< distance
  exact::Point at = {};
  std::uint32_t triangle = ~0u;  ///< 16 · block + lane; of equally near ones any
  exact::Point normal = {};      ///< outward, twice the area long
};
MeshFoot nearest_on(const MeshTree& mesh, const exact::Point& p, double limit = HUGE_VAL) noexcept;

}  // namespace ist
