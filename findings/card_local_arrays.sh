#!/usr/bin/env bash
# Expected: an array of eight floats that a lane indexes by a variable is nearly as fast in local memory as in shared, since
# both are in the first cache. On an H200 (CUDA 13.0), with all 64 warps, an access of it takes 15 times as long.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
nvcc=${NVCC:-$root/build-cuda-toolkit/nvidia/cu13/bin/nvcc}  # ./dev setup --cuda
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/arrays.cu" <<'END'
#include <cstdio>
#include <algorithm>
#define CHECK(x) do { if (cudaError_t e = (x); e != cudaSuccess) { std::printf("%s: %s\n", #x, cudaGetErrorString(e)); return 2; } } while (0)
template <class Work> float best_ms(const Work& work) {
  cudaEvent_t from, to;
  cudaEventCreate(&from), cudaEventCreate(&to);
  float best = 1e9f;
  for (int k = 0; k < 6; ++k) {
    float ms = 0;
    cudaEventRecord(from), work(), cudaEventRecord(to), cudaEventSynchronize(to);
    cudaEventElapsedTime(&ms, from, to);
    if (k > 0) best = std::min(best, ms);
  }
  return best;
}
template <bool kShared> __global__ void sum(float* to, int n) {
  float own[8];
  __shared__ float shared[8][256];
  for (int i = 0; i < 8; ++i) own[i] = shared[i][threadIdx.x] = to[i];
  unsigned x = threadIdx.x;
  float s = 0;
  for (int i = 0; i < n; ++i) {
    const unsigned k = x & 7;
    float& from = kShared ? shared[k][threadIdx.x] : own[k];
    float& into = kShared ? shared[(k + 3) & 7][threadIdx.x] : own[(k + 3) & 7];
    s += from;
    into = s;
    x = x * 1664525u + 1013904223u;
    x ^= x >> 16;
  }
  to[blockIdx.x * blockDim.x + threadIdx.x] = s;
}
int main() {
  cudaDeviceProp card;
  CHECK(cudaGetDeviceProperties(&card, 0));
  float* to;
  CHECK(cudaMalloc(&to, 1 << 24));
  CHECK(cudaMemset(to, 0, 1 << 24));
  const int blocks = 8 * card.multiProcessorCount, n = 20000;
  const float local = best_ms([&] { sum<false><<<blocks, 256>>>(to, n); });
  const float shared = best_ms([&] { sum<true><<<blocks, 256>>>(to, n); });
  CHECK(cudaGetLastError());
  std::printf("%s: local %.2f ms, shared %.2f ms, %.1f times\n", card.name, local, shared, local / shared);
  return local > 4 * shared ? 0 : 1;
}
END
"$nvcc" -arch=sm_90 -std=c++17 -o "$folder/run" "$folder/arrays.cu"
"$folder/run"
