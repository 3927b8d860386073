#pragma once

#include <cstddef>

#include <ist/gpu_query.h>

#include "cuda/query/batch_kernels.h"
#include "cuda/query/device_bytes.h"
#include "cuda/query/field_kernels.h"
#include "cuda/query/patch_kernels.h"
#include "cuda/query/separation_kernels.h"

// What the classes of ist/gpu_query.h hold.

namespace ist {

struct GpuSolids::Impl {
  int device = 0;
  gpu::DeviceBytes memory;
  const gpu::SolidRef* refs = nullptr;
  std::size_t size = 0;
  bool has_fields = false;
  bool has_group[gpu::kFieldGroups] = {};
  bool has_details = false;     ///< some asset has coarser levels
  std::uint32_t most_bins = 0;  ///< of a tree's contacts
};

struct GpuWorkspace::Impl {
  int device = 0;
  std::size_t most_pairs = 0;
  gpu::BatchGrids grids{};
  gpu::SeparationGrids separation_grids{};
  gpu::FieldGrids field_grids{};
  int patch_blocks = 0;
  gpu::DeviceBytes memory;
  // What does not change from batch to batch; all kinds lie in the same memory.
  gpu::BatchArrays arrays{};
  gpu::SeparationArrays separations{};
  gpu::PatchArrays patches{};
  std::size_t patch_room = 0;  ///< [bytes] at patches.rooms
  gpu::FieldCounters* field_counters = nullptr;
  gpu::TriangleRoom triangle_room{};
};

}  // namespace ist
