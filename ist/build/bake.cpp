#include <ist/bake.h>
#include <ist/error.h>
#include <tbb/task_group.h>

#include <algorithm>

#include "asset/asset_writer.h"
#include "build/calibration.h"
#include "build/cover.h"
#include "build/pack.h"
#include "build/tree_builder.h"
#include "mesh/mesh_solid.h"
#include "packing/thread_arena.h"

namespace ist {
namespace {

AssetHeader describe_bake(const ClosedMesh& mesh, const MeshSolid& solid,
                          const PackingSettings& settings, const SpherePacking& packing) {
  AssetHeader header;
  header.mesh_hash = solid.hash();
  for (int k = 0; k < 3; ++k) header.centre[k] = packing.frame.centre[k];
  header.exponent = packing.frame.exponent;
  header.flags = (mesh.report.repaired ? kFlagRepaired : 0) |
                 (packing.below_float_noise ? kFlagBelowNoise : 0);
  header.volume = solid.unit_volume();
  header.volume_error = solid.unit_volume_error();
  header.coverage = std::min(packing.coverage, 1.0);
  header.asked_spheres = settings.max_spheres;
  header.asked_coverage = settings.target_coverage;
  header.asked_min_radius = settings.min_radius;
  header.asked_epsilon = settings.epsilon;
  header.asked_seed = settings.seed;
  header.asked_grid = static_cast<std::uint32_t>(settings.grid);
  header.asked_grid_start = settings.grids.start;
  header.asked_grid_resolution = settings.grids.resolution;
  header.asked_grid_refinements = settings.grids.refinements;
  header.asked_grid_rounds = settings.grids.rounds_per_level;
  header.stop_reason = static_cast<std::uint32_t>(packing.stop);
  header.kept_ratio_worst = packing.kept_ratio_worst;
  header.kept_ratio_median = packing.kept_ratio_median;
  return header;
}

/// Spheres of each level of detail, the finest first: a quarter of the one before, as long as
/// there are enough to tell the solid's parts apart.
std::vector<std::size_t> detail_counts(std::size_t spheres) {
  constexpr std::size_t kFewest = 250;
  std::vector<std::size_t> counts = {spheres};
  for (std::uint32_t i = 1; i <= kMaxDetails && detail_spheres(spheres, i) >= kFewest; ++i)
    counts.push_back(detail_spheres(spheres, i));
  return counts;
}

/// Waits for a group's tasks whichever way a scope is left. A group that is left alone would be
/// cancelled, and with it, unseen, the loops inside its tasks.
class WaitAtEnd {
 public:
  explicit WaitAtEnd(tbb::task_group& group) : group_(group) {}
  ~WaitAtEnd() {
    try {
      group_.wait();
    } catch (...) {  // the scope is left by an exception already
    }
  }
  WaitAtEnd(const WaitAtEnd&) = delete;
  WaitAtEnd& operator=(const WaitAtEnd&) = delete;

 private:
  tbb::task_group& group_;
};

void report_tree(const ProgressCallback& progress, std::size_t spheres, double fraction) {
  Progress now;
  now.stage = "tree";
  now.spheres = spheres;
  now.fraction = fraction;
  if (progress && !progress(now)) throw Error("tree: cancelled");
}

}  // namespace

Asset bake(const ClosedMesh& mesh, const PackingSettings& settings,
           const ProgressCallback& progress) {
  const MeshSolid solid(mesh);
  const auto gpu = put_on_gpu(solid, settings);
  const SpherePacking packing = pack(solid, gpu.get(), settings, progress);
  if (packing.spheres.empty())
    throw Error(mesh.name +
                ": not one sphere fits within the limits; lower the smallest radius or the "
                "coverage, or allow more time");
  AssetArrays arrays;
  arrays.header = describe_bake(mesh, solid, settings, packing);
  for (const Sphere& s : packing.spheres) arrays.inner_spheres.push_back({s.x, s.y, s.z, s.r});

  std::vector<std::uint32_t> inner_order;
  const auto order_inner = [&] { inner_order = sphere_order(arrays.inner_spheres); };
  const auto cluster_matched = [&] {
    arrays.matched_tree = build_tree(arrays.effective_spheres, {});
  };
  const auto cluster_details = [&] {
    for (DetailArrays& detail : arrays.details)
      detail.matched_tree = build_tree(detail.effective_spheres, {});
  };
  thread_arena(settings.threads).execute([&] {
    // While the GPU calibrates, the CPU clusters. A CPU alone has its threads full either way.
    tbb::task_group trees;
    const WaitAtEnd wait(trees);
    if (gpu) trees.run(order_inner);
    std::vector<Calibration> details =
        calibrate_prefixes(solid, packing.spheres, detail_counts(packing.spheres.size()),
                           settings.threads, progress, gpu.get());
    arrays.effective_spheres = std::move(details.front().effective);
    arrays.header.protrusion = details.front().protrusion;
    for (std::size_t i = 1; i < details.size(); ++i)
      arrays.details.push_back({std::move(details[i].effective), details[i].protrusion, {}});
    if (gpu) {
      trees.run(cluster_matched);
      trees.run(cluster_details);
    }
    arrays.cover_radii = cover_radii(solid, packing.spheres, settings.threads, progress, gpu.get());
    report_tree(progress, packing.spheres.size(), 0);
    if (!gpu) {
      trees.run(order_inner);
      trees.run(cluster_matched);
      trees.run(cluster_details);
    }
    trees.wait();
    arrays.inner_tree =
        tree_from_order(arrays.inner_spheres, arrays.cover_radii, std::move(inner_order));
  });
  report_tree(progress, packing.spheres.size(), 1);
  return Asset(asset_bytes(arrays), mesh.name);
}

}  // namespace ist
