#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ist {

/// For each key from 0 the places at which it stands, ascending.
class IndexLists {
 public:
  IndexLists() = default;
  IndexLists(std::span<const std::uint32_t> key_at, std::size_t keys)
      : first_(keys + 1), place_(key_at.size()) {
    for (const std::uint32_t key : key_at) ++first_[key + 1];
    for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
    std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
    for (std::size_t i = 0; i < key_at.size(); ++i)
      place_[next[key_at[i]]++] = static_cast<std::uint32_t>(i);
  }

  std::span<const std::uint32_t> operator[](std::size_t key) const {
    return {place_.data() + first_[key], place_.data() + first_[key + 1]};
  }

 private:
  std::vector<std::uint32_t> first_, place_;
};

}  // namespace ist
