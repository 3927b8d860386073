#pragma once

#include <cstdint>
#include <vector>

#include <ist/query.h>

namespace ist::testing {

/// A batch's separations, an array each.
struct SeparationColumns {
  std::vector<double> distance, distance_min, distance_max, point_a, point_b, normal;
  std::vector<QueryStatus> status;
  std::vector<std::uint32_t> visits, spheres;

  std::vector<Separation> rows() const {
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<Separation> out(distance.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].distance = distance[i];
      out[i].distance_min = distance_min[i];
      out[i].distance_max = distance_max[i];
      out[i].point_a = vector(point_a, i);
      out[i].point_b = vector(point_b, i);
      out[i].normal = vector(normal, i);
      out[i].status = status[i];
      out[i].node_visits = visits[i];
      out[i].sphere_pairs = spheres[i];
    }
    return out;
  }
};

}  // namespace ist::testing
