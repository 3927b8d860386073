// Penetrations, separations and contact patches of many pairs at once on the GPU: rates with a
// million poses, the time of one step of 4,096 worlds, growth with spheres and with the batch,
// trees in fields; the same by all cores of the machine. Answers are compared with the CPU's.
#include <cuda_runtime_api.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/gpu_fields.h>
#include <ist/query_tbb.h>

#include "cuda/check.h"
#include "report.h"
#include "samples/samples.h"
#include "support/device_patches.h"
#include "support/device_separations.h"
#include "support/oracle_rows.h"
#include "support/reference_sum.h"
#include "timing.h"

namespace {

using namespace ist;
using ist::benchmark::Report;
using ist::testing::BatchPair;
using ist::testing::DeviceBatch;
using ist::testing::DevicePatches;
using ist::testing::DeviceSeparations;

constexpr int kRepeats = 10;

Asset baked(const TriangleMesh& mesh, const std::string& name, std::size_t spheres,
            bool field = false) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.field.wanted = field;
  return bake(close_mesh(mesh, name), settings);
}

/// Two solids and the poses at which B meets A.
struct Scene {
  std::string name;
  const Asset* a;  ///< of none if there is a field
  const Asset* b;
  std::vector<BatchPair> poses;
  double rate = 0, step_ms = 0;  ///< what one H200 is to reach: M/s of a million, ms of 4,096; 0: –
  const Field* field = nullptr;  ///< in A's place
  std::uint32_t pair_budget = 0;
};

/// A nut on its bolt at any turn, its thread pushed a little way out of the middle of the gap.
std::vector<BatchPair> nut_poses(std::size_t count) {
  std::mt19937_64 random(5);
  std::vector<BatchPair> out;
  for (std::size_t k = 0; k < count; ++k) {
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    const double turn = uniform(0, 1);
    const double half = std::numbers::pi * turn;
    BatchPair pair;
    pair.b = 1;
    pair.pose_b = {
        {std::cos(half), 0, 0, std::sin(half)},
        {uniform(-0.04, 0.04), uniform(-0.04, 0.04), 8 + 2 * turn + uniform(-0.08, 0.08)}};
    out.push_back(pair);
  }
  return out;
}

/// Rolling ground about z = 0, as large as all poses.
class Ground {
 public:
  Ground() {
    for (std::uint32_t j = 0; j < kPoints; ++j)
      for (std::uint32_t i = 0; i < kPoints; ++i)
        heights_.push_back(static_cast<float>(std::sin(0.7 * i) * std::cos(0.9 * j)));
  }

  /// Cells a tenth of the body's size across.
  Field terrain(const Asset& body) {
    const double cell = 0.1 * std::cbrt(body.view().volume());
    for (float& height : heights_) height *= static_cast<float>(0.2 * cell);
    return HeightField{heights_.data(), kPoints, kPoints, {cell, cell}};
  }

 private:
  static constexpr std::uint32_t kPoints = 256;
  std::vector<float> heights_;
};

/// A solid at any turn, so deep in the half-space z ≤ 0: parts of its height, drawn from a range.
std::vector<BatchPair> poses_in_ground(const Asset& body, double least, double most) {
  std::mt19937_64 random(7);
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<BatchPair> out;
  while (out.size() < 400) {
    BatchPair pair;
    double square = 0;
    for (double& q : pair.pose_b.q) {
      q = uniform(-1, 1);
      square += q * q;
    }
    if (!(square > 0.01 && square < 1)) continue;
    for (double& q : pair.pose_b.q) q /= std::sqrt(square);
    pair.b = 0;
    double bottom = 1e300, top = -1e300;
    for (const testing::WorldSphere& ball :
         testing::world_spheres({body.view(), pair.pose_b, 1}, Measure::matched)) {
      bottom = std::min(bottom, ball.centre.z() - ball.r);
      top = std::max(top, ball.centre.z() + ball.r);
    }
    pair.pose_b.t[2] = -bottom - uniform(least, most) * (top - bottom);
    out.push_back(pair);
  }
  return out;
}

/// Rows of a small solid on a large one (oracle/small) at a ratio of their sizes.
std::vector<BatchPair> small_poses(const std::string& key, const std::string& ratio) {
  std::vector<BatchPair> out;
  for (const auto& row :
       testing::read_csv(testing::shared_path("oracle/small/" + key + ".csv").string())) {
    if (!row.at("class").starts_with("r" + ratio + "_")) continue;
    const auto number = [&](const char* column) { return std::stod(row.at(column)); };
    BatchPair pair;
    pair.pose_b = {{number("qw"), number("qx"), number("qy"), number("qz")},
                   {number("tx"), number("ty"), number("tz")}};
    pair.scale_b = number("scale_b");
    out.push_back(pair);
  }
  return out;
}

