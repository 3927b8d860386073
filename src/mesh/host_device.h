#pragma once

// Functions shared by the CPU and the GPU backend carry IST_HD (DESIGN 3.3); IST_HD_COLD those that
// hardly ever run and must not cost their callers registers.
#ifdef __CUDACC__
#define IST_HD __host__ __device__
#define IST_HD_COLD __host__ __device__ __noinline__ inline
#else
#define IST_HD
#define IST_HD_COLD [[gnu::noinline]] inline
#endif
