#include "cuda/radix_sort.h"

#include <cub/device/device_radix_sort.cuh>

#include <utility>

namespace ist::gpu {

void sort_pairs(Queue& queue, DeviceArray<std::uint32_t>& keys, DeviceArray<std::uint32_t>& values,
                int bits) {
  const auto count = static_cast<int>(keys.size());
  DeviceArray<std::uint32_t> other_keys(queue, keys.size());
  DeviceArray<std::uint32_t> other_values(queue, values.size());
  cub::DoubleBuffer<std::uint32_t> key_buffers(keys.data(), other_keys.data());
  cub::DoubleBuffer<std::uint32_t> value_buffers(values.data(), other_values.data());
  std::size_t bytes = 0;
  check(cub::DeviceRadixSort::SortPairs(nullptr, bytes, key_buffers, value_buffers, count, 0, bits,
                                        queue.stream()),
        "preparing a sort");
  DeviceArray<std::byte> scratch(queue, bytes);
  check(cub::DeviceRadixSort::SortPairs(scratch.data(), bytes, key_buffers, value_buffers, count, 0,
                                        bits, queue.stream()),
        "sorting");
  if (key_buffers.Current() != keys.data()) std::swap(keys, other_keys);
  if (value_buffers.Current() != values.data()) std::swap(values, other_values);
}

}  // namespace ist::gpu