/// Copies of a solid that stand apart by up to a part of its size, in any direction.
std::vector<BatchPair> poses_of_copies(const Asset& body, double most) {
  std::mt19937_64 random(9);
  std::vector<BatchPair> out;
  for (int i = 0; i < 400; ++i) {
    BatchPair pair;
    pair.b = 1;
    for (double& t : pair.pose_b.t)
      t = most * std::cbrt(body.view().volume()) *
          (static_cast<double>(random() >> 11) * 0x1p-52 - 1);
    out.push_back(pair);
  }
  return out;
}

std::vector<BatchPair> oracle_poses(const std::string& pose_class) {
  std::vector<BatchPair> out;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
    if (row.pose_class != pose_class) continue;
    BatchPair pair;
    pair.b = 1;
    pair.pose_b = row.pose;
    pair.scale_b = row.scale_b;
    out.push_back(pair);
  }
  return out;
}

/// `count` of the poses in random order.
std::vector<BatchPair> drawn(const std::vector<BatchPair>& poses, std::size_t count) {
  std::mt19937_64 random(1);
  std::vector<BatchPair> out;
  out.reserve(count);
  for (std::size_t k = 0; k < count; ++k) out.push_back(poses[random() % poses.size()]);
  return out;
}

class Stream {
 public:
  Stream() {
    gpu::check(cudaStreamCreate(&stream_), "making a stream");
    for (cudaEvent_t& event : events_) gpu::check(cudaEventCreate(&event), "making an event");
  }
  ~Stream() {
    for (cudaEvent_t event : events_) cudaEventDestroy(event);
    cudaStreamDestroy(stream_);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  cudaStream_t get() const { return stream_; }

  /// [ms] of the device's work.
  template <class Work>
  double time(const Work& work) const {
    gpu::check(cudaEventRecord(events_[0], stream_), "timing");
    work();
    gpu::check(cudaEventRecord(events_[1], stream_), "timing");
    gpu::check(cudaEventSynchronize(events_[1]), "timing");
    float ms = 0;
    gpu::check(cudaEventElapsedTime(&ms, events_[0], events_[1]), "timing");
    return static_cast<double>(ms);
  }

 private:
  cudaStream_t stream_ = nullptr;
  cudaEvent_t events_[2] = {};
};

class Batches {
 public:
  explicit Batches(std::size_t most) : large_(most), small_(kFew) {}

  /// [ms], the median of ten; keeps the last answers.
  double median_ms(const Scene& scene, std::size_t count) {
    const bool in_field = scene.field != nullptr;
    std::vector<TreeView> views = {scene.b->view()};
    if (!in_field) views.insert(views.begin(), scene.a->view());
    const GpuAssets assets(views);
    const GpuFields fields({scene.field, in_field ? 1u : 0u});
    const DeviceBatch batch(drawn(scene.poses, count));
    const double ms = median_ms([&] {
      if (in_field)
        penetration_batch(assets, fields, batch.pairs(), Measure::matched, workspace(count),
                          batch.answers(), stream_.get());
      else
        penetration_batch(assets, batch.pairs(), {Measure::matched, scene.pair_budget},
                          workspace(count), batch.answers(), stream_.get());
    });
    answers_ = batch.get();
    return ms;
  }
  /// Likewise.
  double median_separation_ms(const Scene& scene, std::size_t count) {
    const TreeView views[2] = {scene.a->view(), scene.b->view()};
    const GpuAssets assets(views);
    const DeviceBatch batch(drawn(scene.poses, count));
    const DeviceSeparations answers(count);
    const double ms = median_ms([&] {
      separation_batch(assets, batch.pairs(), 0, workspace(count), answers.answers(),
                       stream_.get());
    });
    separations_ = answers.get();
    return ms;
  }

  /// Likewise.
  double median_patches_ms(const Scene& scene, std::size_t count, std::uint32_t most) {
    const TreeView views[2] = {scene.a->view(), scene.b->view()};
    const GpuAssets assets(views);
    const DeviceBatch batch(drawn(scene.poses, count));
    const DevicePatches patches(count, most);
    const double ms = median_ms([&] {
      contact_patches_batch(assets, batch.pairs(), Measure::matched, workspace(count),
                            batch.answers(), patches.patches(), stream_.get());
    });
    patched_ = patches.get(batch.get());
    return ms;
  }

