#include "robots/covers/point_grid.h"

#include <Eigen/Geometry>

namespace ist {

PointGrid::PointGrid(std::span<const Eigen::Vector3d> points) {
  if (points.empty()) return;
  constexpr double kCells = 32;  // along the longest axis
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& p : points) box.extend(p);
  const double cell = std::max(box.sizes().maxCoeff() / kCells, 1e-9);
  cell_ = static_cast<float>(cell);
  per_cell_ = 1 / cell_;
  std::size_t cells = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<int>(k);
    low_[k] = static_cast<float>(box.min()[axis]);
    count_[k] = 1 + static_cast<int>((box.max()[axis] - box.min()[axis]) / cell);
    cells *= static_cast<std::size_t>(count_[k]);
  }
  const auto cell_of = [&](const Eigen::Vector3d& p) {
    std::size_t at = 0;
    for (std::size_t k = 3; k-- > 0;) {
      const float x = (static_cast<float>(p[static_cast<int>(k)]) - low_[k]) * per_cell_;
      const int i = std::clamp(static_cast<int>(x), 0, count_[k] - 1);
      at = at * static_cast<std::size_t>(count_[k]) + static_cast<std::size_t>(i);
    }
    return at;
  };
  in_cells_ = ItemGroups<>(cells, [&](const auto& visit) {
    for (std::uint32_t i = 0; i < points.size(); ++i) visit(cell_of(points[i]), i);
  });
  for (std::size_t k = 0; k < 3; ++k) {
    xyz_[k].assign(points.size() + kLanes, 1e30f);
    for (std::uint32_t place = 0; place < size(); ++place)
      xyz_[k][place] = static_cast<float>(points[index(place)][static_cast<int>(k)]);
  }
}

}  // namespace ist
