#include <tbb/task_group.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "bake/asset/asset_writer.h"
#include "bake/backend/make_backend.h"
#include "bake/bake_solid.h"
#include "bake/cluster/ball_lanes.h"
#include "bake/cluster/tree_builder.h"
#include "base/stage.h"
#include "base/thread_arena.h"
#include "packing/base/packing_settings.h"
#include "packing/calibrate/calibration.h"
#include "packing/cover/cover.h"

namespace ist {
namespace {

std::vector<Ball> vertices_of(const MeshView& mesh) {
  std::vector<Ball> points(mesh.vertex_count);
  for (std::size_t v = 0; v < points.size(); ++v) {
    const double* p = mesh.vertices + 3 * v;
    points[v] = {p[0], p[1], p[2], 0};
  }
  return points;
}

AssetHeader describe_bake(const ClosedMesh& mesh, const MeshSolid& solid,
                          const PackingSettings& settings, const SpherePacking& packing) {
  AssetHeader header = describe_solid(mesh, solid);
  if (packing.below_float_noise) header.flags |= kFlagBelowNoise;
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

/// Number of spheres of each level of detail, the finest first: a quarter of the level before, as
/// long as that is enough to distinguish the solid's parts.
std::vector<std::size_t> detail_counts(std::size_t spheres) {
  constexpr std::size_t kFewest = 250;
  std::vector<std::size_t> counts = {spheres};
  for (std::uint32_t i = 1; i <= kMaxDetails && detail_spheres(spheres, i) >= kFewest; ++i)
    counts.push_back(detail_spheres(spheres, i));
  return counts;
}

/// The steps of a bake. The first three run in turn on the backend, the others on the host.
enum class Step { pack, calibrate, cover, order, bounds, finest_tree, inner_tree };

/// Runs a table of stages on the host's threads. Each starts when its dependencies are done:
/// immediately if the backend leaves these threads idle, else not before finish().
class HostStages {
 public:
  struct Stage {
    Step step;
    std::vector<Step> waits_for;
    std::function<void()> work;
  };

  HostStages(bool threads_are_idle, std::vector<Stage> table)
      : at_once_(threads_are_idle), table_(std::move(table)), left_(table_.size()) {
    for (std::size_t i = 0; i < table_.size(); ++i)
      left_[i] = static_cast<int>(table_[i].waits_for.size());
  }
  /// Waits on every exit from the scope: destroying an unfinished task group would cancel it and,
  /// silently, the loops inside its tasks.
  ~HostStages() {
    try {
      group_.wait();
    } catch (...) {  // finish() reports; without it another exception is active
    }
  }
  HostStages(const HostStages&) = delete;
  HostStages& operator=(const HostStages&) = delete;

  void add(std::function<void()> work) {
    if (at_once_)
      group_.run(std::move(work));
    else
      waiting_.push_back(std::move(work));
  }

  void done(Step step) {
    for (std::size_t i = 0; i < table_.size(); ++i)
      if (std::ranges::count(table_[i].waits_for, step) != 0 && --left_[i] == 0)
        add([this, i] {
          table_[i].work();
          done(table_[i].step);
        });
  }

  void finish() {
    at_once_ = true;
    for (std::function<void()>& work : waiting_) group_.run(std::move(work));
    group_.wait();
  }

 private:
  bool at_once_;
  std::vector<Stage> table_;
  std::vector<std::atomic<int>> left_;
  std::vector<std::function<void()>> waiting_;
  tbb::task_group group_;
};

}  // namespace

void describe_mass(const MeshMoments& moments, AssetHeader& header) {
  header.volume = moments.volume;
  header.volume_error = moments.volume_error;
  for (int k = 0; k < 3; ++k) {
    header.centre_of_mass[k] = moments.centre[k];
    header.inertia[k] = std::max(0.0, moments.inertia(k, k));  // for a needle about its own axis
    header.inertia[3 + k] = k < 2 ? moments.inertia(0, 1 + k) : moments.inertia(1, 2);
  }
  header.centre_of_mass_error = moments.centre_error;
  header.inertia_error = moments.inertia_error;
}

void describe_bounds(const MeshSolid& solid, double beyond, AssetHeader& header) {
  const UnitFrame& frame = solid.frame();
  const std::vector<Ball> points = vertices_of(solid.arrays());
  const Ball smallest = bounding_ball(points);
  Eigen::Vector3d centre = frame.from_unit({smallest.x, smallest.y, smallest.z});
  for (int k = 0; k < 3; ++k) {
    const double low = solid.bounds().min()[k], high = solid.bounds().max()[k];
    centre[k] = std::clamp(centre[k], low, high);
    header.ball_centre[k] = centre[k];
    // Rounding, in this frame or in the unit frame, must not bring anything back inside.
    constexpr double kFar = std::numeric_limits<double>::infinity();
    const double further = (beyond + 1e-14) * frame.scale();
    header.box_lower[k] = beyond > 0 ? std::nextafter(low - further, -kFar) : low;
    header.box_upper[k] = beyond > 0 ? std::nextafter(high + further, kFar) : high;
  }
  // About the stored centre, which far from the origin is not exactly the smallest ball's.
  const Eigen::Vector3d from = frame.to_unit(centre);
  double radius = 0;
  for (const Ball& point : points)
    radius = std::max(radius, reach(from.x(), from.y(), from.z(), point));
  header.ball_radius = (radius + beyond) * (1 + 0x1p-49) * frame.scale();
}

AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                        SolidBackend& backend, const PackingSettings& settings,
                        const ProgressCallback& progress) {
  AssetArrays arrays;
  std::vector<std::uint32_t> inner_order;
  // The finest matched spheres are close to the inner ones, whose order is computed meanwhile.
  // Trees of coarser levels follow their calibration.
  HostStages host(
      backend.leaves_threads_idle(),
      {{Step::order, {Step::pack}, [&] { inner_order = sphere_order(arrays.inner_spheres); }},
       {Step::bounds, {Step::pack}, [&] { describe_bounds(solid, 0, arrays.header); }},
       {Step::finest_tree,
        {Step::order, Step::calibrate},
        [&] { arrays.matched_tree = build_tree_like(arrays.matched_spheres, inner_order); }},
       {Step::inner_tree, {Step::order, Step::cover}, [&] {
          arrays.inner_tree =
              tree_from_order(arrays.inner_spheres, arrays.cover_radii, inner_order);
        }}});
  // Idle host threads lay out the mesh and compute the moments from here on. Otherwise the packing
  // needs the moments first, and the mesh follows the covers.
  if (backend.leaves_threads_idle()) {
    kept.start();
    host.add([&] { solid.unit_moments(); });
  }

  const SpherePacking packing = backend.pack(settings, progress);
  const std::size_t count = packing.spheres.size();
  if (count == 0)
    throw Error(mesh.name +
                ": no sphere fits within the limits; lower the smallest radius or the coverage, or "
                "allow more time");
  arrays.header = describe_bake(mesh, solid, settings, packing);
  arrays.inner_spheres = packing.spheres;
  host.done(Step::pack);

  const std::vector<std::size_t> counts = detail_counts(count);
  arrays.details.resize(counts.size() - 1);
  const auto calibrate_levels = [&](std::size_t first, std::size_t end, SolidBackend& on,
                                    HostStages& trees, const ProgressCallback& report) {
    const auto take = [&](std::size_t i, Calibration made) {
      if (first + i == 0) {
        arrays.matched_spheres = std::move(made.matched);
        arrays.header.protrusion = made.protrusion;
        host.done(Step::calibrate);
        return;
      }
      DetailArrays& detail = arrays.details[first + i - 1];
      detail.matched_spheres = std::move(made.matched);
      detail.protrusion = made.protrusion;
      trees.add([&detail] { detail.matched_tree = build_tree(detail.matched_spheres, {}); });
    };
    calibrate_prefixes(solid, on, packing.spheres, std::span(counts).subspan(first, end - first),
                       report, take);
  };
  std::optional<Aside<void>> levels;
  if (const auto beside = backend.beside(); beside && counts.size() > 1) {
    levels.emplace(settings.threads, [&, beside](const WorkStop& stop) {
      const std::unique_ptr<SolidBackend> other = beside();
      HostStages trees(true, {});  // a task group belongs to the threads of one arena
      calibrate_levels(1, counts.size(), *other, trees,
                       [&](const Progress&) { return !stop.stopped(); });
      trees.finish();
    });
    levels->start();
    calibrate_levels(0, 1, backend, host, progress);
  } else {
    // The finest first: its tree, the largest, is built while the others are calibrated.
    calibrate_levels(0, counts.size(), backend, host, progress);
  }
  arrays.cover_radii = cover_radii(solid, backend, packing.spheres, progress);
  host.done(Step::cover);

  Stage stage("tree", progress);
  stage.step(count, 0);
  kept.start();
  if (levels) levels->wait([&] { stage.step(count, 0); });
  host.finish();
  keep(kept.wait([&] { stage.step(count, 0.5); }), arrays);
  stage.step(count, 1);
  return arrays;
}

AssetHeader describe_solid(const ClosedMesh& mesh, const MeshSolid& solid) {
  AssetHeader header;
  header.mesh_hash = solid.hash();
  for (int k = 0; k < 3; ++k) header.centre[k] = solid.frame().centre[k];
  header.exponent = solid.frame().exponent;
  header.flags =
      (mesh.report.repaired ? kFlagRepaired : 0) | (mesh.report.wrapped ? kFlagWrapped : 0);
  describe_mass(solid.unit_moments(), header);
  return header;
}

void keep(const KeptMesh& kept, AssetArrays& arrays) {
  arrays.mesh = kept.mesh;
  arrays.header.mesh_state = static_cast<std::uint32_t>(kept.state);
  arrays.header.self_overlap_volume = kept.self_overlap_volume;
}

Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SharedMesh& kept,
                 SolidBackend& backend, const PackingSettings& settings,
                 const ProgressCallback& progress) {
  return Asset(asset_bytes(bake_arrays(mesh, solid, kept, backend, settings, progress)), mesh.name);
}

Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, const Resolution& resolution,
                 const PackingSettings& settings, const ProgressCallback& progress) {
  const auto backend = make_backend(solid, settings.device, settings.gpu);
  SharedMesh kept(solid, resolution, settings.keep_mesh, settings.threads);
  return bake_solid(mesh, solid, kept, *backend, settings, progress);
}

Asset bake(const ClosedMesh& mesh, const PackingSettings& settings,
           const ProgressCallback& progress) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    const ResolvedMesh resolved = resolve(mesh, progress);
    const MeshSolid solid(resolved);
    return bake_solid(resolved.mesh, solid, resolved.resolution, settings, progress);
  });
}

Asset bake_mesh_only(const ClosedMesh& mesh, unsigned threads, const ProgressCallback& progress) {
  return thread_arena(threads).execute([&] {
    const ResolvedMesh resolved = resolve(mesh, progress);
    const MeshSolid solid(resolved);
    AssetArrays arrays;
    arrays.header = describe_solid(resolved.mesh, solid);
    describe_bounds(solid, 0, arrays.header);
    keep(keep_mesh(solid, resolved.resolution), arrays);
    if (!arrays.mesh)
      throw Error(mesh.name +
                  ": parts of the mesh overlap, so its surface alone does not bound a solid. " +
                  resolved.resolution.reason + " Bake it with spheres, or wrap it");
    return Asset(asset_bytes(arrays), mesh.name);
  });
}

}  // namespace ist
