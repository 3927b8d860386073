#!/usr/bin/env bash
# Expected: where lanes read one of sixteen rows each from shared memory, a load of sixteen bytes is cheaper than four loads
# of four. On an H200 (CUDA 13.0) it takes 7.3 cycles of a multiprocessor in rows side by side and 10.5 in rows 96 bytes
# apart; four loads of a word, of arrays of sixteen each, take 4.1 together.
set -euo pipefail
root=$(cd "$(dirname "$0")/.." && pwd)
nvcc=${NVCC:-$root/build-cuda-toolkit/nvidia/cu13/bin/nvcc}  # ./dev setup --cuda
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/rows.cu" <<'END'
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
template <int kStride> __global__ void quads(float* to, int n) {
  __shared__ float4 row[16 * 6];
  for (int i = threadIdx.x; i < 96; i += blockDim.x) row[i] = make_float4(i, i, i, i);
  __syncthreads();
  unsigned x = 7 * (threadIdx.x & 31);
  float s = 0;
  for (int i = 0; i < n; ++i) {
    const float4 v = row[kStride * (x & 15)];
    s += v.x + v.y * v.z + v.w;
    x = x * 1664525u + 1013904223u;
    x ^= x >> 16;
  }
  to[blockIdx.x * blockDim.x + threadIdx.x] = s;
}
__global__ void words(float* to, int n) {
  __shared__ float row[4][16];
  if (threadIdx.x < 64) row[threadIdx.x / 16][threadIdx.x % 16] = threadIdx.x;
  __syncthreads();
  unsigned x = 7 * (threadIdx.x & 31);
  float s = 0;
  for (int i = 0; i < n; ++i) {
    const unsigned k = x & 15;
    s += row[0][k] + row[1][k] * row[2][k] + row[3][k];
    x = x * 1664525u + 1013904223u;
    x ^= x >> 16;
  }
  to[blockIdx.x * blockDim.x + threadIdx.x] = s;
}
int main() {
  cudaDeviceProp card;
  CHECK(cudaGetDeviceProperties(&card, 0));
  int khz = 0;
  CHECK(cudaDeviceGetAttribute(&khz, cudaDevAttrClockRate, 0));
  float* to;
  CHECK(cudaMalloc(&to, 1 << 24));
  const int blocks = 4 * card.multiProcessorCount, n = 20000;
  const auto cycles = [&](float ms) { return ms * khz / (32.0 * n); };
  const double packed = cycles(best_ms([&] { quads<1><<<blocks, 256>>>(to, n); }));
  const double strided = cycles(best_ms([&] { quads<6><<<blocks, 256>>>(to, n); }));
  const double four = cycles(best_ms([&] { words<<<blocks, 256>>>(to, n); }));
  CHECK(cudaGetLastError());
  std::printf("%s: cycles of a multiprocessor for sixteen bytes a lane: rows side by side %.1f, 96 bytes apart %.1f, four words %.1f\n",
              card.name, packed, strided, four);
  return packed > 1.3 * four && strided > 1.8 * four ? 0 : 1;
}
END
"$nvcc" -arch=sm_90 -std=c++17 -o "$folder/run" "$folder/rows.cu"
"$folder/run"
