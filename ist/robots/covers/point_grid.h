#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "base/hashing.h"
#include "mesh/connectivity/item_groups.h"

namespace ist {

/// The key of the grid cell that contains a point of the unit frame.
inline std::uint64_t cell_key(const Eigen::Vector3d& p, double cell) {
  std::uint64_t key = 0;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::int64_t>(std::floor(p[k] / cell));
    key = mixed(key + 0x9E3779B97F4A7C15ull + static_cast<std::uint64_t>(i));
  }
  return key;
}

/// Points in the cells of a grid that is rebuilt often: those of a row of cells are adjacent in
/// memory. Distances are float: results are for searches, not for proofs.
class PointGrid {
 public:
  struct Nearest {
    float distance2 = std::numeric_limits<float>::infinity();
    std::uint32_t place = UINT32_MAX;  ///< UINT32_MAX: no point is nearer
  };

  PointGrid() = default;

  explicit PointGrid(std::span<const Eigen::Vector3d> points);

  std::uint32_t size() const { return static_cast<std::uint32_t>(in_cells_.items.size()); }

  /// The index of a point, given its place in the grid's own order.
  std::uint32_t index(std::uint32_t place) const {
    return in_cells_.items[place];
  }  ///< as they were given
  Eigen::Vector3d point(std::uint32_t place) const {
    return {xyz_[0][place], xyz_[1][place], xyz_[2][place]};
  }

  /// Calls visit(place, distance²) for every point within `radius`, places ascending.
  template <class Visit>
  void within(const Eigen::Vector3d& p, double radius, const Visit& visit) const {
    if (size() == 0 || !(radius >= 0)) return;
    const Eigen::Vector3f c = p.cast<float>();
    const auto reach = static_cast<float>(radius);
    const auto [y_from, y_to] = cells(1, c.y() - reach, c.y() + reach);
    const auto [z_from, z_to] = cells(2, c.z() - reach, c.z() + reach);
    for (int z = z_from; z <= z_to; ++z)
      for (int y = y_from; y <= y_to; ++y) scan_row(c, y, z, reach * reach, visit);
  }

  /// The nearest point within `limit`, among equals the one with the smallest place. The search
  /// starts with the radius `guess`.
  Nearest nearest(const Eigen::Vector3d& p, double guess, double limit) const {
    const Eigen::Vector3f c = p.cast<float>();
    // Rows are visited outward from the middle, since near points prune the others.
    const auto outward = [](const std::pair<int, int>& range, int middle, const auto& take) {
      middle = std::clamp(middle, range.first, std::max(range.first, range.second));
      for (int i = middle; i <= range.second; ++i) take(i);
      for (int i = middle - 1; i >= range.first; --i) take(i);
    };
    const auto middle = [&](std::size_t axis, float x) {
      return static_cast<int>(
          std::clamp((x - low_[axis]) * per_cell_, 0.0f, static_cast<float>(count_[axis])));
    };
    Nearest best;
    for (double radius : {std::min(guess, limit), limit}) {
      if (size() == 0 || !(radius >= 0) || best.place != UINT32_MAX) break;
      const auto reach = static_cast<float>(radius);
      best.distance2 = reach * reach;
      const auto take = [&](std::uint32_t i, float d2) {
        if (d2 < best.distance2 || (d2 == best.distance2 && i < best.place)) best = {d2, i};
      };
      outward(cells(2, c.z() - reach, c.z() + reach), middle(2, c.z()), [&](int z) {
        outward(cells(1, c.y() - reach, c.y() + reach), middle(1, c.y()),
                [&](int y) { scan_row(c, y, z, best.distance2, take); });
      });
    }
    return best;
  }

 private:
  static constexpr std::uint32_t kLanes = 8;

  template <class Visit>
  void scan_row(const Eigen::Vector3f& c, int y, int z, float reach2, const Visit& visit) const {
    const float dy = outside(1, y, c.y()), dz = outside(2, z, c.z());
    const float left2 = reach2 - dy * dy - dz * dz;
    if (left2 < 0) return;
    const float half = std::sqrt(left2);
    const auto [x_from, x_to] = cells(0, c.x() - half, c.x() + half);
    if (x_from > x_to) return;
    const std::size_t row = (static_cast<std::size_t>(z) * static_cast<std::size_t>(count_[1]) +
                             static_cast<std::size_t>(y)) *
                            static_cast<std::size_t>(count_[0]);
    scan(c, in_cells_.first[row + static_cast<std::size_t>(x_from)],
         in_cells_.first[row + static_cast<std::size_t>(x_to) + 1], reach2, visit);
  }

  template <class Visit>
  void scan(const Eigen::Vector3f& c, std::uint32_t from, std::uint32_t to, float reach2,
            const Visit& visit) const {
    for (std::uint32_t i = from; i < to; i += kLanes) {
      std::array<float, kLanes> d2;  // the arrays are longer than the points by so much
      for (std::uint32_t k = 0; k < kLanes; ++k) {
        const float x = xyz_[0][i + k] - c.x(), y = xyz_[1][i + k] - c.y(),
                    z = xyz_[2][i + k] - c.z();
        d2[k] = x * x + y * y + z * z;
      }
      const std::uint32_t last = std::min(kLanes, to - i);
      for (std::uint32_t k = 0; k < last; ++k)
        if (d2[k] <= reach2) visit(i + k, d2[k]);
    }
  }

  /// First and last cell of an interval along an axis; empty if the first is above the last.
  std::pair<int, int> cells(std::size_t axis, float low, float high) const {
    const auto last = static_cast<float>(count_[axis] - 1);
    const float from = (low - low_[axis]) * per_cell_, to = (high - low_[axis]) * per_cell_;
    if (to < -0.01f || from > last + 1.01f) return {1, 0};
    return {static_cast<int>(std::clamp(from - 0.01f, 0.0f, last)),
            static_cast<int>(std::clamp(to + 0.01f, 0.0f, last))};
  }

  /// The distance from a coordinate to a cell, or slightly less.
  float outside(std::size_t axis, int cell, float x) const {
    const float from = low_[axis] + static_cast<float>(cell) * cell_;
    return std::max({0.0f, from - x - 0.01f * cell_, x - from - 1.01f * cell_});
  }

  std::array<float, 3> low_{};
  std::array<int, 3> count_{};
  float cell_ = 1, per_cell_ = 1;
  ItemGroups<> in_cells_;  ///< x runs fastest
  std::array<std::vector<float>, 3> xyz_;
};

}  // namespace ist
