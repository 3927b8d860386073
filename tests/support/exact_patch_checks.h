#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include <ist/query.h>

#include "support/exact_batches.h"
#include "support/patch_columns.h"

// Comparison of batches of exact contact patches with the CPU.

namespace ist::testing {

/// The CPU's patches in the order of a batch's: by their ids.
inline std::vector<ContactPatch> exact_patches_of_cpu(const PlacedAsset& a, const PlacedAsset& b,
                                                      std::size_t most, Workspace& workspace,
                                                      Penetration& whole) {
  std::vector<ContactPatch> patches(most);
  ContactSettings settings;
  settings.measure = Measure::exact;
  const ContactPatches found = contact_patches(a, b, settings, workspace, patches);
  whole = found.penetration;
  patches.resize(found.count);
  std::stable_sort(patches.begin(), patches.end(),
                   [](const auto& x, const auto& y) { return x.id < y.id; });
  return patches;
}

struct PatchDifferences {
  std::size_t patches = 0, several = 0, touching = 0;
  std::size_t other = 0;  ///< pairs whose ids differ
  /// In parts of the smaller solid's size, of the larger one's where there is an arm.
  double volume = 0, force = 0, torque = 0, centroid = 0;
  double normal = 0;  ///< and depth and area, of patches that push
  double sum = 0;     ///< of the patches, from the whole
};

inline PatchDifferences compare_patches(const std::vector<Asset>& assets,
                                        const std::vector<BatchPair>& pairs,
                                        const std::vector<PatchedPair>& answers, std::size_t most) {
  PatchDifferences worst;
  const auto grow = [](double& worst_of, double by) { worst_of = std::max(worst_of, by); };
  Workspace workspace;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const BatchPair& pair = pairs[i];
    const PlacedAsset a = {assets[pair.a].view(), pair.pose_a, pair.scale_a};
    const PlacedAsset b = {assets[pair.b].view(), pair.pose_b, pair.scale_b};
    Penetration whole;
    const std::vector<ContactPatch> cpu = exact_patches_of_cpu(a, b, most, workspace, whole);
    const std::vector<ContactPatch>& gpu = answers[i].patches;
    const Penetration& of_gpu = answers[i].whole;
    EXPECT_EQ(of_gpu.status, whole.status) << i;
    EXPECT_EQ(of_gpu.touching, whole.touching) << i;
    const bool same = std::equal(gpu.begin(), gpu.end(), cpu.begin(), cpu.end(),
                                 [](const auto& x, const auto& y) { return x.id == y.id; });
    worst.other += same ? 0 : 1;
    worst.several += gpu.size() > 1 ? 1 : 0;
    worst.touching += of_gpu.touching ? 1 : 0;
    worst.patches += gpu.size();
    const double size = std::min(size_of(a), size_of(b)), area = size * size;
    const double arm = std::max(size_of(a), size_of(b));
    ContactPatch sum;
    for (const ContactPatch& patch : gpu) {
      sum.volume += patch.volume;
      sum.force += patch.force;
      sum.torque += patch.torque;
    }
    if (!of_gpu.touching && !gpu.empty()) {
      grow(worst.sum, std::abs(sum.volume - of_gpu.volume) / (area * size));
      grow(worst.sum, (sum.force - of_gpu.force).norm() / area);
      grow(worst.sum, (sum.torque - of_gpu.torque).norm() / (area * arm));
    }
    for (std::size_t k = 0; same && k < gpu.size(); ++k) {
      const ContactPatch &x = gpu[k], &y = cpu[k];
      grow(worst.volume, std::abs(x.volume - y.volume) / (area * size));
      grow(worst.force, (x.force - y.force).norm() / area);
      grow(worst.torque, (x.torque - y.torque).norm() / (area * arm));
      if (y.volume > 1e-6 * area * size)
        grow(worst.centroid, (x.centroid - y.centroid).norm() / size);
      if (!(y.volume > 1e-6 * area * size && y.area > 1e-3 * area)) continue;
      grow(worst.normal, (x.normal - y.normal).norm());
      grow(worst.normal, std::abs(x.area - y.area) / area);
      grow(worst.normal, std::abs(x.depth - y.depth) / size);
      grow(worst.normal, (x.point - y.point).norm() / arm);
      grow(worst.normal, std::abs(x.torsion - y.torsion) / (area * arm));
    }
  }
  std::printf(
      "%zu patches of %zu pairs, %zu have several, %zu touch, %zu differ in ids; volume %.2g, "
      "force "
      "%.2g, torque %.2g, centroid %.2g, normal %.2g, sum %.2g\n",
      worst.patches, pairs.size(), worst.several, worst.touching, worst.other, worst.volume,
      worst.force, worst.torque, worst.centroid, worst.normal, worst.sum);
  return worst;
}

inline void expect_near(const PatchDifferences& worst) {
  EXPECT_EQ(worst.other, 0u);
  for (const double by : {worst.volume, worst.force, worst.torque, worst.sum}) EXPECT_LE(by, 1e-12);
  for (const double by : {worst.centroid, worst.normal}) EXPECT_LE(by, 1e-9);
}

}  // namespace ist::testing
