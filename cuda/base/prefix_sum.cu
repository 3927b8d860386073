#include "cuda/base/device_array.h"

#include <cub/device/device_scan.cuh>

namespace ist::gpu {

void exclusive_sum(Queue& queue, DeviceArray<std::uint32_t>& values) {
  if (values.size() == 0) return;
  std::size_t bytes = 0;
  check(cub::DeviceScan::ExclusiveSum(nullptr, bytes, values.data(), values.data(), values.size(),
                                      queue.stream()),
        "summing up");
  const DeviceArray<char> temporary(queue, bytes);
  check(cub::DeviceScan::ExclusiveSum(temporary.data(), bytes, values.data(), values.data(),
                                      values.size(), queue.stream()),
        "summing up");
}

}  // namespace ist::gpu
