#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stage/raw_array.h"

namespace ist {

/// For each key from 0 the places at which it stands, ascending.
class IndexLists {
 public:
  IndexLists() = default;
  IndexLists(std::span<const std::uint32_t> key_at, std::size_t keys)
      : first_(keys + 1), place_(key_at.size()) {
    for (const std::uint32_t key : key_at) ++first_[key + 1];
    std::vector<std::uint32_t> next = sum_up();
    for (std::size_t i = 0; i < key_at.size(); ++i)
      place_[next[key_at[i]]++] = static_cast<std::uint32_t>(i);
  }

  /// The same by all threads, for lists that are short.
  static IndexLists of_short_lists(std::span<const std::uint32_t> key_at, std::size_t keys) {
    constexpr auto kRelaxed = std::memory_order_relaxed;
    IndexLists lists;
    lists.first_.resize(keys + 1);
    lists.place_ = RawArray<std::uint32_t>(key_at.size());
    tbb::parallel_for(std::size_t{0}, key_at.size(), [&](std::size_t i) {
      std::atomic_ref(lists.first_[key_at[i] + 1]).fetch_add(1, kRelaxed);
    });
    std::vector<std::uint32_t> next = lists.sum_up();
    tbb::parallel_for(std::size_t{0}, key_at.size(), [&](std::size_t i) {
      lists.place_[std::atomic_ref(next[key_at[i]]).fetch_add(1, kRelaxed)] =
          static_cast<std::uint32_t>(i);
    });
    tbb::parallel_for(std::size_t{0}, keys, [&](std::size_t key) {
      std::sort(lists.place_.begin() + lists.first_[key],
                lists.place_.begin() + lists.first_[key + 1]);
    });
    return lists;
  }

  std::span<const std::uint32_t> operator[](std::size_t key) const {
    return {place_.data() + first_[key], place_.data() + first_[key + 1]};
  }

 private:
  /// From counts to places, one behind: where each list begins.
  std::vector<std::uint32_t> sum_up() {
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    return {first_.begin(), first_.end() - 1};
  }

  std::vector<std::uint32_t> first_;
  RawArray<std::uint32_t> place_;
};

}  // namespace ist
