// Penetrations, separations and contact patches of many pairs at once on the GPU: rates with a
// million poses, the time of one step of 4,096 worlds, growth with spheres and with the batch,
// trees in fields; the same by all cores of the machine. Answers are compared with the CPU's.
#include <cuda_runtime_api.h>

#include <string>
#include <vector>

#include <ist/gpu_query.h>

#include "cuda/base/check.h"
#include "gpu_batch_on_cpu.h"
#include "gpu_batch_scenes.h"
#include "gpu_many.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/device_patches.h"
#include "support/device_separations.h"
#include "timing.h"

namespace {

using namespace ist;
using namespace ist::benchmark;
using ist::testing::DeviceBatch;
using ist::testing::DevicePatches;
using ist::testing::DeviceSeparations;

constexpr int kRepeats = 10;

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
    const GpuSolid a = scene.field != nullptr ? GpuSolid(*scene.field) : scene.a->view();
    const GpuSolids solids(std::vector<GpuSolid>{a, scene.b->view()});
    const DeviceBatch batch(drawn_of_two(scene.poses, count));
    const double ms = median_ms([&] {
      penetration_batch(solids, batch.pairs(), {Measure::matched, scene.pair_budget},
                        workspace(count), batch.answers(), stream_.get());
    });
    answers_ = batch.get();
    return ms;
  }
  /// Likewise.
  double median_separation_ms(const Scene& scene, std::size_t count) {
    const GpuSolids solids(std::vector<GpuSolid>{scene.a->view(), scene.b->view()});
    const DeviceBatch batch(drawn_of_two(scene.poses, count));
    const DeviceSeparations answers(count);
    const double ms = median_ms([&] {
      separation_batch(solids, batch.pairs(), {}, workspace(count), answers.answers(),
                       stream_.get());
    });
    separations_ = answers.get();
    return ms;
  }

  /// Likewise.
  double median_patches_ms(const Scene& scene, std::size_t count, std::uint32_t most) {
    const GpuSolids solids(std::vector<GpuSolid>{scene.a->view(), scene.b->view()});
    const DeviceBatch batch(drawn_of_two(scene.poses, count));
    const DevicePatches patches(count, most);
    const double ms = median_ms([&] {
      contact_patches_batch(solids, batch.pairs(), Measure::matched, workspace(count),
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

bool measure(Report& report) {
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

  Ground ground;
  const Shape half_space = HalfSpaceShape{}, terrain = ground.terrain(dino4k);
  const auto in_ground = [&](const std::string& name, const Shape& field, double least, double most,
                             double rate) {
    ask("Fields", {name, nullptr, &dino4k, poses_in_ground(dino4k, least, most), rate, 0, &field},
        1e-6, many);
  };
  in_ground("half-space, to 2 % of the height", half_space, 0, 0.02, 50);
  in_ground("half-space, to any depth", half_space, 0, 1, 50);
  in_ground("half-space, above it", half_space, -1, 0, 0);
  in_ground("terrain, to 10 %", terrain, 0, 0.1, 0);
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
  return right;
}

}  // namespace

int main(int argc, char** argv) {
  return ist::benchmark::report_of_gpu(
      "gpu_batch", "Penetrations, separations and contact patches of many pairs on a GPU", argc,
      argv, measure);
}
