#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/query.h>
#include <ist/types.h>

namespace ist::testing {

/// A pair of a batch on a GPU: solids by their number.
struct BatchPair {
  std::uint32_t a = 0, b = 0;
  Pose pose_a, pose_b;
  double scale_a = 1, scale_b = 1;
};

/// Pairs of a batch, an array each, in the host's memory.
struct PairColumns {
  std::vector<std::uint32_t> a, b;
  std::vector<Pose> pose_a, pose_b;
  std::vector<double> scale_a, scale_b;

  explicit PairColumns(const std::vector<BatchPair>& from) {
    for (const BatchPair& pair : from) {
      a.push_back(pair.a);
      b.push_back(pair.b);
      pose_a.push_back(pair.pose_a);
      pose_b.push_back(pair.pose_b);
      scale_a.push_back(pair.scale_a);
      scale_b.push_back(pair.scale_b);
    }
  }

  GpuPairs pairs() const {
    return {a.size(),
            {a.data(), pose_a.data(), scale_a.data()},
            {b.data(), pose_b.data(), scale_b.data()}};
  }
};

/// A batch's answers, an array each.
struct BatchColumns {
  std::vector<double> volume, centroid, push, turn;
  std::vector<QueryStatus> status;
  std::vector<std::uint32_t> visits, spheres;
  std::vector<double> least, most;
  std::vector<double> area, normal;
  std::vector<std::uint8_t> touching;

  /// Memory for answers of n pairs.
  static BatchColumns unwritten(std::size_t n) {
    constexpr double kUnwritten = -7;
    return {std::vector<double>(n, kUnwritten),
            std::vector<double>(3 * n),
            std::vector<double>(3 * n),
            std::vector<double>(3 * n),
            std::vector<QueryStatus>(n),
            std::vector<std::uint32_t>(n),
            std::vector<std::uint32_t>(n),
            std::vector<double>(n),
            std::vector<double>(n),
            std::vector<double>(n, kUnwritten),
            std::vector<double>(3 * n),
            std::vector<std::uint8_t>(n)};
  }

  GpuPenetrations answers() {
    GpuPenetrations to = {volume.data(), centroid.data(), push.data(),   turn.data(),
                          status.data(), visits.data(),   spheres.data()};
    to.volume_min = least.data();
    to.volume_max = most.data();
    to.contact_area = area.data();
    to.contact_normal = normal.data();
    to.touching = reinterpret_cast<bool*>(touching.data());
    return to;
  }

  std::vector<Penetration> rows() const {
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<Penetration> out(volume.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].volume = volume[i];
      out[i].volume_min = least[i];
      out[i].volume_max = most[i];
      out[i].centroid = vector(centroid, i);
      out[i].force = vector(push, i);
      out[i].torque = vector(turn, i);
      out[i].status = status[i];
      out[i].node_visits = visits[i];
      out[i].sphere_pairs = spheres[i];
      out[i].contact_area = area[i];
      out[i].contact_normal = vector(normal, i);
      out[i].touching = touching[i] != 0;
    }
    return out;
  }
};

}  // namespace ist::testing
