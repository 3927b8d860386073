#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <optional>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// True: two triangles are proven not to meet elsewhere than in the corners and sides they share,
/// by a plane or by a line along an axis that keeps them apart. In double, with a bound on the
/// rounding. False says nothing: meet_elsewhere() decides.
bool seen_apart(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a, const Triangle& b);

/// Whether two triangles meet beyond the corners and sides they share. Exact. Neither is
/// degenerate.
bool meet_elsewhere(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a,
                    const Triangle& b);

/// [vertex] The number of triangles about it where these are proven not to meet elsewhere than in
/// the corners and sides they share: they follow one another in a closed fan that, seen from some
/// direction, goes once around the vertex and has all its triangles facing the viewer. 0 says
/// nothing. `left_out` [triangle]: a vertex all of whose triangles have a 1 there is not looked at
/// and gets 0; empty: every vertex is looked at. On the caller's TBB threads.
std::vector<std::uint32_t> spread_fans(const std::vector<Eigen::Vector3d>& vertices,
                                       const std::vector<Triangle>& triangles,
                                       const std::vector<std::uint8_t>& left_out = {});

/// Pairs of triangles that meet elsewhere than in shared corners and sides.
struct SelfIntersections {
  std::size_t count = 0;
  /// The smaller index first, sorted. Nothing where there are more than ten million.
  std::optional<std::vector<std::array<std::uint32_t, 2>>> pairs;
};

/// Degenerate triangles are left out. Nothing where looking would take too long: more than two
/// million triangles, or a soup in which the boxes of more than 50 million pairs, and of 600 a
/// triangle, meet. Runs on the caller's TBB threads; the answer does not depend on their number.
/// `known_apart` [triangle]: no two triangles that have a 1 there meet, as the caller knows, and
/// such pairs are not looked at; empty: nothing is known.
std::optional<SelfIntersections> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    const std::vector<std::uint8_t>& known_apart = {});

/// Pairs of triangles, the smaller index first, sorted, whose boxes are no further than `margin`
/// [u] apart and for which `wanted` holds (thread-safe). Limits and threads as above.
std::optional<std::vector<std::array<std::uint32_t, 2>>> find_pairs(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    double margin, const std::function<bool(std::uint32_t, std::uint32_t)>& wanted);

}  // namespace ist