  const std::vector<testing::PatchedPair>& patched() const { return patched_; }
  const std::vector<Penetration>& answers() const { return answers_; }
  const std::vector<Separation>& separations() const { return separations_; }

 private:
  template <class Run>
  double median_ms(const Run& run) {
    run();
    std::vector<double> ms;
    for (int k = 0; k < kRepeats; ++k) ms.push_back(stream_.time(run));
    return benchmark::quantile(ms, 0.5);
  }

  /// A step of few pairs has a workspace of its own, as who has but few would make it.
  GpuWorkspace& workspace(std::size_t count) { return count > kFew ? large_ : small_; }
  static constexpr std::size_t kFew = 4096;

  GpuWorkspace large_, small_;
  Stream stream_;
  std::vector<Penetration> answers_;
  std::vector<Separation> separations_;
  std::vector<testing::PatchedPair> patched_;
};

std::vector<PlacedPair> placed(const Scene& scene, std::size_t count) {
  std::vector<PlacedPair> out;
  for (const BatchPair& pair : drawn(scene.poses, count))
    out.push_back({{scene.a->view(), pair.pose_a, pair.scale_a},
                   {scene.b->view(), pair.pose_b, pair.scale_b}});
  return out;
}

std::vector<PlacedFieldPair> placed_in_field(const Scene& scene, std::size_t count) {
  std::vector<PlacedFieldPair> out;
  for (const BatchPair& pair : drawn(scene.poses, count))
    out.push_back(
        {{*scene.field, pair.pose_a, pair.scale_a}, {scene.b->view(), pair.pose_b, pair.scale_b}});
  return out;
}

/// M/s by all cores; `answers` of as many.
double cpu_rate(const Scene& scene, std::size_t count, std::vector<Penetration>& answers) {
  std::vector<PlacedPair> pairs;
  std::vector<PlacedFieldPair> in_field;
  if (scene.field != nullptr)
    in_field = placed_in_field(scene, count);
  else
    pairs = placed(scene, count);
  PenetrationSettings settings;
  settings.field = FieldUse::never;
  settings.pair_budget = scene.pair_budget;
  std::vector<Workspace> workspaces(std::thread::hardware_concurrency());
  answers.resize(count);
  double best = 1e30;
  for (int k = 0; k < 3; ++k) {
    const double start = benchmark::wall_seconds();
    if (scene.field != nullptr)
      penetration_batch(in_field, settings, workspaces, answers, tbb_parallel_for());
    else
      penetration_batch(pairs, settings, workspaces, answers, tbb_parallel_for());
    best = std::min(best, benchmark::wall_seconds() - start);
  }
  return static_cast<double>(count) / best * 1e-6;
}

/// Separations by all cores, M/s; `answers` of as many.
double cpu_separation_rate(const Scene& scene, std::size_t count,
                           std::vector<Separation>& answers) {
  struct Batch {
    std::vector<PlacedPair> pairs;
    std::vector<Workspace> workspaces;
    std::vector<Separation>& answers;
  };
  answers.resize(count);
  Batch batch{placed(scene, count), std::vector<Workspace>(std::thread::hardware_concurrency()),
              answers};
  const auto work = [](void* of, std::size_t worker) {
    Batch& all = *static_cast<Batch*>(of);
    for (std::size_t i = worker; i < all.pairs.size(); i += all.workspaces.size())
      all.answers[i] = separation(all.pairs[i].a, all.pairs[i].b, {}, all.workspaces[worker]);
  };
  const ParallelFor threads = tbb_parallel_for();
  double best = 1e30;
  for (int k = 0; k < 3; ++k) {
    const double start = benchmark::wall_seconds();
    threads.run(threads.pool, batch.workspaces.size(), work, &batch);
    best = std::min(best, benchmark::wall_seconds() - start);
  }
  return static_cast<double>(count) / best * 1e-6;
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
    settings.field = FieldUse::never;
    std::vector<Workspace> workspaces(std::thread::hardware_concurrency());
    double best = 1e30;
    for (int k = 0; k < 3; ++k) {
      const double start = benchmark::wall_seconds();
      contact_patches_batch(pairs, settings, workspaces, answers, patches, tbb_parallel_for());
      best = std::min(best, benchmark::wall_seconds() - start);
    }
    rate = static_cast<double>(count) / best * 1e-6;
  }
};

