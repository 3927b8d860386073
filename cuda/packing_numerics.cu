// The packing's shared numerics, instantiated for the device: what is not fit for it (a call into
// the C library, a host-only type) breaks this build and not the GPU backend's.
#include "packing/linear_program.h"
#include "packing/roots.h"

namespace ist::packing {

/// Bounds the clearance in the cube of half-edge `half_edge` around each of `count` points, against
/// the same balls {x, y, z, radius}; one thread a point, at most kMostBalls balls.
__global__ void bound_clearances(const Float3* points, int count, const float4* balls,
                                 int ball_count, float half_edge, ClearanceOptimum* optima,
                                 double* levels) {
  constexpr int kMostBalls = 64;
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i >= count || ball_count > kMostBalls) return;
  Constraint constraints[kMostBalls];
  for (int k = 0; k < ball_count; ++k)
    constraints[k] = ball_constraint({balls[k].x, balls[k].y, balls[k].z}, balls[k].w, points[i]);
  optima[i] = maximise_clearance(constraints, ball_count, half_edge, 3 * half_edge * half_edge);
  levels[i] = power_three_eighths(optima[i].value < 0 ? 0.0 : optima[i].value);
}

}  // namespace ist::packing
