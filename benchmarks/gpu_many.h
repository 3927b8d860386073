#pragma once

#include <cuda_runtime_api.h>

#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <ist/gpu_query.h>

#include "cuda/base/check.h"
#include "report.h"
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

struct Solids {
  std::vector<const Asset*> assets;
  std::vector<GpuSolid> views() const {
    std::vector<GpuSolid> out;
    for (const Asset* asset : assets) out.emplace_back(asset->view());
    return out;
  }
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
