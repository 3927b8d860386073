#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace ist {

/// Items by their groups. Offset: counts all items.
template <class Offset = std::uint32_t>
struct ItemGroups {
  std::vector<Offset> first;         ///< of each group's items, and of none behind them
  std::vector<std::uint32_t> items;  ///< those of a group in the order in which they came

  ItemGroups() = default;
  /// `each(visit)` calls visit(group, item) for all items; it is called twice.
  template <class Each>
  ItemGroups(std::size_t groups, const Each& each) : first(groups + 1) {
    each([&](std::size_t group, std::uint32_t) { ++first[group + 1]; });
    std::partial_sum(first.begin(), first.end(), first.begin());
    items.resize(first.back());
    std::vector<Offset> next(first.begin(), first.end() - 1);
    each([&](std::size_t group, std::uint32_t item) { items[next[group]++] = item; });
  }

  std::span<const std::uint32_t> operator[](std::size_t group) const {
    return {items.data() + first[group], items.data() + first[group + 1]};
  }
};

/// The triangles at every vertex of a mesh.
template <class Mesh>
ItemGroups<> triangles_at_vertices(const Mesh& mesh) {
  return {mesh.vertices.size(), [&](const auto& visit) {
            for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
              for (const std::uint32_t v : mesh.triangles[t]) visit(v, t);
          }};
}

}  // namespace ist
