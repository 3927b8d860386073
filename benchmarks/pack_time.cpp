// What packing alone costs and reaches on solids of every kind: organic, mechanical, with many
// places that are equally good, and thinner than any cell.
#include <ist/bake.h>
#include <chrono>
#include <string>
#include <vector>

#include "fingerprint.h"
#include "mesh/samples/samples.h"
#include "report.h"

namespace {

using ist::benchmark::fingerprint;
using ist::benchmark::Report;

void measure(const std::string& name, const ist::ClosedMesh& mesh,
             const std::vector<std::size_t>& counts, Report& report) {
  const auto solid = ist::make_solid(mesh);
  for (const std::size_t count : counts) {
    ist::PackingSettings settings;
    settings.max_spheres = count;
    const auto start = std::chrono::steady_clock::now();
    const ist::SpherePacking packing = ist::pack(*solid, settings);
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report.row("Packing", {{"mesh", name},
                           {"triangles", mesh.mesh.triangles.size()},
                           {"spheres", packing.spheres.size()},
                           {"coverage", packing.coverage},
                           {"seconds", seconds},
                           {"rounds", packing.rounds},
                           {"kept ratio, worst", packing.kept_ratio_worst},
                           {"median", packing.kept_ratio_median},
                           {"hash", fingerprint(packing)}});
  }
}

}  // namespace

int main(int argc, char** argv) {
  Report report("pack_time", argc, argv);
  const std::vector<std::size_t> counts = report.quick()
                                              ? std::vector<std::size_t>{100, 1'000}
                                              : std::vector<std::size_t>{100, 1'000, 10'000};
  for (const char* name : {"bolt", "nut", "gear"})
    measure(name, ist::close_mesh(ist::make_sample(name), name), counts, report);
  ist::benchmark::for_shared_meshes(
      report,
      {"oracle/meshes/dino.off", "oracle/meshes/elephant.off", "oracle/meshes/ico1k.off",
       "oracle/meshes/ico20k.off", "meshes/dev/unit_cube.stl", "meshes/dev/mug.ply",
       "meshes/dev/dragon_174k.ply", "meshes/dev/dragon_871k.ply", "meshes/bad/hollow_sphere.obj",
       "meshes/bad/plate_1e-6.obj", "meshes/bad/needle_1e6.obj"},
      [&](const std::string& name, const ist::ClosedMesh& mesh) {
        measure(name, mesh, counts, report);
      });
  return report.write();
}