/// What contacts differ by from the CPU's.
struct PatchDifference {
  double of_other_regions = 0;  ///< part of the pairs
  double volume = 0;            ///< largest of a patch, relative
  double patches = 0;           ///< mean of a pair
};

PatchDifference difference(const std::vector<testing::PatchedPair>& gpu, const CpuPatches& cpu,
                           std::uint32_t most) {
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
double worst_volume(const std::vector<Penetration>& gpu, const std::vector<Penetration>& cpu) {
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

SeparationDifference difference(const std::vector<Separation>& gpu,
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

/// Reports a scene's separations; false where they are not the CPU's.
bool separates(Report& report, Batches& batches, const Scene& scene, std::size_t many,
               std::size_t for_cpu) {
  const double ms = batches.median_separation_ms(scene, many);
  std::vector<Separation> cpu;
  const double by_cores = cpu_separation_rate(scene, for_cpu, cpu);
  const SeparationDifference from_cpu = difference(batches.separations(), cpu);
  report.row("Separations", {{"poses", scene.name},
                             {"spheres", scene.a->view().sphere_count()},
                             {"pairs", many},
                             {"M/s", static_cast<double>(many) / ms * 1e-3},
                             {"4,096 pairs, ms", batches.median_separation_ms(scene, 4096)},
                             {"node pairs opened, mean", from_cpu.visits},
                             {"M/s by all cores", by_cores},
                             {"largest difference to the CPU", from_cpu.distance}});
  return from_cpu.certified && from_cpu.distance < 1e-6;
}

/// Reports a scene's contact patches; false where they are not the CPU's.
bool patches_are_right(Report& report, Batches& batches, const Scene& scene, std::size_t many,
                       std::size_t for_cpu, std::uint32_t most) {
  const double ms = batches.median_patches_ms(scene, many, most);
  const CpuPatches cpu(scene, for_cpu, most);
  const PatchDifference from_cpu = difference(batches.patched(), cpu, most);
  const double rate = static_cast<double>(many) / ms * 1e-3;
  report.row("Contact patches", {{"poses", scene.name},
                                 {"spheres", scene.a->view().sphere_count()},
                                 {"patches, at most", most},
                                 {"patches, mean", from_cpu.patches},
                                 {"pairs", many},
                                 {"M/s", rate},
                                 {"times a penetration", ms / batches.median_ms(scene, many)},
                                 {"4,096 pairs, ms", batches.median_patches_ms(scene, 4096, most)},
                                 {"M/s by all cores", cpu.rate},
                                 {"pairs of other regions", from_cpu.of_other_regions},
                                 {"largest difference to the CPU", from_cpu.volume}});
  return from_cpu.of_other_regions < 0.01 && from_cpu.volume < 1e-3;
}

int measure(Report& report) {
  const std::size_t many = report.quick() ? 100'000 : 1'000'000;
  const std::size_t for_cpu = report.quick() ? 2'000 : 20'000;
  const TriangleMesh elephant = load_mesh(testing::oracle_mesh_path("elephant"));
  const TriangleMesh dino = load_mesh(testing::oracle_mesh_path("dino"));
  const Asset elephant4k = baked(elephant, "elephant", 4'000), dino4k = baked(dino, "dino", 4'000);
  const Asset bolt = baked(make_sample("bolt"), "bolt", 10'000);
  const Asset nut = baked(make_sample("nut"), "nut", 10'000);
  std::vector<Scene> scenes;
  const auto of_oracle = [&](const std::string& name, double rate, double step_ms) {
    scenes.push_back({name, &elephant4k, &dino4k, oracle_poses(name), rate, step_ms});
  };
  of_oracle("pen", 25, 0.3);
  of_oracle("deep", 3, 0);
  of_oracle("contain", 8, 0);
  of_oracle("sep", 500, 0);
  scenes.push_back({"nut on bolt", &bolt, &nut, nut_poses(400), 2, 2});

  Batches batches(many);
  bool right = true;
  const auto ask = [&](const char* table, const Scene& scene, double allowed, std::size_t count) {
    const double ms = batches.median_ms(scene, count);
    const double rate = static_cast<double>(count) / ms * 1e-3;
    std::vector<Penetration> cpu;
    const double by_cores = cpu_rate(scene, for_cpu, cpu);
    const double worst = worst_volume(batches.answers(), cpu);
    const double step = batches.median_ms(scene, 4096);
    right = right && worst < allowed;
    report.row(table, {{"poses", scene.name},
                       {"spheres", scene.b->view().sphere_count()},
                       {"pairs", count},
                       {"M/s", rate},
                       {"4,096 pairs, ms", step},
                       {"M/s by all cores", by_cores},
                       {"largest difference to the CPU", worst}});
    if (scene.rate > 0) report.target(scene.name + ", M/s", rate, scene.rate);
    if (scene.step_ms > 0) report.target(scene.name + ", 4,096 in ms", step, scene.step_ms, true);
  };
  for (const Scene& scene : scenes) ask("Batches", scene, 1e-4, many);
  for (const std::uint32_t budget : {250u, 1'000u, 4'000u})
    ask("Pair budgets",
        {"deep, " + std::to_string(budget), &elephant4k, &dino4k, oracle_poses("deep"), 0, 0,
         nullptr, budget},
        1e-4, many / 10);
  ask("Pair budgets", {"pen, 1000", &elephant4k, &dino4k, oracle_poses("pen"), 0, 0, nullptr, 1000},
      1e-4, many / 10);
  ask("Pair budgets",
      {"copies nearly in place, none", &dino4k, &dino4k, poses_of_copies(dino4k, 0.02)}, 1e-4,
      many / 10);

  const Asset surface = baked(elephant, "elephant", 1'000, true);
  Ground ground;
  const Field half_space = HalfSpaceField{}, terrain = ground.terrain(dino4k),
              mesh = MeshField{surface.view()};
  const auto in_ground = [&](const std::string& name, const Field& field, double least, double most,
                             double rate) {
    ask("Fields", {name, nullptr, &dino4k, poses_in_ground(dino4k, least, most), rate, 0, &field},
        1e-6, many);
  };
  in_ground("half-space, to 2 % of the height", half_space, 0, 0.02, 50);
  in_ground("half-space, to any depth", half_space, 0, 1, 50);
  in_ground("half-space, above it", half_space, -1, 0, 0);
  in_ground("terrain, to 10 %", terrain, 0, 0.1, 0);
  for (const char* const ratio : {"0.03", "0.1", "0.3"})
    ask("Fields",
        {std::string("on a mesh, ") + ratio + " of its size", nullptr, &dino4k,
         small_poses("small_elephant_dino", ratio), ratio == std::string("0.3") ? 0.0 : 20.0, 0,
         &mesh},
        1e-6, many / 10);
  for (const char* const name : {"pen", "deep", "contain", "sep"}) {
    std::vector<BatchPair> poses = oracle_poses(name);
    for (BatchPair& pair : poses) pair.b = 0;  // the only tree
    ask("Fields", {std::string("in a mesh, ") + name, nullptr, &dino4k, poses, 0, 0, &mesh}, 1e-6,
        for_cpu);
  }
  Scene near = scenes[3], far = near;
  near.name = "near each other";
  far.name = "ten times as far";
  for (BatchPair& pair : far.poses)
    for (double& t : pair.pose_b.t) t *= 10;
  for (const Scene& scene : {near, far, scenes[0], scenes[1], scenes[4]})
    right = separates(report, batches, scene, many, for_cpu) && right;
  for (const std::uint32_t most : {4u, 16u})
    for (const Scene& scene : {scenes[0], scenes[1], scenes[4]})
      right = patches_are_right(report, batches, scene, many, for_cpu, most) && right;
  for (std::size_t count = 1; count <= many; count *= 8)
    report.row("Growth with the batch",
               {{"poses", "pen"}, {"pairs", count}, {"ms", batches.median_ms(scenes[0], count)}});
  for (const std::size_t spheres : {250u, 1'000u, 16'000u, 64'000u}) {
    if (report.quick() && spheres > 1'000) break;
    const Asset a = baked(elephant, "elephant", spheres), b = baked(dino, "dino", spheres);
    const Scene scene{"pen", &a, &b, scenes[0].poses};
    const double ms = batches.median_ms(scene, many / 10);
    report.row("Growth with spheres", {{"poses", "pen"},
                                       {"spheres", spheres},
                                       {"pairs", many / 10},
                                       {"M/s", static_cast<double>(many / 10) / ms * 1e-3}});
  }
  const int written = report.write();
  if (right) return written;
  std::fprintf(stderr, "answers differ from the CPU's\n");
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  Report report("gpu_batch", argc, argv);
  report.page("Penetrations, separations and contact patches of many pairs on a GPU");
  std::string why;
  if (!gpu_available(0, &why)) {
    std::fprintf(stderr, "gpu_batch: %s\n", why.c_str());
    return 1;
  }
  try {
    return measure(report);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
