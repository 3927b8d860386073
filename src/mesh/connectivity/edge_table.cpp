#include "mesh/connectivity/edge_table.h"

#include <ist/types.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <numeric>

#include "mesh/connectivity/item_groups.h"

namespace ist {
namespace {

/// A side stored at its smaller vertex: the larger vertex, and below it the side.
using Entry = std::uint64_t;

std::uint32_t high_of(const Entry entry) { return static_cast<std::uint32_t>(entry >> 32); }
std::uint32_t side_of(const Entry entry) { return static_cast<std::uint32_t>(entry); }

/// The largest index plus one; 0 without triangles.
std::uint32_t vertex_count(std::span<const Triangle> triangles) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, triangles.size()), std::uint32_t{0},
      [&](const tbb::blocked_range<std::size_t>& range, std::uint32_t count) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          count = std::max(count, *std::max_element(triangles[t].begin(), triangles[t].end()) + 1);
        return count;
      },
      [](std::uint32_t a, std::uint32_t b) { return std::max(a, b); });
}

}  // namespace

bool has_repeated_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool runs_up(const std::vector<Triangle>& triangles, std::uint32_t side) {
  const Triangle& t = triangles[side / 3];
  return t[side % 3] < t[(side + 1) % 3];
}

EdgeTable::EdgeTable(std::span<const Triangle> triangles) {
  if (triangles.size() > UINT32_MAX / 3) throw Error("more than 2^32 triangle sides");
  edge_of_side_ = RawArray<std::uint32_t>(3 * triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t i) {
    if (has_repeated_corner(triangles[i])) std::fill_n(&edge_of_side_[3 * i], 3, kNoIndex);
  });
  const std::uint32_t vertices = vertex_count(triangles);
  const auto at = ItemGroups<std::uint32_t, Entry>::in_parallel(vertices, [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t i) {
      const Triangle& t = triangles[i];
      if (has_repeated_corner(t)) return;
      for (std::size_t k = 0; k < 3; ++k)
        visit(std::min(t[k], t[(k + 1) % 3]),
              Entry{std::max(t[k], t[(k + 1) % 3])} << 32 | (3 * i + k));
    });
  });
  std::vector<std::uint32_t> first_edge(std::size_t{vertices} + 1, 0);
  const auto starts_edge = [&](std::uint32_t low, std::uint32_t i) {
    return i == at.first[low] || high_of(at.items[i]) != high_of(at.items[i - 1]);
  };
  tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t low) {
    for (std::uint32_t i = at.first[low]; i < at.first[low + 1]; ++i)
      first_edge[low + 1] += starts_edge(low, i) ? 1 : 0;
  });
  std::partial_sum(first_edge.begin(), first_edge.end(), first_edge.begin());
  edges_ = RawArray<Edge>(first_edge[vertices]);
  sides_ = RawArray<std::uint32_t>(at.items.size());
  tbb::parallel_for(std::uint32_t{0}, vertices, [&](std::uint32_t low) {
    std::uint32_t edge = first_edge[low];
    for (std::uint32_t i = at.first[low]; i < at.first[low + 1]; ++i) {
      if (starts_edge(low, i)) edges_[edge++] = {low, high_of(at.items[i]), i};
      sides_[i] = side_of(at.items[i]);
      edge_of_side_[sides_[i]] = edge - 1;
    }
  });
}

std::span<const std::uint32_t> EdgeTable::sides(std::size_t edge) const {
  const std::size_t begin = edges_[edge].first_side;
  const std::size_t end = edge + 1 < edges_.size() ? edges_[edge + 1].first_side : sides_.size();
  return {sides_.data() + begin, end - begin};
}

}  // namespace ist
