#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ist {

/// Numbers cells in the order in which they are first asked for.
class CellNumbers {
 public:
  using Cell = std::array<std::int32_t, 3>;

  std::uint32_t of(const Cell& cell) {
    if (2 * (std::size_t{count_} + 1) > slots_.size()) grow();
    Slot& slot = slots_[place(cell)];
    if (slot.number == kNone) slot = {cell, count_++};
    return slot.number;
  }
  std::uint32_t count() const { return count_; }

 private:
  static constexpr std::uint32_t kNone = ~0u;
  struct Slot {
    Cell cell;
    std::uint32_t number = kNone;
  };

  /// Where the cell is or goes.
  std::size_t place(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int32_t x : cell)
      hash = (hash ^ static_cast<std::uint32_t>(x)) * 0x9E3779B97F4A7C15u;
    const std::size_t mask = slots_.size() - 1;
    std::size_t at = (hash ^ hash >> 32) & mask;
    while (slots_[at].number != kNone && slots_[at].cell != cell) at = (at + 1) & mask;
    return at;
  }

  void grow() {
    std::vector<Slot> old(std::max<std::size_t>(1024, 4 * slots_.size()));
    old.swap(slots_);
    for (const Slot& slot : old)
      if (slot.number != kNone) slots_[place(slot.cell)] = slot;
  }

  std::vector<Slot> slots_;
  std::uint32_t count_ = 0;
};

}  // namespace ist
