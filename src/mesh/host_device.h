#pragma once

// Functions shared by the CPU and the GPU backend carry IST_HD (DESIGN 3.3).
#ifdef __CUDACC__
#define IST_HD __host__ __device__
#else
#define IST_HD
#endif
