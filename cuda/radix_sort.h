#pragma once

#include <cstdint>

#include "cuda/device_array.h"

namespace ist::gpu {

/// Sorts pairs by the lowest `bits` bits of their keys, ascending; equal keys keep their order. The
/// arrays are of the same size and come back sorted; in between twice their memory is in use.
void sort_pairs(Queue& queue, DeviceArray<std::uint32_t>& keys, DeviceArray<std::uint32_t>& values,
                int bits);

}  // namespace ist::gpu
