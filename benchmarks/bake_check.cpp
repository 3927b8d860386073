// Bakes every mesh of meshes/dev at several sphere counts and proves every invariant of each asset
// again. Meshes that bound no solid are refused first, then baked after repair, or fail with a
// reason. Usage: bake_check [--out FILE] [--quick]
#include <ist/bake.h>
#include <ist/types.h>
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "report.h"
#include "support/shared_data.h"

namespace {

using ist::benchmark::Report;
namespace fs = std::filesystem;

bool is_mesh(const fs::path& path) {
  static const std::vector<std::string> endings = {".obj", ".stl", ".ply", ".off", ".glb", ".dae"};
  return std::find(endings.begin(), endings.end(), path.extension()) != endings.end();
}

std::vector<fs::path> meshes_below(const fs::path& folder) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (is_mesh(entry.path())) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Totals {
  std::size_t assets = 0, violations = 0, refused = 0;
};

void bake_and_check(const ist::ClosedMesh& mesh, const std::string& name, std::size_t spheres,
                    Report& report, Totals& totals) {
  ist::PackingSettings settings;
  settings.max_spheres = spheres;
  const auto start = std::chrono::steady_clock::now();
  const ist::Asset asset = ist::bake(mesh, settings);
  const double baked = seconds_since(start);
  std::size_t violations = 0;
  std::string violated;
  for (const ist::Invariant& invariant : ist::check(asset, mesh)) {
    violations += invariant.violations;
    if (invariant.violations > 0) violated += (violated.empty() ? "" : ", ") + invariant.name;
  }
  ++totals.assets;
  totals.violations += violations;
  report.row("Bakes", {{"mesh", name},
                       {"triangles", mesh.mesh.triangles.size()},
                       {"repaired", mesh.report.repaired},
                       {"asked", spheres},
                       {"spheres", asset.view().sphere_count()},
                       {"violations", violations},
                       {"violated", violated},
                       {"bake [s]", baked},
                       {"check [s]", seconds_since(start) - baked}});
}

}  // namespace

int main(int argc, char** argv) {
  Report report("bake_check", argc, argv);
  const fs::path folder = ist::testing::shared_path("meshes/dev");
  if (!fs::exists(folder)) {
    std::cerr << "no meshes: set IST_SHARED\n";
    return 1;
  }
  const std::vector<std::size_t> counts =
      report.quick() ? std::vector<std::size_t>{100} : std::vector<std::size_t>{100, 1'000, 10'000};
  Totals totals;
  for (const fs::path& path : meshes_below(folder)) {
    const std::string name = fs::relative(path, folder).string();
    try {
      const ist::TriangleMesh mesh = ist::load_mesh(path.string());
      ist::ClosedMesh closed;
      try {
        closed = ist::close_mesh(mesh, name);
      } catch (const ist::Error& refusal) {
        ++totals.refused;
        report.row("Refused without repair", {{"mesh", name}, {"message", refusal.what()}});
        closed = ist::close_mesh(mesh, name, ist::OpenMeshPolicy::repair);
      }
      for (const std::size_t n : counts) bake_and_check(closed, name, n, report, totals);
    } catch (const ist::Error& error) {
      report.row("Failed with a reason", {{"mesh", name}, {"message", error.what()}});
    }
  }
  report.row("Totals", {{"assets", totals.assets},
                        {"violations", totals.violations},
                        {"refused without repair", totals.refused}});
  report.target("violations over all assets", static_cast<double>(totals.violations), 0, true);
  return report.write();
}
