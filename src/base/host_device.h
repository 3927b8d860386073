#pragma once

// IST_HD marks functions shared by the CPU and the GPU backend (docs/design.md 3.3). IST_HD_COLD
// marks those that rarely run and must not cost their callers registers. IST_HD_ONCE marks those
// that the device calls instead of inlining: inlined copies would overflow its instruction cache,
// which costs more than the calls. IST_ROLLED keeps a short loop rolled for the same reason.
#ifdef __CUDACC__
#define IST_HD __host__ __device__
#define IST_HD_COLD __host__ __device__ __noinline__ inline
#define IST_HD_ONCE __host__ __device__ __noinline__
#else
#define IST_HD
#define IST_HD_COLD [[gnu::noinline]] inline
#define IST_HD_ONCE
#endif

// IST_GPU_OR_HOST(gpu, host): `gpu` on a device, `host` on the host.
#ifdef __CUDA_ARCH__
#define IST_GPU_OR_HOST(gpu, host) gpu
#else
#define IST_GPU_OR_HOST(gpu, host) host
#endif

// The device's compiler knows the memory space of a pointer only if the array itself is visible.
// This function states it, as a team's memory() does, so that loads need no generic addressing.
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
