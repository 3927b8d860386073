#include "mesh/edge_table.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>

#include <ist/error.h>

namespace ist {
namespace {

struct Entry {
  Entry() {}  // left as it is, for threads to fill
  Entry(std::uint32_t high_vertex, std::uint32_t of_side) : high(high_vertex), side(of_side) {}
  std::uint32_t high, side;
};

std::uint32_t fetch_and_add_one(std::uint32_t& count) {
  return std::atomic_ref<std::uint32_t>(count).fetch_add(1, std::memory_order_relaxed);
}

/// One more than the largest index; 0 where there are no triangles.
std::uint32_t vertex_count(std::span<const Triangle> triangles) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, triangles.size()), std::uint32_t{0},
      [&](const tbb::blocked_range<std::size_t>& range, std::uint32_t count) {
        for (std::size_t t = range.begin(); t < range.end(); ++t)
          count = std::max(count, *std::max_element(triangles[t].begin(), triangles[t].end()) + 1);
        return count;
      },
      [](const std::uint32_t a, const std::uint32_t b) { return std::max(a, b); });
}

/// Sorts by the larger vertex, then the side: most buckets hold three entries.
void sort_few(Entry* const begin, Entry* const end) {
  constexpr std::ptrdiff_t kFew = 16;
  const auto is_before = [](const Entry& a, const Entry& b) {
    return a.high != b.high ? a.high < b.high : a.side < b.side;
  };
  if (end - begin > kFew) return std::sort(begin, end, is_before);
  for (Entry* at = begin; at < end; ++at) {
    const Entry entry = *at;
    Entry* place = at;
    for (; place > begin && is_before(entry, place[-1]); --place) *place = place[-1];
    *place = entry;
  }
}

/// From counts to places: place[v + 1] becomes the sum of place[1] … place[v + 1].
void sum_up(std::vector<std::uint32_t>& place) {
  for (std::size_t v = 1; v < place.size(); ++v) place[v] += place[v - 1];
}

}  // namespace

bool has_repeated_corner(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool runs_up(const std::vector<Triangle>& triangles, const std::uint32_t side) {
  const Triangle& t = triangles[side / 3];
  return t[side % 3] < t[(side + 1) % 3];
}

EdgeTable::EdgeTable(std::span<const Triangle> triangles) {
  if (triangles.size() > UINT32_MAX / 3) throw Error("more than 2^32 triangle sides");
  // Buckets by the smaller vertex, each sorted by the larger one and the side: in which order the
  // threads fill them does not matter.
  const std::uint32_t vertices = vertex_count(triangles);
  const auto for_each_side = [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, triangles.size(), [&](const std::size_t i) {
      const Triangle& t = triangles[i];
      if (has_repeated_corner(t)) return;
      for (std::size_t k = 0; k < 3; ++k)
        visit(static_cast<std::uint32_t>(3 * i + k), std::min(t[k], t[(k + 1) % 3]),
              std::max(t[k], t[(k + 1) % 3]));
    });
  };
  edge_of_side_ = RawArray<std::uint32_t>(3 * triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](const std::size_t i) {
    if (has_repeated_corner(triangles[i])) std::fill_n(&edge_of_side_[3 * i], 3, kNoIndex);
  });
  std::vector<std::uint32_t> begin(std::size_t{vertices} + 1, 0);
  for_each_side([&](std::uint32_t, const std::uint32_t low, std::uint32_t) {
    fetch_and_add_one(begin[low + 1]);
  });
  sum_up(begin);
  RawArray<Entry> entries(begin[vertices]);
  std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
  for_each_side([&](const std::uint32_t side, const std::uint32_t low, const std::uint32_t high) {
    entries[fetch_and_add_one(next[low])] = {high, side};
  });

  std::vector<std::uint32_t> first_edge(std::size_t{vertices} + 1, 0);
  const auto starts_edge = [&](const std::uint32_t low, const std::uint32_t i) {
    return i == begin[low] || entries[i].high != entries[i - 1].high;
  };
  tbb::parallel_for(std::uint32_t{0}, vertices, [&](const std::uint32_t low) {
    sort_few(entries.begin() + begin[low], entries.begin() + begin[low + 1]);
    for (std::uint32_t i = begin[low]; i < begin[low + 1]; ++i)
      first_edge[low + 1] += starts_edge(low, i) ? 1 : 0;
  });
  sum_up(first_edge);
  edges_ = RawArray<Edge>(first_edge[vertices]);
  sides_ = RawArray<std::uint32_t>(entries.size());
  tbb::parallel_for(std::uint32_t{0}, vertices, [&](const std::uint32_t low) {
    std::uint32_t edge = first_edge[low];
    for (std::uint32_t i = begin[low]; i < begin[low + 1]; ++i) {
      if (starts_edge(low, i)) edges_[edge++] = {low, entries[i].high, i};
      sides_[i] = entries[i].side;
      edge_of_side_[entries[i].side] = edge - 1;
    }
  });
}

std::span<const std::uint32_t> EdgeTable::sides(const std::size_t edge) const {
  const std::size_t begin = edges_[edge].first_side;
  const std::size_t end = edge + 1 < edges_.size() ? edges_[edge + 1].first_side : sides_.size();
  return {sides_.data() + begin, end - begin};
}

}  // namespace ist
