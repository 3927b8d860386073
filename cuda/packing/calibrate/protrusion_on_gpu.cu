#include "cuda/packing/calibrate/on_gpu.h"

#include "cuda/base/device_array.h"
#include "cuda/base/launch.h"
#include "cuda/base/warp_team.h"
#include "mesh/hierarchy/wide_rays.h"
#include "packing/calibrate/protrusion.h"

namespace ist::gpu {
namespace {

constexpr unsigned kWarps = 4;
constexpr unsigned kThreads = 32 * kWarps;
constexpr double kAnywhere = 1e30;  // beyond any distance, unit frame

/// A warp a ball.
__global__ void __launch_bounds__(kThreads)
    find_protrusion(WideTree tree, const Sphere* balls, std::uint32_t count,
                    unsigned long long* largest) {
  const std::uint32_t k = blockIdx.x * kWarps + threadIdx.x / 32;
  if (k >= count) return;
  const WarpTeam team;
  const double centre[3] = {balls[k].x, balls[k].y, balls[k].z};
  const double distance = exact_nearest(team, tree, centre, kAnywhere).distance;
  const double out = protrusion_of(balls[k].r, distance, inside(team, tree, centre));
  if (team.lane() == 0 && out > 0)  // positive doubles order as their bits
    atomicMax(largest, static_cast<unsigned long long>(__double_as_longlong(out)));
}

}  // namespace

double largest_protrusion(Queue& queue, const WideTree& mesh, std::span<const Sphere> balls) {
  const auto count = static_cast<std::uint32_t>(balls.size());
  DeviceArray<Sphere> on_device(queue, count);
  on_device.upload(balls);
  DeviceArray<double> largest(queue, 1);
  largest.fill_bytes(0);
  find_protrusion<<<blocks_for(count, kWarps), kThreads, 0, queue.stream()>>>(
      mesh, on_device.data(), count, reinterpret_cast<unsigned long long*>(largest.data()));
  check_launch("measuring protrusions");
  return largest.at(0);
}

}  // namespace ist::gpu
