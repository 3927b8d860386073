#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <ist/solid.h>

namespace ist::benchmark {

/// The plain way to an overlap volume: grids of both signed distances. The volume is that of the
/// voxels of B's grid inside of B whose centre is inside A by trilinear interpolation. Both grids
/// have the same spacing.
class SdfVoxels {
 public:
  /// `spacing` [u]. Samples the solid at every grid node, and lists the voxels inside it.
  SdfVoxels(const Solid& solid, double spacing) : spacing_(spacing) {
    const Eigen::AlignedBox3d box = solid.bounds();
    origin_ = box.min() - Eigen::Vector3d::Constant(1.5 * spacing);
    for (int k = 0; k < 3; ++k) {
      nodes_[k] = static_cast<int>(std::ceil(box.sizes()[k] / spacing)) + 4;
    }
    for (int z = 0; z < nodes_[2]; ++z) {
      for (int y = 0; y < nodes_[1]; ++y) {
        for (int x = 0; x < nodes_[0]; ++x) {
          const Eigen::Vector3d at = origin_ + spacing * Eigen::Vector3d(x, y, z);
          depth_.push_back(static_cast<float>(-solid.signed_distance(at)));
          if (depth_.back() > 0) inside_.push_back(at);
        }
      }
    }
  }

  /// [u³] overlap with B, whose frame `b_to_a` takes into this frame after a uniform scale: looks
  /// at every voxel of B's grid, whatever the pose, for the smaller of both depths.
  double overlap_of_all(const SdfVoxels& b, const Eigen::Isometry3d& b_to_a, double scale_b) const {
    const Eigen::Matrix3d to_grid = b_to_a.linear() * (scale_b / spacing_);
    const Eigen::Vector3d shift = (b_to_a.translation() - origin_) / spacing_;
    std::size_t count = 0;
    const float* depth_b = b.depth_.data();
    for (int z = 0; z < b.nodes_[2]; ++z) {
      for (int y = 0; y < b.nodes_[1]; ++y) {
        for (int x = 0; x < b.nodes_[0]; ++x, ++depth_b) {
          const Eigen::Vector3d voxel = b.origin_ + b.spacing_ * Eigen::Vector3d(x, y, z);
          count += std::min<double>(depth(to_grid * voxel + shift), *depth_b) > 0;
        }
      }
    }
    return static_cast<double>(count) * std::pow(scale_b * b.spacing_, 3);
  }

  /// The same of the voxels inside of B alone, which are listed beforehand.
  double overlap(const SdfVoxels& b, const Eigen::Isometry3d& b_to_a, double scale_b) const {
    const Eigen::Matrix3d to_grid = b_to_a.linear() * (scale_b / spacing_);
    const Eigen::Vector3d shift = (b_to_a.translation() - origin_) / spacing_;
    std::size_t count = 0;
    for (const Eigen::Vector3d& voxel : b.inside_) count += depth(to_grid * voxel + shift) > 0;
    return static_cast<double>(count) * std::pow(scale_b * b.spacing_, 3);
  }

 private:
  /// [u] below the surface, of a point in grid coordinates; −1 outside of the grid.
  double depth(const Eigen::Vector3d& grid) const {
    for (int k = 0; k < 3; ++k) {
      if (!(grid[k] >= 0 && grid[k] < nodes_[k] - 1)) return -1;
    }
    const int x = static_cast<int>(grid.x()), y = static_cast<int>(grid.y()),
              z = static_cast<int>(grid.z());
    const double u = grid.x() - x, v = grid.y() - y, w = grid.z() - z;
    const auto row = [&](int j, int k) {
      const std::size_t i =
          static_cast<std::size_t>(((z + k) * nodes_[1] + (y + j)) * nodes_[0] + x);
      return (1 - u) * depth_[i] + u * depth_[i + 1];
    };
    return (1 - w) * ((1 - v) * row(0, 0) + v * row(1, 0)) +
           w * ((1 - v) * row(0, 1) + v * row(1, 1));
  }

  double spacing_;
  Eigen::Vector3d origin_;
  int nodes_[3] = {};
  std::vector<float> depth_;             ///< [u] at the nodes, x fastest
  std::vector<Eigen::Vector3d> inside_;  ///< [u] centres of the voxels inside
};

}  // namespace ist::benchmark
