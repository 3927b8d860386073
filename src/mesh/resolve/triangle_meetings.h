#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/edge_table.h"
#include "mesh/resolve/exact_points.h"
#include "mesh/resolve/watched_work.h"

namespace ist {

/// Where two triangles meet: in one plane, or from one point to another.
struct Meeting {
  std::array<std::uint32_t, 2> triangles;
  bool coplanar = false;
  std::uint32_t from = kNoIndex, to = kNoIndex;  ///< points; equal where it is one point
};

/// The meetings of pairs of triangles that meet, in their order; new points are added in an order
/// that does not depend on threads. Throws Unresolvable where the pairs contradict themselves, and
/// as `work` does, of which this is `share`.
std::vector<Meeting> find_meetings(ExactPoints& points, const std::vector<Triangle>& triangles,
                                   std::span<const std::array<std::uint32_t, 2>> pairs,
                                   WatchedWork& work, double share);

}  // namespace ist
