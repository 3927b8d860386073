#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// True if two triangles are proven not to meet beyond the corners and sides they share, by a plane
/// or by a line along an axis that separates them. In double, with a bound on the rounding. False
/// proves nothing: meet_elsewhere() decides.
bool seen_apart(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a, const Triangle& b);

/// True if two triangles meet beyond the corners and sides they share. Exact. Neither may be
/// degenerate.
bool meet_elsewhere(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a,
                    const Triangle& b);

/// [vertex] The number of triangles at the vertex if these are proven not to meet beyond the
/// corners and sides they share: they form a closed fan that, seen from some direction, goes once
/// around the vertex with all triangles facing the viewer. 0 proves nothing. `left_out` [triangle]:
/// a vertex all of whose triangles are marked 1 is skipped and gets 0; empty: no vertex is skipped.
/// Runs on the caller's TBB threads.
std::vector<std::uint32_t> spread_fans(const std::vector<Eigen::Vector3d>& vertices,
                                       const std::vector<Triangle>& triangles,
                                       const std::vector<std::uint8_t>& left_out = {});

/// Pairs of triangles that meet beyond shared corners and sides.
struct SelfIntersections {
  std::size_t count = 0;
  /// The smaller index first, sorted. Empty optional if there are more than ten million.
  std::optional<std::vector<std::array<std::uint32_t, 2>>> pairs;
};

/// Degenerate triangles are left out. Returns nothing if the search would take too long: more than
/// two million triangles, or a soup in which the boxes of more than 50 million pairs, and of 600 a
/// triangle, meet. Runs on the caller's TBB threads; the answer does not depend on their number.
/// `known_apart` [triangle]: no two triangles marked 1 meet, so their pairs are skipped; empty:
/// nothing is known.
std::optional<SelfIntersections> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    const std::vector<std::uint8_t>& known_apart = {});

/// Pairs of triangles, the smaller index first, sorted, whose boxes are no further than `margin`
/// [u] apart and for which `wanted` is true (thread-safe). Limits and threads as above.
std::optional<std::vector<std::array<std::uint32_t, 2>>> find_pairs(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    double margin, const std::function<bool(std::uint32_t, std::uint32_t)>& wanted);

}  // namespace ist
