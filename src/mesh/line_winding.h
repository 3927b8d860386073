#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mesh/edge_table.h"
#include "mesh/shells.h"

namespace ist {

/// Winding numbers of points around each of several closed shells, by the signed crossings of a
/// line parallel to x. Edges and vertices on the line are counted once and consistently.
class LineWinding {
 public:
  /// Keeps references.
  LineWinding(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
              const Shells& shells);

  /// Sets numbers[s] to the winding number of shell s around p, for every shell in `shells_met`,
  /// which lists those where it may differ from 0. `numbers` must come in as zeros.
  void around(const Eigen::Vector3d& p, std::vector<int>& numbers,
              std::vector<std::uint32_t>& shells_met) const;

 private:
  std::size_t column(double y, double z) const;

  const std::vector<Eigen::Vector3d>& vertices_;
  const std::vector<Triangle>& triangles_;
  const Shells& shells_;
  // Triangles by the cells that their projection onto the yz plane may touch.
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero(), cells_per_unit_ = Eigen::Vector2d::Zero();
  std::size_t cells_ = 1;  ///< in each direction
  std::vector<std::size_t> begin_;
  std::vector<std::uint32_t> listed_;
};

}  // namespace ist
