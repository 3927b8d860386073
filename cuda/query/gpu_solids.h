#pragma once

#include <ist/gpu_query.h>

#include <memory>
#include <span>
#include <vector>

#include "cuda/base/check.h"
#include "cuda/base/queue.h"
#include "cuda/query/field_batch.h"
#include "cuda/query/solid_ref.h"
#include "query/find_solid_box.h"

namespace ist {

namespace gpu {

/// Device memory that outlives the queue it comes from.
class DeviceBytes {
 public:
  DeviceBytes() = default;
  DeviceBytes(Queue& queue, const GpuSettings& settings, std::size_t bytes)
      : data_(static_cast<std::byte*>(queue.allocate(bytes)), {settings, bytes}) {}

  std::byte* data() const { return data_.get(); }
  std::size_t bytes() const { return data_.get_deleter().bytes; }

 private:
  struct Release {
    GpuSettings settings;
    std::size_t bytes;

    void operator()(std::byte* data) const {
      try {
        Queue(settings).deallocate(data, bytes);
      } catch (const Error&) {  // a device that is gone has no memory to give back
      }
    }
  };
  std::unique_ptr<std::byte, Release> data_;
};

template <class T>
void copy_to_device(T* to, std::span<const T> from, Queue& queue) {
  if (from.empty()) return;
  check(cudaMemcpyAsync(to, from.data(), from.size_bytes(), cudaMemcpyHostToDevice, queue.stream()),
        "copying to the GPU");
}

}  // namespace gpu

struct GpuSolids::Impl {
  int device = 0;
  gpu::DeviceBytes memory;
  const gpu::SolidRef* refs = nullptr;
  std::size_t size = 0;
  bool has_fields = false;
  bool has_group[gpu::kFieldGroups] = {};
  bool has_details = false;       ///< some asset has coarser levels
  bool all_meshes = true;         ///< every asset keeps one
  std::uint32_t most_bins = 0;    ///< of a tree's contacts
  std::uint32_t most_blocks = 0;  ///< of a mesh
  std::vector<SolidBox> boxes;    ///< on the host
};

}  // namespace ist
