#pragma once

// Functions shared by the CPU and the GPU backend carry IST_HD (docs/design.md 3.3); IST_HD_COLD
// those that hardly ever run and must not cost their callers registers; IST_HD_ONCE those of which
// the device is to have one copy, called: inlined wherever they are used they would overflow its
// instruction cache, which costs more than the calls. IST_ROLLED goes before a short loop, for the
// same reason.
#ifdef __CUDACC__
#define IST_HD __host__ __device__
#define IST_HD_COLD __host__ __device__ __noinline__ inline
#define IST_HD_ONCE __host__ __device__ __noinline__
#else
#define IST_HD
#define IST_HD_COLD [[gnu::noinline]] inline
#define IST_HD_ONCE
#endif

// IST_GPU_OR_HOST(gpu, host): the one on a device, the other on the host.
#ifdef __CUDA_ARCH__
#define IST_GPU_OR_HOST(gpu, host) gpu
#else
#define IST_GPU_OR_HOST(gpu, host) host
#endif

// The device's compiler sees which memory a pointer leads to only where the array itself is in
// sight. This tells it, as a team's memory() does; loads then need no general addressing.
namespace ist {

template <class T>
IST_HD inline T* in_global_memory(T* p) {
#ifdef __CUDA_ARCH__
  __builtin_assume(__isGlobal(p));
#endif
  return p;
}

}  // namespace ist

#ifdef __CUDA_ARCH__  // the host's half of a CUDA compilation does not know the pragma
#define IST_ROLLED _Pragma("unroll 1")
#else
#define IST_ROLLED
#endif
