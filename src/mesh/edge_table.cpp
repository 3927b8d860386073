#include "mesh/edge_table.h"

#include <algorithm>

#include <ist/error.h>

namespace ist {

bool has_repeated_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool runs_up(const std::vector<Triangle>& triangles, const std::uint32_t side) {
  const Triangle& t = triangles[side / 3];
  return t[side % 3] < t[(side + 1) % 3];
}

EdgeTable::EdgeTable(const std::vector<Triangle>& triangles) {
  if (triangles.size() > UINT32_MAX / 3) throw Error("more than 2^32 triangle sides");
  struct Entry {
    std::uint32_t high, side;
  };
  // Buckets by the smaller vertex, each sorted by the larger one.
  std::uint32_t vertices = 0;
  for (const Triangle& t : triangles) vertices = std::max({vertices, t[0] + 1, t[1] + 1, t[2] + 1});
  std::vector<std::uint32_t> begin(std::size_t{vertices} + 1, 0);
  const auto for_each_side = [&](const auto& visit) {
    for (std::uint32_t i = 0; i < triangles.size(); ++i) {
      const Triangle& t = triangles[i];
      if (has_repeated_corner(t)) continue;
      for (std::uint32_t k = 0; k < 3; ++k)
        visit(3 * i + k, std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]));
    }
  };
  for_each_side([&](std::uint32_t, const std::uint32_t low, std::uint32_t) { ++begin[low + 1]; });
  for (std::size_t v = 0; v < vertices; ++v) begin[v + 1] += begin[v];
  std::vector<Entry> entries(begin[vertices]);
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for_each_side([&](const std::uint32_t side, const std::uint32_t low, const std::uint32_t high) {
    entries[next[low]++] = {high, side};
  });

  edge_of_side_.assign(3 * triangles.size(), kNoIndex);
  sides_.reserve(entries.size());
  edges_.reserve(entries.size() / 2 + 1);
  for (std::uint32_t low = 0; low < vertices; ++low) {
    std::sort(entries.begin() + begin[low], entries.begin() + begin[low + 1],
              [](const Entry& a, const Entry& b) {
                return a.high != b.high ? a.high < b.high : a.side < b.side;
              });
    for (std::uint32_t i = begin[low]; i < begin[low + 1]; ++i) {
      if (i == begin[low] || entries[i].high != entries[i - 1].high)
        edges_.push_back({low, entries[i].high, i});
      sides_.push_back(entries[i].side);
      edge_of_side_[entries[i].side] = static_cast<std::uint32_t>(edges_.size() - 1);
    }
  }
}

std::span<const std::uint32_t> EdgeTable::sides(const std::size_t edge) const {
  const std::size_t begin = edges_[edge].first_side;
  const std::size_t end = edge + 1 < edges_.size() ? edges_[edge + 1].first_side : sides_.size();
  return {sides_.data() + begin, end - begin};
}

}  // namespace ist
