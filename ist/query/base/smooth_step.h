#pragma once

// As numerics/host_device.h: the device's code includes this header too.
#ifdef __CUDACC__
#define IST_HD __host__ __device__
#else
#define IST_HD
#endif

namespace ist {

/// From 0 at t ≤ 0 to 1 at t ≥ 1, with no slope at either end.
IST_HD inline double smooth_step(double t) noexcept {
  t = t < 0 ? 0 : t > 1 ? 1 : t;
  return t * t * (3 - 2 * t);
}

}  // namespace ist
