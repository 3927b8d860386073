#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include <ist/query_tbb.h>
#include <ist/shapes.h>

#include "gpu_batch_scenes.h"
#include "gpu_many.h"
#include "support/patch_columns.h"

// The same scenes by all cores of the machine, and how far the answers differ.

namespace ist::benchmark {

inline std::vector<PlacedPair> placed(const Scene& scene, std::size_t count) {
  std::vector<PlacedPair> out;
  for (const BatchPair& pair : drawn(scene.poses, count)) {
    const PlacedSolid b(scene.b->view(), pair.pose_b, pair.scale_b);
    if (scene.field != nullptr)
      out.push_back({{*scene.field, pair.pose_a, pair.scale_a}, b});
    else
      out.push_back({{scene.a->view(), pair.pose_a, pair.scale_a}, b});
  }
  return out;
}

/// M/s by all cores; `answers` of as many.
inline double cpu_rate(const Scene& scene, std::size_t count, std::vector<Penetration>& answers) {
  const std::vector<PlacedPair> pairs = placed(scene, count);
  PenetrationSettings settings;
  settings.spheres_only = true;
  settings.pair_budget = scene.pair_budget;
  answers.resize(count);
  return rate_of_cores(count, 3, [&](std::span<Workspace> workspaces) {
    penetration_batch(pairs, settings, workspaces, answers, tbb_parallel_for());
  });
}

/// Separations by all cores, M/s; `answers` of as many.
inline double cpu_separation_rate(const Scene& scene, std::size_t count,
                                  std::vector<Separation>& answers) {
  const std::vector<PlacedPair> pairs = placed(scene, count);
  answers.resize(count);
  return rate_of_cores(count, 3, [&](std::span<Workspace> workspaces) {
    separation_batch(pairs, {}, workspaces, answers, tbb_parallel_for());
  });
}

/// Contact patches by all cores.
struct CpuPatches {
  double rate = 0;  ///< M/s
  std::vector<ContactPatches> answers;
  std::vector<ContactPatch> patches;  ///< as many a pair

  CpuPatches(const Scene& scene, std::size_t count, std::uint32_t most)
      : answers(count), patches(count * most) {
    const std::vector<PlacedPair> pairs = placed(scene, count);
    ContactSettings settings;
    settings.spheres_only = true;
    rate = rate_of_cores(count, 3, [&](std::span<Workspace> workspaces) {
      contact_patches_batch(pairs, settings, workspaces, answers, patches, tbb_parallel_for());
    });
  }
};

/// What contacts differ by from the CPU's.
struct PatchDifference {
  double of_other_regions = 0;  ///< part of the pairs
  double volume = 0;            ///< largest of a patch, relative
  double patches = 0;           ///< mean of a pair
};

inline PatchDifference difference(const std::vector<testing::PatchedPair>& gpu,
                                  const CpuPatches& cpu, std::uint32_t most) {
  PatchDifference out;
  const auto pairs = static_cast<double>(cpu.answers.size());
  for (std::size_t i = 0; i < cpu.answers.size(); ++i) {
    const ContactPatch* const from = cpu.patches.data() + i * most;
    const std::vector<ContactPatch>& found = gpu[i].patches;
    out.patches += static_cast<double>(found.size()) / pairs;
    if (!std::equal(found.begin(), found.end(), from, from + cpu.answers[i].count,
                    [](const auto& x, const auto& y) { return x.id == y.id; })) {
      out.of_other_regions += 1 / pairs;
      continue;
    }
    for (std::size_t k = 0; k < found.size(); ++k)
      out.volume = std::max(out.volume, std::abs(found[k].volume / from[k].volume - 1));
  }
  return out;
}

/// The largest difference to the CPU's volumes, relative.
inline double worst_volume(const std::vector<Penetration>& gpu,
                           const std::vector<Penetration>& cpu) {
  double worst = 0;
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    if (cpu[i].volume == 0 && gpu[i].volume == 0) continue;
    worst = std::max(
        worst, std::abs(gpu[i].volume - cpu[i].volume) / std::max(cpu[i].volume, gpu[i].volume));
  }
  return worst;
}

/// What separations differ by from the CPU's.
struct SeparationDifference {
  double distance = 0;    ///< largest, relative
  double visits = 0;      ///< mean, on the GPU
  bool certified = true;  ///< no lower end is less than the CPU's, nor is one above the distance
};

inline SeparationDifference difference(const std::vector<Separation>& gpu,
                                       const std::vector<Separation>& cpu) {
  SeparationDifference out;
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    out.visits += gpu[i].node_visits / static_cast<double>(cpu.size());
    const double most = std::max(cpu[i].distance, gpu[i].distance);
    if (most > 0)
      out.distance = std::max(out.distance, std::abs(gpu[i].distance - cpu[i].distance) / most);
    out.certified = out.certified && gpu[i].distance_min >= cpu[i].distance_min - 1e-12 * most &&
                    gpu[i].distance_min <= gpu[i].distance_max;
  }
  return out;
}

}  // namespace ist::benchmark
