#include "mesh/self_intersections.h"

#include <tbb/concurrent_vector.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>

#include "mesh/surface_reduction.h"

namespace ist {
namespace {

using Box = Eigen::AlignedBox3d;

/// The lowest 21 bits, two zeros after each.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffffu;
  x = (x | x << 16) & 0x001f0000ff0000ffu;
  x = (x | x << 8) & 0x100f00f00f00f00fu;
  x = (x | x << 4) & 0x10c30c30c30c30c3u;
  x = (x | x << 2) & 0x1249249249249249u;
  return x;
}

/// Triangles in the order of a space-filling curve, and the boxes around each 4, 16, 64 … of them.
class BoxPyramid {
 public:
  BoxPyramid(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles) {
    Box bounds;
    for (const Eigen::Vector3d& v : vertices) bounds.extend(v);
    const double width = bounds.sizes().maxCoeff();
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    for (std::uint32_t t = 0; t < triangles.size(); ++t) {
      if (is_degenerate(vertices, triangles[t])) continue;
      std::uint64_t key = 0;
      for (int k = 0; k < 3; ++k) {
        constexpr double kCells = 1 << 21;
        const double offset = (vertices[triangles[t][0]][k] - bounds.min()[k]) / width;
        key |= spread(static_cast<std::uint64_t>(std::min(offset * kCells, kCells - 1))) << k;
      }
      keys.emplace_back(key, t);
    }
    std::sort(keys.begin(), keys.end());
    levels_.emplace_back();
    for (const auto& [key, t] : keys) {
      order_.push_back(t);
      Box box;
      for (const std::uint32_t v : triangles[t]) box.extend(vertices[v]);
      levels_[0].push_back(box);
    }
    while (levels_.back().size() > 1) {
      std::vector<Box> above((levels_.back().size() + 3) / 4);
      for (std::size_t i = 0; i < levels_.back().size(); ++i)
        above[i / 4].extend(levels_.back()[i]);
      levels_.push_back(std::move(above));
    }
  }

  std::size_t size() const { return order_.size(); }
  std::uint32_t triangle(const std::size_t place) const { return order_[place]; }

  /// Calls visit(place) for every triangle after `place` in the order whose box meets its own.
  template <class Visit>
  void for_each_neighbour_after(const std::size_t place, const Visit& visit) const {
    descend(levels_.size() - 1, 0, place, visit);
  }

 private:
  template <class Visit>
  void descend(const std::size_t level, const std::size_t node, const std::size_t place,
               const Visit& visit) const {
    const std::size_t last = ((node + 1) << 2 * level) - 1;  // of the triangles below
    if (last <= place || !levels_[level][node].intersects(levels_[0][place])) return;
    if (level == 0) {
      visit(node);
      return;
    }
    const std::size_t end = std::min(4 * node + 4, levels_[level - 1].size());
    for (std::size_t child = 4 * node; child < end; ++child)
      descend(level - 1, child, place, visit);
  }

  std::vector<std::uint32_t> order_;
  std::vector<std::vector<Box>> levels_;  ///< [0]: of each triangle
};

/// Calls met(i, j) for pairs of triangles that meet elsewhere, from many threads. False: given up.
template <class Met>
bool for_each_pair(const std::vector<Eigen::Vector3d>& vertices,
                   const std::vector<Triangle>& triangles, const Met& met) {
  constexpr std::size_t kMostTriangles = 2'000'000, kMostPairs = 50'000'000;
  if (triangles.size() > kMostTriangles) return false;
  const BoxPyramid pyramid(vertices, triangles);
  // Integers only: their sums do not depend on the order.
  std::atomic<std::size_t> pairs{0};
  tbb::parallel_for(std::size_t{0}, pyramid.size(), [&](const std::size_t place) {
    if (pairs > kMostPairs) return;
    std::size_t pairs_here = 0;
    const std::uint32_t a = pyramid.triangle(place);
    pyramid.for_each_neighbour_after(place, [&](const std::size_t other) {
      ++pairs_here;
      const std::uint32_t b = pyramid.triangle(other);
      if (meet_elsewhere(vertices, triangles[a], triangles[b])) met(a, b);
    });
    pairs += pairs_here;
  });
  return pairs <= kMostPairs;
}

}  // namespace

std::optional<std::size_t> count_self_intersections(const std::vector<Eigen::Vector3d>& vertices,
                                                    const std::vector<Triangle>& triangles) {
  std::atomic<std::size_t> count{0};
  if (!for_each_pair(vertices, triangles, [&](std::uint32_t, std::uint32_t) { ++count; }))
    return std::nullopt;
  return count;
}

std::optional<std::vector<std::array<std::uint32_t, 2>>> find_self_intersections(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles) {
  constexpr std::size_t kMost = 10'000'000;
  tbb::concurrent_vector<std::array<std::uint32_t, 2>> found;
  const auto add = [&](std::uint32_t a, std::uint32_t b) {
    if (found.size() <= kMost) found.push_back({std::min(a, b), std::max(a, b)});
  };
  if (!for_each_pair(vertices, triangles, add) || found.size() > kMost) return std::nullopt;
  std::vector<std::array<std::uint32_t, 2>> pairs(found.begin(), found.end());
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace ist
