// Distances of many pairs of meshes at once on the GPU: rates with poses and answers resident, of
// the oracle's classes, of a nut in clearance and of mated parts; the same by all cores of the
// machine, and how far the answers differ.
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/query_tbb.h>

#include "gpu_many.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/device_batch.h"
#include "support/device_separations.h"

namespace {

using namespace ist;
using namespace ist::benchmark;
using ist::testing::DeviceBatch;
using ist::testing::DeviceSeparations;

/// Reports the rate of pairs drawn from some; false where answers are not the CPU's.
bool ask(Report& report, const char* table, const std::string& name, const Solids& solids,
         const std::vector<BatchPair>& some, std::size_t count, double target = 0,
         double max_distance = 0) {
  if (some.empty()) return true;
  const std::vector<BatchPair> pairs = drawn(some, count);
  const GpuSolids on_device(solids.views());
  GpuWorkspace workspace(count);
  const DeviceBatch batch(pairs);
  const DeviceSeparations answers(count);
  const double ms = device_ms([&](cudaStream_t stream) {
    separation_batch(on_device, batch.pairs(), {0, max_distance}, workspace, answers.answers(),
                     stream);
  });
  const std::vector<Separation> found = answers.get();
  std::vector<BatchPair> asked = pairs;
  asked.resize(std::min<std::size_t>(count, 5'000));
  const std::vector<PlacedPair> placed = solids.placed(asked);
  std::vector<Separation> cpu(asked.size());
  SeparationSettings settings;
  settings.max_distance = max_distance;
  const double by_cores = rate_of_cores(cpu.size(), 2, [&](std::span<Workspace> workspaces) {
    separation_batch(placed, settings, workspaces, cpu, tbb_parallel_for());
  });
  double worst = 0, visits = 0, tests = 0;
  std::size_t apart = 0;
  bool right = true;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    right = right && found[i].status == cpu[i].status &&
            (found[i].distance == 0) == (cpu[i].distance == 0);
    visits += found[i].node_visits / static_cast<double>(asked.size());
    tests += found[i].sphere_pairs / static_cast<double>(asked.size());
    if (cpu[i].distance == 0) continue;
    ++apart;
    worst = std::max(worst, std::abs(found[i].distance / cpu[i].distance - 1));
  }
  const double rate = static_cast<double>(count) / ms * 1e-3;
  report.row(table, {{"poses", name},
                     {"pairs", count},
                     {"M/s", rate},
                     {"apart, of 5,000", apart},
                     {"node pairs opened, mean", visits},
                     {"spheres and triangles measured, mean", tests},
                     {"M/s by all cores", by_cores},
                     {"largest difference to the CPU, relative", worst},
                     {"all overlaps as there", right ? "yes" : "no"}});
  if (target > 0) report.target(name + ", M/s", rate, target);
  return right && worst < 1e-9;
}

bool measure(Report& report) {
  const std::size_t many = report.quick() ? 50'000 : 1'000'000;
  constexpr std::size_t kSpheres = 4000;
  bool right = true;
  std::map<std::string, Asset> assets;
  const auto asset = [&](const std::string& mesh, bool spheres = true) -> const Asset* {
    const std::string name = mesh + (spheres ? "" : " alone");
    const auto found = assets.find(name);
    if (found != assets.end()) return &found->second;
    const TriangleMesh from = load_mesh(ist::testing::oracle_mesh_path(mesh));
    return &assets
                .emplace(name, spheres ? baked(from, mesh, kSpheres, true)
                                       : bake_mesh_only(close_mesh(from, mesh), 0))
                .first->second;
  };
  for (const std::string& key : ist::testing::kPairKeys) {
    std::map<std::string, std::vector<BatchPair>> classes;
    std::vector<double> distances;
    const std::vector<ist::testing::OracleRow> rows = ist::testing::read_oracle_rows(key);
    for (const ist::testing::OracleRow& row : rows) {
      classes[row.pose_class].push_back(pair_of(row, 1));
      if (row.pose_class == "sep") distances.push_back(row.surface_distance);
    }
    const Solids two = {{asset(rows[0].mesh_a), asset(rows[0].mesh_b)}};
    const char* const table = "The oracle's poses";
    const bool first = key == "eledino";
    right = ask(report, table, key + " sep", two, classes["sep"], many, first ? 5 : 0) && right;
    if (!first) continue;
    const Solids alone = {{asset(rows[0].mesh_a, false), asset(rows[0].mesh_b, false)}};
    right = ask(report, table, key + " sep, without spheres", alone, classes["sep"], many) && right;
    right = ask(report, table, key + " sep, max_distance the median's half", two, classes["sep"],
                many, 0, 0.5 * benchmark::quantile(distances, 0.5)) &&
            right;
    for (const char* of : {"pen", "deep", "contain"})
      right = ask(report, table, key + " " + of, two, classes[of], many) && right;
  }
  const Asset bolt = baked(make_sample("bolt"), "bolt", kSpheres, true),
              nut = baked(make_sample("nut"), "nut", kSpheres, true);
  right = ask(report, "Nut on bolt", "in clearance", {{&bolt, &nut}}, clear_nut_poses(400),
              many / 10) &&
          right;
  // Mated parts, in place and moved along the mate by up to a tenth.
  const MatedParts mated([](const TriangleMesh& mesh,
                            const std::string& name) { return baked(mesh, name, 1000, true); },
                         [](const ist::testing::MatedRow& row) { return row.name; });
  for (const auto& [name, poses] : mated.mates)
    right = ask(report, "Mated parts", name, mated.solids, poses, many / 50) && right;
  return right;
}

}  // namespace

int main(int argc, char** argv) {
  return ist::benchmark::report_of_gpu("gpu_distance", "Distances of many pairs of meshes on a GPU",
                                       argc, argv, measure);
}
