#pragma once

#include <cuda_runtime_api.h>

#include <cstdio>
#include <deque>
#include <exception>
#include <map>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <ist/gpu_query.h>

#include "cuda/base/check.h"
#include "gpu_batch_scenes.h"
#include "report.h"
#include "support/mated_rows.h"
#include "timing.h"

// What programs that ask a GPU about many pairs begin with.

namespace ist::benchmark {

/// [ms] of the device's work, the median of some.
template <class Work>
double device_ms(const Work& work) {
  cudaStream_t stream = nullptr;
  cudaEvent_t event[2];
  gpu::check(cudaStreamCreate(&stream), "making a stream");
  for (cudaEvent_t& e : event) gpu::check(cudaEventCreate(&e), "making an event");
  work(stream);
  std::vector<double> all;
  for (int k = 0; k < 5; ++k) {
    gpu::check(cudaEventRecord(event[0], stream), "timing");
    work(stream);
    gpu::check(cudaEventRecord(event[1], stream), "timing");
    gpu::check(cudaEventSynchronize(event[1]), "timing");
    float ms = 0;
    gpu::check(cudaEventElapsedTime(&ms, event[0], event[1]), "timing");
    all.push_back(static_cast<double>(ms));
  }
  for (cudaEvent_t e : event) cudaEventDestroy(e);
  cudaStreamDestroy(stream);
  return benchmark::quantile(all, 0.5);
}

/// [M/s] of all cores: ask(workspaces) answers `count` pairs; the best of some rounds.
template <class Ask>
double rate_of_cores(std::size_t count, int rounds, const Ask& ask) {
  std::vector<Workspace> workspaces(std::thread::hardware_concurrency());
  double best = 1e30;
  for (int k = 0; k < rounds; ++k) {
    const double start = wall_seconds();
    ask(std::span(workspaces));
    best = std::min(best, wall_seconds() - start);
  }
  return static_cast<double>(count) / best * 1e-6;
}

struct Solids {
  std::vector<const Asset*> assets;

  std::vector<PlacedPair> placed(const std::vector<BatchPair>& pairs) const {
    std::vector<PlacedPair> out;
    for (const BatchPair& pair : pairs)
      out.push_back({{assets[pair.a]->view(), pair.pose_a, pair.scale_a},
                     {assets[pair.b]->view(), pair.pose_b, pair.scale_b}});
    return out;
  }
  std::vector<GpuSolid> views() const {
    std::vector<GpuSolid> out;
    for (const Asset* asset : assets) out.emplace_back(asset->view());
    return out;
  }
};

/// The oracle's mated parts and their poses.
struct MatedParts {
  Solids solids;
  std::map<std::string, std::vector<BatchPair>> mates;  ///< by their name

  /// `bake(mesh, name)` makes an asset; `name_of(row)` names a mate.
  template <class Bake, class NameOf>
  MatedParts(const Bake& bake, const NameOf& name_of) {
    const auto number = [&](const std::string& mesh) {
      const auto [known, fresh] =
          numbers_.try_emplace(mesh, static_cast<std::uint32_t>(parts_.size()));
      if (fresh)
        solids.assets.push_back(
            &parts_.emplace_back(bake(load_mesh(testing::mated_mesh_path(mesh)), mesh)));
      return known->second;
    };
    for (const testing::MatedRow& row : testing::read_mated_rows()) {
      BatchPair pair;
      pair.a = number(row.mesh_a);
      pair.b = number(row.mesh_b);
      pair.pose_b = row.pose;
      mates[name_of(row)].push_back(pair);
    }
  }

 private:
  std::map<std::string, std::uint32_t> numbers_;
  std::deque<Asset> parts_;
};

/// main() of such a program: measure(report) says whether all answers are the CPU's.
template <class Measure>
int report_of_gpu(const char* name, const char* title, int argc, char** argv,
                  const Measure& measure) {
  Report report(name, argc, argv);
  report.page(title);
  std::string why;
  if (!gpu_available(0, &why)) {
    std::fprintf(stderr, "%s: %s\n", name, why.c_str());
    return 1;
  }
  try {
    const bool right = measure(report);
    const int written = report.write();
    if (right) return written;
    std::fprintf(stderr, "%s: answers differ from the CPU's\n", name);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", name, error.what());
  }
  return 1;
}

}  // namespace ist::benchmark
