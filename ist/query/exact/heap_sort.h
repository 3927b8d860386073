#pragma once

#include <cstdint>

#include "base/host_device.h"

namespace ist {

/// Sorts on the host and on a GPU, in place.
template <class T, class Less>
IST_HD void heap_sort(T* items, std::uint32_t count, const Less& less) {
  const auto sink = [&](std::uint32_t at, std::uint32_t end) {
    const T item = items[at];
    for (std::uint32_t child = 2 * at + 1; child < end; child = 2 * at + 1) {
      if (child + 1 < end && less(items[child], items[child + 1])) ++child;
      if (!less(item, items[child])) break;
      items[at] = items[child];
      at = child;
    }
    items[at] = item;
  };
  for (std::uint32_t k = count / 2; k > 0; --k) sink(k - 1, count);
  for (std::uint32_t end = count; end > 1; --end) {
    const T last = items[end - 1];
    items[end - 1] = items[0];
    items[0] = last;
    sink(0, end - 1);
  }
}

}  // namespace ist
