// The paper's Figure 9 on the card: coverage and sphere count over time for its four grids and
// ours, the memory of the adaptive grids beside dense ones, and the medial axis. Times run from
// triangles in pageable host memory to certified spheres in host memory. Needs a GPU.

#include <ist/bake.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "cuda/base/queue.h"
#include "fingerprint.h"
#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/grid_history.h"
#include "timing.h"

namespace {

using ist::GridMode;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::wall_seconds;
using ist::testing::GridRound;
using History = std::vector<GridRound>;

struct Mode {
  GridMode mode;
  const char* name;
};
constexpr Mode kGrids[] = {{GridMode::uniform, "uniform"},
                           {GridMode::explicit_refinement, "explicit"},
                           {GridMode::implicit_refinement, "implicit"},
                           {GridMode::hybrid, "hybrid"}};

struct Curve {
  std::vector<double> seconds, coverage;
  std::vector<std::size_t> spheres;
  double upload = 0;  ///< [s] before the first grid; in the times above

  /// Seconds to a coverage, between rounds by a line; 0 if it is not reached.
  double time_to(double wanted) const {
    for (std::size_t i = 0; i < coverage.size(); ++i) {
      if (coverage[i] < wanted) continue;
      if (i == 0) return seconds[0];
      const double part = (wanted - coverage[i - 1]) / (coverage[i] - coverage[i - 1]);
      return seconds[i - 1] + part * (seconds[i] - seconds[i - 1]);
    }
    return 0;
  }
};

class MeshOnGrids {
 public:
  MeshOnGrids(Report& report, const std::string& name, const ist::ClosedMesh& mesh)
      : report_(report), name_(name), solid_(mesh) {
    settings_.max_spheres = report.quick() ? 1'000 : 100'000;
    settings_.time_limit = 2;
    solid_.unit_volume();
  }

  void grids() {
    for (const Mode& grid : kGrids) {
      settings_.grid = grid.mode;
      // The run of median duration among some.
      std::vector<std::pair<double, History>> runs;
      std::size_t peak = 0;
      for (int run = 0; run < (report_.quick() ? 2 : 4); ++run) {
        ist::gpu::Queue queue{ist::GpuSettings{}};
        const double start = wall_seconds();
        History history = ist::testing::history_on_grids(queue, solid_, settings_);
        if (run > 0) runs.emplace_back(wall_seconds() - start, std::move(history));
        peak = queue.peak_bytes();
      }
      std::sort(runs.begin(), runs.end(),
                [](const auto& a, const auto& b) { return a.first < b.first; });
      const auto& [seconds, history] = runs[runs.size() / 2];
      // A round's clock starts with the first grid: what the upload took comes before it.
      const double before = std::max(0.0, seconds - history.back().seconds);
      Curve& curve = curves_[grid.name];
      curve.upload = before;
      for (const GridRound& r : history) {
        curve.seconds.push_back(before + r.seconds);
        curve.coverage.push_back(r.coverage);
        curve.spheres.push_back(r.spheres);
        report_.row("Rounds", {{"mesh", name_},
                               {"grid", grid.name},
                               {"ms", 1e3 * (before + r.seconds)},
                               {"spheres", r.spheres},
                               {"coverage", r.coverage},
                               {"prototypes", r.prototypes},
                               {"cells", r.cells},
                               {"active cells", r.active_cells},
                               {"grid MB", static_cast<double>(r.bytes) / 1e6},
                               {"dense MB", static_cast<double>(r.dense_bytes) / 1e6},
                               {"hashed", r.hashed}});
      }
      report_.row("Whole packing", {{"mesh", name_},
                                    {"grid", grid.name},
                                    {"spheres", history.back().spheres},
                                    {"coverage", history.back().coverage},
                                    {"ms, median", 1e3 * seconds},
                                    {"least", 1e3 * runs.front().first},
                                    {"most", 1e3 * runs.back().first},
                                    {"peak device MB", static_cast<double>(peak) / 1e6}});
    }
  }

