#pragma once

#include <cuda_runtime_api.h>

namespace ist::gpu {

/// Success if this build holds code for the current device. Makes the device's context.
cudaError_t find_device_code();

}  // namespace ist::gpu
