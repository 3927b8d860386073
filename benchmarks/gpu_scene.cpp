// The broad phase of scenes on a GPU, beside ist::Scene on one core: bodies that all move, and
// small worlds side by side, as learning has them; and with the exact answers of all pairs.
//
// Floor of 100,000 bodies: a pose, what is known of a body and its box are 250 bytes each, read and
// written in 6 us at 4 TB/s; sorting 64-bit keys goes over 12 bytes a body eight times, 5 us and
// eight launches; so launches and dependent steps decide: about twenty, 3 us each in a graph.
#include <cuda_runtime_api.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/gpu_scene.h>
#include <ist/mass_properties.h>

#include "cuda/base/check.h"
#include "gpu_many.h"
#include "mesh/samples/samples.h"
#include "report.h"
#include "support/device_batch.h"
#include "timing.h"

namespace {

using namespace ist;
using benchmark::quantile;
using benchmark::Report;
using testing::OnDevice;

struct Bodies {
  std::vector<GpuSceneBody> bodies;
  std::vector<Pose> poses;
  double side;
  bool is_block = false;
  std::mt19937_64 random{7};

  /// Of size 1, one in ten with a box that meets another's.
  Bodies(std::size_t worlds, std::size_t each, double scale)
      : side(std::cbrt(80.0 * static_cast<double>(each))) {
    std::uniform_real_distribution<double> uniform(0, side);
    for (std::size_t i = 0; i < worlds * each; ++i) {
      GpuSceneBody body;
      body.scale = scale;
      body.world = static_cast<std::uint32_t>(i / each);
      bodies.push_back(body);
      Pose pose;
      for (double& x : pose.t) x = uniform(random);
      poses.push_back(pose);
    }
  }
  /// Or in a block, flush, which a step lifts.
  static Bodies in_block(std::size_t row, double scale) {
    Bodies block(1, row * row * row, scale);
    block.is_block = true;
    for (std::size_t i = 0; i < block.poses.size(); ++i)
      block.poses[i].t[0] = static_cast<double>(i % row),
      block.poses[i].t[1] = static_cast<double>(i / row % row),
      block.poses[i].t[2] = static_cast<double>(i / row / row);
    return block;
  }
  void move() {
    if (is_block) {
      for (Pose& pose : poses) pose.t[2] += 0.125;
      return;
    }
    std::uniform_real_distribution<double> uniform(-0.1, 0.1);
    for (Pose& pose : poses)
      for (double& x : pose.t) x = std::clamp(x + uniform(random), 0.0, side);
  }
};

/// [us] of a graph's work on the device, the median over some steps.
template <class Capture>
double graph_us(Bodies bodies, Pose* poses, const Capture& capture) {
  const testing::Stream stream;
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t ready = nullptr;
  gpu::check(cudaStreamBeginCapture(stream, cudaStreamCaptureModeThreadLocal), "capturing");
  capture(stream);
  gpu::check(cudaStreamEndCapture(stream, &graph), "capturing");
  gpu::check(cudaGraphInstantiate(&ready, graph, 0), "making a graph");
  cudaEvent_t event[2];
  for (cudaEvent_t& e : event) gpu::check(cudaEventCreate(&e), "making an event");
  std::vector<double> all;
  for (int step = 0; step < 21; ++step) {
    bodies.move();
    gpu::check(cudaMemcpy(poses, bodies.poses.data(), bodies.poses.size() * sizeof(Pose),
                          cudaMemcpyHostToDevice),
               "moving");
    gpu::check(cudaEventRecord(event[0], stream), "timing");
    gpu::check(cudaGraphLaunch(ready, stream), "launching");
    gpu::check(cudaEventRecord(event[1], stream), "timing");
    gpu::check(cudaEventSynchronize(event[1]), "timing");
    float ms = 0;
    gpu::check(cudaEventElapsedTime(&ms, event[0], event[1]), "timing");
    if (step > 0) all.push_back(1e3 * static_cast<double>(ms));
  }
  for (cudaEvent_t e : event) cudaEventDestroy(e);
  cudaGraphExecDestroy(ready);
  cudaGraphDestroy(graph);
  return quantile(all, 0.5);
}

/// [us] of a step of ist::Scene's broad phase on one core.
double scene_us(const Asset& asset, Bodies bodies, std::size_t max_pairs) {
  Scene scene({.max_bodies = bodies.poses.size(),
               .max_pairs = max_pairs,
               .patches_per_pair = 1,
               .workspace_capacity = 4096});
  SceneRule rule;
  rule.answer = SceneAnswer::boxes;
  scene.set_rule(0, 0, rule);
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < bodies.poses.size(); ++i) {
    SceneBody body;
    body.number = i;
    body.solid = PlacedSolid(asset.view(), bodies.poses[i], bodies.bodies[i].scale);
    scene.add(body);
    numbers.push_back(i);
  }
  scene.step();
  std::vector<double> us;
  for (int step = 0; step < 7; ++step) {
    bodies.move();
    const double start = benchmark::thread_seconds();
    scene.set_poses(numbers, bodies.poses);
    scene.step();
    us.push_back(1e6 * (benchmark::thread_seconds() - start));
  }
  return quantile(us, 0.5);
}