  /// Packed anew to each count.
  void banded() {
    ist::PackingSettings settings;
    for (const std::size_t count : {10, 100, 1'000, 10'000, 100'000}) {
      settings.max_spheres = count;
      if (report_.quick() && count > 1'000) break;
      std::vector<double> seconds;
      ist::SpherePacking packing;
      for (int run = 0; run < 6; ++run) {
        const double start = wall_seconds();
        packing = ist::pack(solid_, settings);
        if (run > 0) seconds.push_back(wall_seconds() - start);
      }
      const double median = quantile(seconds, 0.5);
      curves_["banded"].seconds.push_back(median);
      curves_["banded"].coverage.push_back(packing.coverage);
      report_.row("Rounds", {{"mesh", name_},
                             {"grid", "banded"},
                             {"ms", 1e3 * median},
                             {"spheres", packing.spheres.size()},
                             {"coverage", packing.coverage}});
    }
  }

  void compare() {
    const Curve& uniform = curves_["uniform"];
    const double first = uniform.coverage.front();
    // What uniform covers with so many spheres; the first round that has them.
    const auto covered = [&](std::size_t spheres) {
      std::size_t i = 0;
      while (i + 1 < uniform.spheres.size() && uniform.spheres[i] < spheres) ++i;
      return uniform.coverage[i];
    };
    const double few = covered(1'000), many = covered(10'000);
    // The coverage that all grids reach.
    double common = 1;
    for (const Mode& grid : kGrids) common = std::min(common, curves_[grid.name].coverage.back());
    for (const auto& [name, curve] : curves_) {
      const auto faster = [&](double coverage) {
        return curve.time_to(coverage) > 0 ? uniform.time_to(coverage) / curve.time_to(coverage)
                                           : 0;
      };
      report_.row("Against uniform",
                  {{"mesh", name_},
                   {"grid", name},
                   {"ms to the first spheres", 1e3 * curve.seconds.front()},
                   {"times faster", uniform.seconds.front() / curve.seconds.front()},
                   {"from the first grid on, ms", 1e3 * (curve.seconds.front() - curve.upload)},
                   {"times faster then", (uniform.seconds.front() - uniform.upload) /
                                             (curve.seconds.front() - curve.upload)},
                   {"uniform's first coverage", first},
                   {"times faster to it", faster(first)},
                   {"its coverage with 1,000 spheres", few},
                   {"times faster to that", faster(few)},
                   {"with 10,000", many},
                   {"times faster to 10,000's", faster(many)},
                   {"common coverage", common},
                   {"times faster to common", faster(common)}});
    }
    for (const char* const name : {"implicit", "hybrid"}) {
      const Curve& curve = curves_[name];
      report_.target(name_ + ", " + name + ": times faster to what uniform covers with 10,000",
                     uniform.time_to(many) / curve.time_to(many), 10);
      report_.target(name_ + ", " + name + ": times faster than uniform to the first spheres",
                     uniform.seconds.front() / curve.seconds.front(), 100);
    }
  }

  void medial() {
    for (const unsigned resolution : {0u, 128u}) {
      ist::MedialSettings settings;
      settings.resolution = resolution;
      settings.device = ist::Device::cuda;
      std::vector<double> seconds;
      std::size_t nodes = 0;
      for (int run = 0; run < 11; ++run) {
        const double start = wall_seconds();
        nodes = ist::medial_nodes(solid_, settings).size();
        if (run > 0) seconds.push_back(wall_seconds() - start);
      }
      report_.row("Medial axis", {{"mesh", name_},
                                  {"resolution", resolution},
                                  {"nodes", nodes},
                                  {"ms, median", 1e3 * quantile(seconds, 0.5)},
                                  {"least", 1e3 * quantile(seconds, 0)},
                                  {"most", 1e3 * quantile(seconds, 1)}});
    }
  }

 private:
  Report& report_;
  const std::string name_;
  const ist::MeshSolid solid_;
  ist::PackingSettings settings_;
  std::map<std::string, Curve> curves_;
};

}  // namespace

int main(int argc, char** argv) {
  Report report("grids", argc, argv);
  std::string why;
  if (!ist::gpu_available(0, &why)) {
    report.remark("nothing measured: " + why);
    return report.write();
  }
  const auto measure = [&](const std::string& name, const ist::ClosedMesh& closed) {
    MeshOnGrids mesh(report, name, closed);
    mesh.grids();
    mesh.banded();
    mesh.compare();
    mesh.medial();
  };
  measure("bolt", ist::close_mesh(ist::make_sample("bolt"), "bolt"));
  ist::benchmark::for_shared_meshes(report,
                                    {"oracle/meshes/dino.off", "oracle/meshes/elephant.off",
                                     "meshes/dev/dragon_174k.ply", "meshes/dev/dragon_871k.ply"},
                                    measure);
  return report.write();
}
