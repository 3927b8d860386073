#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/pose.h>
#include <ist/query.h>

namespace ist::testing {

/// A pair of a batch on a GPU: assets by their number.
struct BatchPair {
  std::uint32_t a = 0, b = 0;
  Pose pose_a, pose_b;
  double scale_a = 1, scale_b = 1;
};

/// A batch's answers, an array each.
struct BatchColumns {
  std::vector<double> volume, centroid, push, turn;
  std::vector<QueryStatus> status;
  std::vector<std::uint32_t> visits, spheres;

  std::vector<Penetration> rows() const {
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<Penetration> out(volume.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].volume = volume[i];
      out[i].centroid = vector(centroid, i);
      out[i].translation_gradient = vector(push, i);
      out[i].rotation_gradient = vector(turn, i);
      out[i].status = status[i];
      out[i].node_visits = visits[i];
      out[i].sphere_pairs = spheres[i];
    }
    return out;
  }
};

}  // namespace ist::testing
