#pragma once

#include <cstdint>
#include <vector>

#include <ist/query.h>

namespace ist::testing {

/// A pair's contact, whole and in patches.
struct PatchedPair {
  Penetration whole;
  std::vector<ContactPatch> patches;
};

/// A batch's patches, an array each.
struct PatchColumns {
  std::uint32_t most;
  std::vector<std::uint32_t> count;
  std::vector<std::uint64_t> id;
  std::vector<double> centroid, normal, area, depth, volume, force, torque, point, torsion;

  std::vector<PatchedPair> rows(const std::vector<Penetration>& wholes) const {
    const auto vector = [](const std::vector<double>& from, std::size_t i) {
      return Eigen::Vector3d(from[3 * i], from[3 * i + 1], from[3 * i + 2]);
    };
    std::vector<PatchedPair> out(wholes.size());
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i].whole = wholes[i];
      for (std::size_t k = i * most; k < i * most + count[i]; ++k)
        out[i].patches.push_back({id[k], vector(centroid, k), vector(normal, k), area[k], depth[k],
                                  volume[k], vector(force, k), vector(torque, k), vector(point, k),
                                  torsion[k]});
    }
    return out;
  }
};

}  // namespace ist::testing
