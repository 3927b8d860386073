#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/edge_table.h"

namespace ist {

/// Whether two triangles meet elsewhere than in the corners and sides they share. Exact. Neither
/// may be degenerate.
bool meet_elsewhere(const std::vector<Eigen::Vector3d>& vertices, const Triangle& a,
                    const Triangle& b);

/// Pairs of triangles that meet elsewhere than in shared corners and sides, degenerate ones left
/// out. Nothing where counting would take too long: more than two million triangles, or a soup in
/// which too many are close together. Runs on all cores; the answer does not depend on their
/// number.
std::optional<std::size_t> count_self_intersections(const std::vector<Eigen::Vector3d>& vertices,
                                                    const std::vector<Triangle>& triangles);

/// Those pairs, the smaller index first, sorted. Nothing where there are too many or counting would
/// take too long.
std::optional<std::vector<std::array<std::uint32_t, 2>>> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles);

}  // namespace ist
