#pragma once

#include <cstdint>

#include "cuda/base/device_array.h"

namespace ist::gpu {

/// Replaces every element by the sum of those before it.
void exclusive_sum(Queue& queue, DeviceArray<std::uint32_t>& values);

}  // namespace ist::gpu
