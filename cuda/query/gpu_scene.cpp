#include <ist/gpu_scene.h>

#include "cuda/query/broad_arrays.h"
#include "cuda/query/gpu_solids.h"
#include "cuda/query/make_broad_scene.h"

namespace ist {

struct GpuScene::Impl {
  int device = 0;
  gpu::DeviceBytes memory;
  gpu::BroadArrays arrays;
  GpuScenePairs pairs;
};

GpuScene::GpuScene(const GpuSolids& solids, std::span<const GpuSceneBody> bodies,
                   const GpuSceneSettings& settings, const GpuSettings& gpu)
    : impl_(new Impl) {
  const gpu::BroadScene scene = gpu::make_broad_scene(solids.impl().boxes, bodies, settings);
  if (solids.device() != gpu.device)
    throw Error("GPU scene: the solids are on device " + std::to_string(solids.device()) +
                ", the scene on " + std::to_string(gpu.device));
  gpu::check_gpu(gpu.device);
  gpu::Queue queue(gpu);
  impl_->device = gpu.device;
  gpu::BroadArrays& arrays = impl_->arrays = scene.arrays;
  arrays.scratch_bytes = gpu::broad_scratch_bytes(arrays);
  gpu::Parts sizes(nullptr);
  gpu::place_broad(sizes, arrays);
  impl_->memory = gpu::DeviceBytes(queue, gpu, sizes.used());
  gpu::Parts parts(impl_->memory.data());
  gpu::place_broad(parts, arrays);
  gpu::copy_to_device<gpu::BroadBody>(const_cast<gpu::BroadBody*>(arrays.bodies), scene.bodies,
                                      queue);
  gpu::copy_to_device<std::uint64_t>(const_cast<std::uint64_t*>(arrays.excluded), scene.excluded,
                                     queue);
  gpu::ready_broad(arrays, queue.stream());
  impl_->pairs = gpu::pairs_of(arrays);
  queue.wait();
}

std::size_t GpuScene::size() const noexcept { return impl_->arrays.count; }
std::size_t GpuScene::bytes() const noexcept { return impl_->memory.bytes(); }
const GpuScenePairs& GpuScene::pairs() const noexcept { return impl_->pairs; }

void GpuScene::find_pairs(const Pose* poses, CUstream_st* stream) {
  const gpu::DeviceGuard guard(impl_->device);
  impl_->arrays.poses = poses;
  gpu::launch_broad(impl_->arrays, stream);
}

}  // namespace ist
