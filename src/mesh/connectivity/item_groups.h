#pragma once

#include <tbb/parallel_for.h>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

#include "base/raw_array.h"

namespace ist {

/// Items grouped by a number. Offset must be able to count all items.
template <class Offset = std::uint32_t, class Item = std::uint32_t>
struct ItemGroups {
  std::vector<Offset> first;  ///< index of each group's first item, and the end of the last
  RawArray<Item> items;       ///< each group in order of insertion

  ItemGroups() = default;
  /// `each(visit)` calls visit(group, item) for all items; it is called twice.
  template <class Each>
  ItemGroups(std::size_t groups, const Each& each)
      : ItemGroups(groups, each, [](Offset& count) { return count++; }) {}

  /// The same if `each` calls visit from many threads; each group is sorted.
  template <class Each, class Before = std::less<>>
  static ItemGroups in_parallel(std::size_t groups, const Each& each, const Before& before = {}) {
    ItemGroups made(groups, each, [](Offset& count) {
      return std::atomic_ref<Offset>(count).fetch_add(1, std::memory_order_relaxed);
    });
    tbb::parallel_for(std::size_t{0}, groups, [&](std::size_t group) {
      std::sort(made.items.begin() + made.first[group], made.items.begin() + made.first[group + 1],
                before);
    });
    return made;
  }

  std::size_t size() const { return first.size() - 1; }
  std::span<const Item> operator[](std::size_t group) const {
    return {items.data() + first[group], items.data() + first[group + 1]};
  }

 private:
  template <class Each, class OneMore>
  ItemGroups(std::size_t groups, const Each& each, const OneMore& one_more) : first(groups + 1) {
    each([&](std::size_t group, const Item&) { one_more(first[group + 1]); });
    std::partial_sum(first.begin(), first.end(), first.begin());
    items = RawArray<Item>(first.back());
    std::vector<Offset> next(first.begin(), first.end() - 1);
    each([&](std::size_t group, const Item& item) { items[one_more(next[group])] = item; });
  }
};

/// The triangles at every vertex of a mesh, ascending.
template <class Triangles>
ItemGroups<> triangles_at_vertices(std::size_t vertices, const Triangles& triangles) {
  return ItemGroups<>::in_parallel(vertices, [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
      for (const std::uint32_t v : triangles[t]) visit(v, static_cast<std::uint32_t>(t));
    });
  });
}

}  // namespace ist
