#include "mesh/triangle_boxes.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "mesh/surface_reduction.h"
#include "mesh/usable_mesh.h"
#include "stage/raw_array.h"

namespace ist {
namespace {

using Point = std::array<float, 3>;

constexpr std::uint64_t kLeftOut = UINT64_MAX;
constexpr int kIndexBits = 21;
constexpr float kCells = 1 << 14;  ///< of the curve, along each axis

/// The lowest 21 bits, two zeros after each.
std::uint64_t spread(std::uint64_t x) {
  x = (x | x << 32) & 0x001f00000000ffffu;
  x = (x | x << 16) & 0x001f0000ff0000ffu;
  x = (x | x << 8) & 0x100f00f00f00f00fu;
  x = (x | x << 4) & 0x10c30c30c30c30c3u;
  x = (x | x << 2) & 0x1249249249249249u;
  return x;
}

/// In [0, 1], with the order along each axis kept.
RawArray<Point> placed(const std::vector<Eigen::Vector3d>& vertices) {
  const Eigen::AlignedBox3d bounds = bounds_of(vertices);
  const Eigen::Vector3d corner = bounds.min();
  const double width = bounds.sizes().maxCoeff();
  RawArray<Point> points(vertices.size());
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](const std::size_t v) {
    for (int k = 0; k < 3; ++k)
      points[v][static_cast<std::size_t>(k)] =
          static_cast<float>((vertices[v][k] - corner[k]) / width);
  });
  return points;
}

/// Where a triangle's middle lies along the curve.
std::uint64_t key_of(const RawArray<Point>& points, const Triangle& t) {
  std::uint64_t key = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const float middle = (points[t[0]][k] + points[t[1]][k] + points[t[2]][k]) / 3;
    key |= spread(static_cast<std::uint64_t>(std::min(middle * kCells, kCells - 1))) << k;
  }
  return key;
}

/// Sorts keys that are not left out, by the curve's first cells, then within each.
RawArray<std::uint64_t> sorted(const RawArray<std::uint64_t>& keys) {
  constexpr std::size_t kDrawers = 4096, kChunk = 16'384;
  constexpr int kShift = kIndexBits + 42 - 12;  // of the curve 42 bits, of a drawer 12
  const std::size_t chunks = (keys.size() + kChunk - 1) / kChunk;
  std::vector<std::uint32_t> place(chunks * kDrawers);
  const auto for_each = [&](const auto& visit) {
    tbb::parallel_for(std::size_t{0}, chunks, [&](const std::size_t c) {
      std::uint32_t* const of_chunk = place.data() + c * kDrawers;
      for (std::size_t i = c * kChunk; i < std::min((c + 1) * kChunk, keys.size()); ++i)
        if (keys[i] != kLeftOut) visit(of_chunk[keys[i] >> kShift], keys[i]);
    });
  };
  for_each([](std::uint32_t& count, std::uint64_t) { ++count; });
  std::vector<std::uint32_t> begin(kDrawers + 1);
  for (std::size_t c = 0; c < chunks; ++c)
    for (std::size_t d = 0; d < kDrawers; ++d) begin[d + 1] += place[c * kDrawers + d];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<std::uint32_t> next = begin;
  for (std::size_t c = 0; c < chunks; ++c)
    for (std::size_t d = 0; d < kDrawers; ++d)
      next[d] += std::exchange(place[c * kDrawers + d], next[d]);
  RawArray<std::uint64_t> out(begin.back());
  for_each([&](std::uint32_t& at, const std::uint64_t key) { out[at++] = key; });
  tbb::parallel_for(std::size_t{0}, kDrawers, [&](const std::size_t d) {
    tbb::parallel_sort(out.begin() + begin[d], out.begin() + begin[d + 1]);
  });
  return out;
}

EightBoxes no_boxes() {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  EightBoxes boxes;
  for (std::size_t k = 0; k < 3; ++k) {
    std::fill_n(boxes.lower[k], EightBoxes::kWidth, kFar);
    std::fill_n(boxes.upper[k], EightBoxes::kWidth, -kFar);
  }
  return boxes;
}

/// Blocks of eight: box_of(i, k) gives the lower and the upper bound of box i along axis k.
template <class BoxOf>
std::vector<EightBoxes> in_eights(const std::size_t count, const BoxOf& box_of) {
  std::vector<EightBoxes> blocks((count + 7) / 8);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](const std::size_t b) {
    EightBoxes boxes = no_boxes();
    for (std::size_t i = 8 * b; i < std::min(8 * b + 8, count); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [lower, upper] = box_of(i, k);
        boxes.lower[k][i % 8] = lower;
        boxes.upper[k][i % 8] = upper;
      }
    blocks[b] = boxes;
  });
  return blocks;
}

}  // namespace

TriangleBoxes::TriangleBoxes(const std::vector<Eigen::Vector3d>& vertices,
                             const std::vector<Triangle>& triangles) {
  const RawArray<Point> points = placed(vertices);
  RawArray<std::uint64_t> keys(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](const std::size_t t) {
    keys[t] = is_degenerate(vertices, triangles[t])
                  ? kLeftOut
                  : key_of(points, triangles[t]) << kIndexBits | t;
  });
  keys = sorted(keys);
  order_.resize(keys.size());
  tbb::parallel_for(std::size_t{0}, keys.size(), [&](const std::size_t i) {
    order_[i] = static_cast<std::uint32_t>(keys[i] & ((std::uint64_t{1} << kIndexBits) - 1));
  });

  levels_.push_back(in_eights(order_.size(), [&](const std::size_t i, const std::size_t k) {
    const Triangle& t = triangles[order_[i]];
    return std::minmax({points[t[0]][k], points[t[1]][k], points[t[2]][k]});
  }));
  while (levels_.back().size() > 1) {
    const std::vector<EightBoxes>& below = levels_.back();
    levels_.push_back(in_eights(below.size(), [&](const std::size_t i, const std::size_t k) {
      return std::pair{*std::min_element(below[i].lower[k], below[i].lower[k] + 8),
                       *std::max_element(below[i].upper[k], below[i].upper[k] + 8)};
    }));
  }
  constexpr std::size_t kMostParts = 2048;
  while (levels_[start_].size() > kMostParts) ++start_;
}

}  // namespace ist