bool measure(Report& report) {
  report.remark(
      "Balls of size 1, each moved by up to 0.1 along each axis in a step; "
      "one body in ten has a box that meets another's. In the block all boxes are flush, and it is "
      "lifted. Poses are on the device; a graph is "
      "launched, its work timed by events, median of 20 steps. With answers: the exact penetration "
      "of each pair follows in the same graph. Scene is ist::Scene's broad phase on one core of "
      "the "
      "same machine; it has no worlds, so one world stands for all.");
  const Asset ball = bake_mesh_only(close_mesh(make_sample("sphere"), "sphere"));
  const Bounds own = bounds(ball.view());
  const double scale = 1 / (own.upper - own.lower).maxCoeff();
  const std::vector<GpuSolid> views = {ball.view()};
  const GpuSolids solids(views);
  struct Case {
    const char* name;
    Bodies bodies, as_one_world;
    double target = 0;  ///< [us]
  };
  const auto spread = [&](std::size_t worlds, std::size_t each) {
    return Bodies(worlds, each, scale);
  };
  const Bodies block = Bodies::in_block(22, scale);
  const Case cases[] = {
      {"10,000 bodies", spread(1, 10'000), spread(1, 10'000)},
      {"100,000 bodies", spread(1, 100'000), spread(1, 100'000), 300},
      {"1,000,000 bodies", spread(1, 1'000'000), spread(1, 1'000'000)},
      {"4,096 worlds of 32 bodies", spread(4'096, 32), spread(1, 4'096 * 32), 500},
      {"10,648 in a block, flush", block, block}};
  for (const Case& one : cases) {
    const Bodies& bodies = one.bodies;
    GpuSceneSettings settings;
    settings.max_pairs = (bodies.is_block ? 14 : 1) * bodies.poses.size();
    settings.measure = Measure::exact;
    GpuScene scene(solids, bodies.bodies, settings);
    GpuWorkspace workspace(settings.max_pairs);
    const OnDevice<Pose> poses(bodies.poses);
    const OnDevice<double> volume(settings.max_pairs);
    const OnDevice<QueryStatus> status(settings.max_pairs);
    GpuPenetrations answers;
    answers.volume = volume.data();
    answers.status = status.data();
    const double pairs_us = graph_us(
        bodies, poses.data(), [&](cudaStream_t stream) { scene.find_pairs(poses.data(), stream); });
    const double all_us = graph_us(bodies, poses.data(), [&](cudaStream_t stream) {
      scene.find_pairs(poses.data(), stream);
      penetration_batch(solids, scene.pairs().pairs, {Measure::exact}, workspace, answers, stream);
    });
    std::uint32_t found = 0;
    gpu::check(cudaMemcpy(&found, scene.pairs().count, sizeof found, cudaMemcpyDeviceToHost),
               "copying from the GPU");
    Report::Json line = {{"case", one.name},
                         {"pairs", found},
                         {"boxes and pairs us", pairs_us},
                         {"with answers us", all_us},
                         {"MB", static_cast<double>(scene.bytes()) / 1e6}};
    line["Scene us"] = scene_us(ball, one.as_one_world, settings.max_pairs);
    report.row("Steps", line);
    if (one.target > 0) report.target(std::string(one.name) + ", us", pairs_us, one.target, true);
  }
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  return ist::benchmark::report_of_gpu("gpu_scene", "Broad phases on a GPU", argc, argv, measure);
}
