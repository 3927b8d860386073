// Exact penetrations of many pairs at once on the GPU: rates with poses and answers resident, by
// how much the solids overlap, of a nut on its bolt, of mated parts and of small bodies; the same
// by all cores of the machine, and how far the answers differ.
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <ist/gpu_query.h>
#include <ist/query_tbb.h>

#include "cuda/base/queue.h"
#include "gpu_many.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/answer_bits.h"
#include "support/device_batch.h"
#include "support/device_patches.h"
#include "support/exact_pair.h"

namespace {

using namespace ist;
using namespace ist::benchmark;
using ist::testing::DeviceBatch;
using ist::testing::DevicePatches;

Asset mesh_of(const TriangleMesh& mesh, const std::string& name) {
  return bake_mesh_only(close_mesh(mesh, name), 0);
}

/// [ms] of the device.
double batch_ms(const GpuSolids& solids, GpuWorkspace& workspace, const DeviceBatch& batch) {
  return device_ms([&](cudaStream_t stream) {
    penetration_batch(solids, batch.pairs(), {Measure::exact}, workspace, batch.answers(), stream);
  });
}

/// [ms] with patches, so many at most.
double patches_ms(const GpuSolids& solids, GpuWorkspace& workspace, const DeviceBatch& batch,
                  std::size_t count, std::uint32_t most) {
  const DevicePatches patches(count, most);
  return device_ms([&](cudaStream_t stream) {
    contact_patches_batch(solids, batch.pairs(), Measure::exact, workspace, batch.answers(),
                          patches.patches(), stream);
  });
}

/// Reports the rate of contact patches, of fewer pairs.
void ask_patches(Report& report, const std::string& name, const Solids& solids,
                 const std::vector<BatchPair>& some, std::size_t count) {
  const GpuSolids on_device(solids.views());
  GpuWorkspace workspace(count);
  const std::vector<BatchPair> pairs = drawn(some, count);
  const DeviceBatch batch(pairs);
  const double whole = batch_ms(on_device, workspace, batch);
  const double ms = patches_ms(on_device, workspace, batch, count, 8);
  std::vector<BatchPair> asked = pairs;
  asked.resize(std::min<std::size_t>(count, 5'000));
  const std::vector<PlacedPair> placed = solids.placed(asked);
  std::vector<ContactPatches> cpu(asked.size());
  std::vector<ContactPatch> patches(8 * asked.size());
  ContactSettings settings;
  settings.measure = Measure::exact;
  const double by_cores = rate_of_cores(cpu.size(), 2, [&](std::span<Workspace> workspaces) {
    contact_patches_batch(placed, settings, workspaces, cpu, patches, tbb_parallel_for());
  });
  report.row("Contact patches, up to 8", {{"poses", name},
                                          {"pairs", count},
                                          {"M/s", static_cast<double>(count) / ms * 1e-3},
                                          {"times the penetrations' time", ms / whole},
                                          {"M/s by all cores", by_cores}});
}

/// Reports the time of few pairs.
void ask_few(Report& report, const std::string& name, const Solids& solids,
             const std::vector<BatchPair>& some) {
  const GpuSolids on_device(solids.views());
  Report::Json line = {{"poses", name}};
  for (const std::size_t count : {1u, 32u, 1024u}) {
    GpuWorkspace workspace(count);
    line[std::to_string(count) + (count == 1 ? " pair, us" : " pairs, us")] =
        1e3 * batch_ms(on_device, workspace, DeviceBatch(drawn(some, count)));
  }
  report.row("Few pairs", line);
}

/// Reports the rate of so many pairs on one card and shared out to all, by the host's clock.
void ask_cards(Report& report, const Solids& solids, const std::vector<BatchPair>& some,
               std::size_t count) {
  int all = 0;
  gpu::check(cudaGetDeviceCount(&all), "counting the cards");
  double alone = 0;
  for (int cards = 1; cards <= all; cards = cards == all ? all + 1 : all) {
    std::vector<std::unique_ptr<GpuSolids>> on_device;
    std::vector<std::unique_ptr<GpuWorkspace>> workspace;
    std::vector<std::unique_ptr<DeviceBatch>> batch;
    std::vector<std::unique_ptr<testing::Stream>> stream;
    const std::size_t each = count / static_cast<std::size_t>(cards);
    GpuSettings settings;
    for (settings.device = 0; settings.device < cards; ++settings.device) {
      const gpu::DeviceGuard guard(settings.device);
      on_device.push_back(std::make_unique<GpuSolids>(solids.views(), settings));
      workspace.push_back(std::make_unique<GpuWorkspace>(each, settings));
      batch.push_back(std::make_unique<DeviceBatch>(drawn(some, each)));
      stream.push_back(std::make_unique<testing::Stream>());
    }
    double best = 1e30;
    for (int k = 0; k < 4; ++k) {
      const double start = benchmark::wall_seconds();
      for (std::size_t card = 0; card < batch.size(); ++card)
        penetration_batch(*on_device[card], batch[card]->pairs(), {Measure::exact},
                          *workspace[card], batch[card]->answers(), *stream[card]);
      for (const auto& of : stream) of->wait();
      best = std::min(best, benchmark::wall_seconds() - start);
    }
    const double rate = static_cast<double>(each * batch.size()) / best * 1e-6;
    report.row("Cards", {{"cards", cards}, {"pairs", each * batch.size()}, {"M/s", rate}});
    if (cards == 1) alone = rate;
    if (cards == 2) report.target("two cards over one", rate / alone, 1.9);
  }
}

/// Reports the rate of pairs drawn from some; false where answers are not the CPU's.
bool ask(Report& report, const char* table, const std::string& name, const Solids& solids,
         const std::vector<BatchPair>& some, std::size_t count, double target) {
  if (some.empty()) return true;
  const std::vector<BatchPair> pairs = drawn(some, count);
  const GpuSolids on_device(solids.views());
  GpuWorkspace workspace(count);
  const DeviceBatch batch(pairs);
  const double ms = batch_ms(on_device, workspace, batch);
  const std::vector<Penetration> found = batch.get();
  std::vector<BatchPair> asked = pairs;
  asked.resize(std::min<std::size_t>(count, 5'000));
  const std::vector<PlacedPair> placed = solids.placed(asked);
  std::vector<Penetration> cpu(asked.size());
  PenetrationSettings settings;
  settings.measure = Measure::exact;
  const double by_cores = rate_of_cores(cpu.size(), 2, [&](std::span<Workspace> workspaces) {
    penetration_batch(placed, settings, workspaces, cpu, tbb_parallel_for());
  });
  double worst = 0, crossings = 0, visits = 0;
  std::size_t unanswered = 0, touching = 0, otherwise = 0;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (found[i].status != QueryStatus::ok) {
      ++unanswered;
      continue;
    }
    const Asset &a = *solids.assets[asked[i].a], &b = *solids.assets[asked[i].b];
    const double most = std::min(a.view().volume() * std::pow(asked[i].scale_a, 3),
                                 b.view().volume() * std::pow(asked[i].scale_b, 3));
    worst = std::max(worst, std::abs(found[i].volume - cpu[i].volume) / most);
    touching += found[i].touching ? 1 : 0;
    otherwise += found[i].touching != cpu[i].touching ||
                         std::abs(found[i].contact_area - cpu[i].contact_area) >
                             1e-9 * (cpu[i].contact_area + std::cbrt(most * most))
                     ? 1
                     : 0;
    crossings += found[i].sphere_pairs / static_cast<double>(asked.size());
    visits += found[i].node_visits / static_cast<double>(asked.size());
  }
  const double rate = static_cast<double>(count) / ms * 1e-3;
  report.row(table, {{"poses", name},
                     {"pairs", count},
                     {"M/s", rate},
                     {"crossings, mean", crossings},
                     {"node pairs opened, mean", visits},
                     {"M/s by all cores", by_cores},
                     {"largest difference to the CPU, of the smaller solid", worst},
                     {"touching of 5,000", touching},
                     {"of them not as on the CPU", otherwise},
                     {"unanswered of 5,000", unanswered}});
  if (target > 0) report.target(name + ", M/s", rate, target);
  return worst < 1e-11 && unanswered == 0 && otherwise == 0;
}

/// Reports the rate of pairs of which B moves and turns at each call by so much of its size, forth
/// and back, beside that from scratch; false where their bits differ.
bool ask_motion(Report& report, const std::string& name, const Solids& solids,
                const std::vector<BatchPair>& some, std::size_t count, double by) {
  if (some.empty()) return true;
  constexpr int kSteps = 12;
  constexpr std::size_t kBytesEach = 8192;
  std::vector<BatchPair> pairs = drawn(some, count);
  std::mt19937_64 random(11);
  const auto direction = [&] {
    Eigen::Vector3d x;
    do
      for (int k = 0; k < 3; ++k) x[k] = static_cast<double>(random() >> 11) * 0x1p-52 - 1;
    while (!(x.norm() > 0.1 && x.norm() < 1));
    return Eigen::Vector3d(x.normalized());
  };
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> speed;
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d moves = direction();
    speed.emplace_back(moves, direction());
  }
  const GpuSolids on_device(solids.views());
  GpuWorkspace workspace(count);
  GpuKept kept(count, kBytesEach);
  std::vector<std::unique_ptr<DeviceBatch>> steps;
  for (int step = 0; step < kSteps; ++step) {
    steps.push_back(std::make_unique<DeviceBatch>(pairs));
    for (std::size_t i = 0; i < count; ++i) {
      BatchPair& pair = pairs[i];
      const double size = testing::size_of({solids.assets[pair.b]->view(), {}, pair.scale_b});
      const double* const q = pair.pose_b.q;
      const Eigen::Quaterniond turned = Eigen::Quaterniond(Eigen::AngleAxisd(by, speed[i].second)) *
                                        Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
      pair.pose_b.q[0] = turned.w();
      for (int k = 0; k < 3; ++k) {
        pair.pose_b.q[k + 1] = turned.vec()[k];
        pair.pose_b.t[k] += by * size * speed[i].first[k];
      }
    }
  }
  // There and back: no jump from the last step to the first.
  const auto ms = [&](GpuKept* keeps) {
    return device_ms([&](cudaStream_t stream) {
             for (int n = 0; n < 2 * kSteps - 2; ++n) {
               const DeviceBatch& batch = *steps[n < kSteps ? n : 2 * kSteps - 2 - n];
               penetration_batch(on_device, batch.pairs(), {Measure::exact, 0, keeps}, workspace,
                                 batch.answers(), stream);
             }
           }) /
           (2 * kSteps - 2);
  };
  const auto hash = [&](std::size_t& searched) {
    testing::AnswerBits bits;
    for (const auto& batch : steps)
      for (Penetration answer : batch->get()) {
        searched += answer.node_visits != 0;
        answer.node_visits = 0;
        bits.add(answer);
      }
    return bits.value();
  };
  std::size_t all = 0, searched = 0;
  const double scratch_ms = ms(nullptr);
  const std::uint64_t expected = hash(all);
  const double kept_ms = ms(&kept);
  const bool same = hash(searched) == expected;
  const double pairs_a_call = static_cast<double>(count) * 1e-3;
  report.row("Motions", {{"poses", name},
                         {"moved a call, of the size", by},
                         {"pairs", count},
                         {"from scratch, M/s", pairs_a_call / scratch_ms},
                         {"kept, M/s", pairs_a_call / kept_ms},
                         {"kept over from scratch", scratch_ms / kept_ms},
                         {"searched", static_cast<double>(searched) / static_cast<double>(all)},
                         {"bytes a pair", kept.bytes() / count},
                         {"same bits", same}});
  return same;
}

/// Star-shaped bodies of some triangles, none convex, each beside its neighbours in a packed bed.
TriangleMesh small_body(std::size_t triangles, unsigned seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  TriangleMesh mesh;
  const std::uint32_t around = std::max<std::uint32_t>(
      4, static_cast<std::uint32_t>(std::sqrt(static_cast<double>(triangles) / 2)));
  const std::uint32_t rings =
      std::max<std::uint32_t>(1, static_cast<std::uint32_t>(triangles) / (2 * around));
  mesh.vertices.emplace_back(0, 0, -0.5);
  for (std::uint32_t j = 0; j < rings; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double up = std::numbers::pi * ((j + 1.0) / (rings + 1) - 0.5);
      const double turn = 2 * std::numbers::pi * i / around, r = 0.3 + 0.2 * uniform();
      mesh.vertices.emplace_back(r * std::cos(up) * std::cos(turn),
                                 r * std::cos(up) * std::sin(turn), r * std::sin(up));
    }
  mesh.vertices.emplace_back(0, 0, 0.5);
  const auto at = [&](std::uint32_t j, std::uint32_t i) { return 1 + j * around + i % around; };
  const auto top = static_cast<std::uint32_t>(mesh.vertices.size() - 1);
  for (std::uint32_t i = 0; i < around; ++i) {
    mesh.triangles.push_back({0, at(0, i + 1), at(0, i)});
    for (std::uint32_t j = 0; j + 1 < rings; ++j) {
      mesh.triangles.push_back({at(j, i), at(j, i + 1), at(j + 1, i + 1)});
      mesh.triangles.push_back({at(j, i), at(j + 1, i + 1), at(j + 1, i)});
    }
    mesh.triangles.push_back({at(rings - 1, i), at(rings - 1, i + 1), top});
  }
  return mesh;
}

bool measure(Report& report) {
  const std::size_t many = report.quick() ? 50'000 : 1'000'000;
  bool right = true;
  const Asset elephant = mesh_of(load_mesh(ist::testing::oracle_mesh_path("elephant")), "elephant");
  const Asset dino = mesh_of(load_mesh(ist::testing::oracle_mesh_path("dino")), "dino");
  const Solids two = {{&elephant, &dino}};
  std::map<std::string, std::vector<BatchPair>> classes;
  for (const ist::testing::OracleRow& row : ist::testing::read_oracle_rows("eledino")) {
    const double share = row.fraction_of_smaller;
    const std::string name = row.volume == 0               ? "apart"
                             : row.pose_class == "contain" ? "contained"
                             : share < 1e-4                ? "below 0.01 %"
                             : share < 1e-3                ? "0.01 to 0.1 %"
                             : share < 1e-2                ? "0.1 to 1 %"
                             : share < 1e-1                ? "1 to 10 %"
                                                           : "deep";
    classes[name].push_back(pair_of(row, 1));
  }
  const std::map<std::string, double> wanted = {
      {"0.01 to 0.1 %", 8}, {"0.1 to 1 %", 4}, {"1 to 10 %", 1}, {"deep", 0.7}};
  for (const auto& [name, poses] : classes)
    right = ask(report, "Elephant and dino", name, two, poses, many,
                wanted.contains(name) ? wanted.at(name) : 0) &&
            right;
  for (const char* name : {"0.1 to 1 %", "1 to 10 %", "deep"})
    ask_patches(report, name, two, classes.at(name), many / 50);
  for (const char* name : {"apart", "0.1 to 1 %", "deep"})
    ask_few(report, name, two, classes.at(name));
  ask_cards(report, two, classes.at("1 to 10 %"), many);
  const Asset bolt = mesh_of(make_sample("bolt"), "bolt"), nut = mesh_of(make_sample("nut"), "nut");
  std::vector<BatchPair> engaged = nut_poses(400);
  for (BatchPair& pair : engaged) pair.b = 1;
  const Solids thread = {{&bolt, &nut}};
  right = ask(report, "Nut on bolt", "engaged", thread, engaged, many / 2, 0.5) && right;
  ask_patches(report, "nut on bolt, engaged", thread, engaged, many / 200);
  right = ask(report, "Nut on bolt", "in clearance", thread, clear_nut_poses(400), many / 2, 2) &&
          right;
  for (const double by : {1e-4, 3e-4, 1e-3}) {
    for (const char* name : {"0.01 to 0.1 %", "0.1 to 1 %", "1 to 10 %"})
      right = ask_motion(report, name, two, classes.at(name), many / 20, by) && right;
    right = ask_motion(report, "engaged", thread, engaged, many / 20, by) && right;
    right =
        ask_motion(report, "in clearance", thread, clear_nut_poses(400), many / 20, by) && right;
  }
  // Mated parts, as they are and all together.
  const MatedParts mated(mesh_of, [](const ist::testing::MatedRow& row) {
    return row.name + (row.moved == 0 ? ", in place" : row.moved < 1e-2 ? ", near" : ", moved");
  });
  for (const char* name : {"bolt_in_plate, in place", "plate_on_plate, in place"})
    ask_few(report, name, mated.solids, mated.mates.at(name));
  ask_patches(report, "plate_on_plate, in place", mated.solids,
              mated.mates.at("plate_on_plate, in place"), many / 500);
  for (const auto& [name, poses] : mated.mates)
    right = ask(report, "Mated parts", name, mated.solids, poses, many / 50, 0) && right;
  for (const std::size_t triangles : {8u, 24u, 80u, 200u}) {
    const Asset a = mesh_of(small_body(triangles, 1), "body"),
                b = mesh_of(small_body(triangles, 2), "body");
    std::mt19937_64 random(3);
    std::vector<BatchPair> poses;
    for (int k = 0; k < 4000; ++k) {
      const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-52 - 1; };
      BatchPair pair;
      pair.b = 1;
      for (double& q : pair.pose_b.q) q = uniform();
      double square = 0;
      for (double& t : pair.pose_b.t) t = uniform(), square += t * t;
      for (double& t : pair.pose_b.t) t *= 0.75 / std::sqrt(square);
      poses.push_back(pair);
    }
    right = ask(report, "Small bodies", std::to_string(triangles) + " triangles", {{&a, &b}}, poses,
                many, 0) &&
            right;
  }
  return right;
}

}  // namespace

int main(int argc, char** argv) {
  return ist::benchmark::report_of_gpu("gpu_exact", "Exact penetrations of many pairs on a GPU",
                                       argc, argv, measure);
}
