// How long the GPU takes from a mesh's triangles in pageable host memory to certified spheres in
// host memory: upload and hierarchy every time, only context and memory pool kept.
#include <ist/bake.h>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include "cuda/packing/banded/banded_pack.h"
#include "cuda/packing/mesh/device_mesh.h"
#include "fingerprint.h"
#include "mesh/mesh_solid.h"
#include "report.h"
#include "timing.h"

namespace {

using ist::benchmark::fingerprint;
using ist::benchmark::Report;

struct Run {
  double mesh = 0, all = 0;  ///< [s] until the mesh is on the device; until the spheres are here
  double peak = 0;           ///< [MiB] of device memory
  ist::SpherePacking packing;
};

/// `split`: waits for the mesh, to see how long it takes alone.
Run run_once(const ist::MeshSolid& solid, std::size_t count, bool split) {
  ist::packing::PackingLimits limits;
  limits.volume = solid.unit_volume();
  limits.max_spheres = count;
  ist::gpu::Queue queue{ist::GpuSettings{}};
  Run run;
  const double start = ist::benchmark::wall_seconds();
  {
    const ist::gpu::DeviceMesh on_device(queue, solid.view());
    if (split) {
      queue.wait();
      run.mesh = ist::benchmark::wall_seconds() - start;
    }
    ist::Stage stage("pack", {});
    run.packing = pack_banded(queue, on_device.tree(), limits, stage);
  }
  run.all = ist::benchmark::wall_seconds() - start;
  run.peak = static_cast<double>(queue.peak_bytes()) / (1 << 20);
  return run;
}

/// What one H200 is to reach: milliseconds, coverage and device memory of the last row measured.
void compare(const std::string& mesh, const Run& run, double ms, Report& report) {
  struct Target {
    const char* mesh;
    std::size_t spheres;
    double ms, coverage;
  };
  constexpr Target kTargets[] = {{"dino", 100, 4, 0},
                                 {"dino", 10'000, 22, 0.854},
                                 {"dino", 100'000, 110, 0.908},
                                 {"dragon_871k", 100, 11, 0},
                                 {"dragon_871k", 10'000, 35, 0.825},
                                 {"dragon_871k", 100'000, 150, 0.89}};
  const std::size_t spheres = run.packing.spheres.size();
  for (const Target& target : kTargets) {
    if (mesh != target.mesh || spheres != target.spheres) continue;
    const std::string what = mesh + ", " + std::to_string(spheres) + " spheres: ";
    report.target(what + "ms", ms, target.ms, true);
    if (target.coverage > 0)
      report.target(what + "coverage", run.packing.coverage, target.coverage);
    if (target.coverage == 0.89) report.target(what + "peak MiB", run.peak, 1024, true);
  }
}

void measure(const std::string& name, const ist::MeshSolid& solid,
             const std::vector<std::size_t>& counts, int repeats, Report& report) {
  for (const std::size_t count : counts) {
    std::vector<double> ms, mesh_ms;
    Run last;
    run_once(solid, count, false);
    for (int i = 0; i < repeats; ++i) {
      last = run_once(solid, count, false);
      ms.push_back(last.all * 1e3);
    }
    for (int i = 0; i < 3; ++i) mesh_ms.push_back(run_once(solid, count, true).mesh * 1e3);
    report.row("Packing on the GPU", {{"mesh", name},
                                      {"triangles", solid.view().triangle_count},
                                      {"spheres", last.packing.spheres.size()},
                                      {"coverage", last.packing.coverage},
                                      {"ms, median", ist::benchmark::quantile(ms, 0.5)},
                                      {"least", ist::benchmark::quantile(ms, 0)},
                                      {"most", ist::benchmark::quantile(ms, 1)},
                                      {"mesh alone, ms", ist::benchmark::quantile(mesh_ms, 0.5)},
                                      {"rounds", last.packing.rounds},
                                      {"peak MiB", last.peak},
                                      {"hash", fingerprint(last.packing)}});
    compare(name, last, ist::benchmark::quantile(ms, 0.5), report);
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("gpu_packing", argc, argv);
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{100, 1'000, 10'000}
                     : std::vector<std::size_t>{100, 1'000, 10'000, 100'000};
  try {
    ist::benchmark::for_shared_meshes(report,
                                      {"oracle/meshes/dino.off", "meshes/dev/dragon_871k.ply",
                                       "oracle/meshes/elephant.off", "meshes/dev/unit_cube.stl"},
                                      [&](const std::string& name, const ist::ClosedMesh& mesh) {
                                        const ist::MeshSolid solid(mesh);
                                        measure(name, solid, counts, 10, report);
                                        if (name == "dragon_871k" && !report.quick())
                                          measure(name, solid, {1'000'000}, 10, report);
                                      });
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return report.write();
}
