#include <ist/gpu_fields.h>

#include <ist/error.h>

#include <vector>

#include "cuda/check.h"
#include "cuda/query/make_field_ref.h"
#include "cuda/query/query_impl.h"
#include "cuda/queue.h"

namespace ist {

struct GpuFields::Impl {
  int device = 0;
  gpu::DeviceBytes memory;
  const gpu::FieldRef* refs = nullptr;
  std::size_t size = 0;
  bool has_group[gpu::kFieldGroups] = {};
};

GpuFields::GpuFields(std::span<const Field> fields, const GpuSettings& settings)
    : impl_(std::make_unique<Impl>()) {
  gpu_info(settings.device);  // throws where there is no such device
  gpu::Queue queue(settings);
  const auto place = [&](std::byte* from, std::vector<gpu::FieldRef>* refs) {
    gpu::Parts parts(from);
    parts.take<gpu::FieldRef>(fields.size());
    for (const Field& field : fields) {
      const std::span<const std::byte> data = gpu::pointed_to(field);
      auto* const at = parts.take<std::byte>(data.size());
      if (refs == nullptr) continue;
      gpu::copy_to_device<std::byte>(at, data, queue);
      refs->push_back(gpu::field_ref(field, at));
    }
    return parts.used();
  };
  impl_->device = settings.device;
  impl_->size = fields.size();
  impl_->memory = gpu::DeviceBytes(queue, settings, place(nullptr, nullptr));
  std::vector<gpu::FieldRef> refs;
  place(impl_->memory.data(), &refs);
  auto* const at = reinterpret_cast<gpu::FieldRef*>(impl_->memory.data());
  gpu::copy_to_device<gpu::FieldRef>(at, refs, queue);
  impl_->refs = at;
  for (const gpu::FieldRef& field : refs) impl_->has_group[gpu::group_of(field.kind)] = true;
  queue.wait();
}

GpuFields::~GpuFields() = default;
GpuFields::GpuFields(GpuFields&&) noexcept = default;
GpuFields& GpuFields::operator=(GpuFields&&) noexcept = default;

std::size_t GpuFields::size() const noexcept { return impl_->size; }
std::size_t GpuFields::bytes() const noexcept { return impl_->memory.bytes(); }
int GpuFields::device() const noexcept { return impl_->device; }

void penetration_batch(const GpuAssets& assets, const GpuFields& fields, const GpuPairs& pairs,
                       Measure measure, GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream) {
  const GpuAssets::Impl& trees = assets.impl();
  const GpuFields::Impl& solids = fields.impl();
  const GpuWorkspace::Impl& room = workspace.impl();
  gpu::check_measure(measure);
  gpu::check_batch(pairs, room, trees.device);
  if (solids.device != trees.device)
    throw Error("GPU: the assets are on device " + std::to_string(trees.device) +
                ", the fields on " + std::to_string(solids.device));
  if (pairs.count == 0) return;
  const gpu::FieldBatch batch = {solids.refs,
                                 static_cast<std::uint32_t>(solids.size),
                                 trees.refs,
                                 static_cast<std::uint32_t>(trees.size),
                                 measure,
                                 pairs,
                                 answers,
                                 room.field_counters,
                                 {room.arrays.list, room.arrays.detailed},
                                 room.triangle_room};
  const gpu::DeviceGuard guard(trees.device);
  gpu::launch_field_batch(batch, solids.has_group, room.field_grids, stream);
}

}  // namespace ist
