// Where the time of a bake goes: every stage on its own and the whole bake, on the CPU and, if
// there is one, on the GPU. Import is a stage of its own, not part of the whole bake. Checks that
// both devices give the same bytes.

#include <ist/bake.h>
#include <ist/gpu.h>

#include <algorithm>
#include <chrono>
#include <cstring>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bake/backend/make_backend.h"
#include "bake/cluster/tree_builder.h"
#include "bake/mesh/kept_mesh.h"
#include "packing/cover/cover.h"
#include "report.h"
#include "support/on_host.h"
#include "support/shared_data.h"

namespace {

using namespace ist;
using benchmark::Report;

/// Milliseconds of every stage, one entry a repetition.
class Stages {
 public:
  template <class Stage>
  auto time(const std::string& name, const Stage& stage) {
    const auto start = std::chrono::steady_clock::now();
    auto result = stage();
    times_[name].push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
            .count());
    return result;
  }

  void add_to(Report::Json& row) const {
    for (const auto& [name, times] : times_) {
      std::vector<double> sorted = times;
      std::sort(sorted.begin(), sorted.end());
      row[name + " [ms]"] = sorted[sorted.size() / 2];
      row[name + ", least"] = sorted.front();
      row[name + ", most"] = sorted.back();
    }
  }

 private:
  std::map<std::string, std::vector<double>> times_;
};

void one_bake(const ClosedMesh& mesh, const PackingSettings& settings, Stages& stages) {
  const auto solid = stages.time("1 solid", [&] { return std::make_unique<MeshSolid>(mesh); });
  stages.time("2 volume", [&] { return solid->unit_volume(); });
  const auto backend =
      stages.time("3 backend", [&] { return make_backend(*solid, settings.device, settings.gpu); });
  const auto inner = stages.time("4 pack", [&] { return backend->pack(settings, {}).spheres; });
  const auto calibration =
      stages.time("5 calibrate", [&] { return testing::calibrate(*solid, *backend, inner, {}); });
  const auto covers =
      stages.time("6 cover", [&] { return cover_radii(*solid, *backend, inner, {}); });
  const auto order = stages.time("7 order", [&] { return sphere_order(inner); });
  stages.time("8 trees", [&] {
    tree_from_order(inner, covers, order);
    return build_tree_like(calibration.matched, order);
  });
  stages.time("9 mesh", [&] { return keep_mesh(*solid, Resolution()); });
}

}  // namespace

int main(int argc, char** argv) {
  Report report("bake_stages", argc, argv);
  struct Case {
    const char* file;
    std::size_t spheres;
  };
  std::vector<Case> cases = {{"oracle/meshes/dino.off", 1'000}};
  if (!report.quick())
    cases = {{"oracle/meshes/dino.off", 10'000},
             {"meshes/dev/dragon_871k.ply", 10'000},
             {"meshes/dev/dragon_871k.ply", 100'000}};
  for (const Case& c : cases) {
    const std::filesystem::path path = testing::shared_path(c.file);
    if (!std::filesystem::exists(path)) {
      report.remark("missing: " + std::string(c.file));
      continue;
    }
    const ClosedMesh mesh = close_mesh(load_mesh(path.string()), path.string());
    std::unique_ptr<Asset> before;
    for (const Device device : {Device::cuda, Device::cpu}) {
      if (device == Device::cuda && !gpu_available()) continue;
      if (device == Device::cpu && c.spheres > 10'000) continue;  // half a minute
      PackingSettings settings;
      settings.max_spheres = c.spheres;
      settings.device = device;
      const bool fast = device == Device::cuda;
      const int rounds = report.quick() || !fast ? 1 : c.spheres > 10'000 ? 3 : 10;
      Stages stages;
      std::unique_ptr<Asset> asset;
      if (fast) bake(mesh, settings);  // warms up
      for (int k = 0; k < rounds; ++k) {
        stages.time("0 import",
                    [&] { return close_mesh(load_mesh(path.string()), path.string()); });
        one_bake(mesh, settings, stages);
        asset = stages.time("whole bake",
                            [&] { return std::make_unique<Asset>(bake(mesh, settings)); });
      }
      Report::Json row = {{"mesh", path.stem().string()},
                          {"spheres", c.spheres},
                          {"device", fast ? gpu_info().name : "CPU"}};
      stages.add_to(row);
      if (before)
        row["same bytes"] =
            asset->bytes().size() == before->bytes().size() &&
            std::memcmp(asset->bytes().data(), before->bytes().data(), asset->bytes().size()) == 0;
      before = std::move(asset);
      report.row("Stages of a bake", row);
    }
  }
  return report.write();
}
