#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include "mesh/bvh.h"
#include "mesh/triangle_frame.h"
#include "numerics/rounding.h"

namespace ist {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kBins = 16;
constexpr std::uint32_t kParallelSize = 8192;
/// Below this depth ranges are halved, whatever it costs: traversal stacks are of fixed size.
constexpr int kHeuristicDepth = 40;

struct Box {
  float lower[3] = {kInfinity, kInfinity, kInfinity};
  float upper[3] = {-kInfinity, -kInfinity, -kInfinity};

  void extend(const Box& other) {
    for (int k = 0; k < 3; ++k) {
      lower[k] = std::min(lower[k], other.lower[k]);
      upper[k] = std::max(upper[k], other.upper[k]);
    }
  }
  float centre2(int k) const { return lower[k] + upper[k]; }  // twice the centre
  float half_area() const {
    const float x = upper[0] - lower[0], y = upper[1] - lower[1], z = upper[2] - lower[2];
    return x < 0 ? 0 : x * y + y * z + z * x;
  }
};

/// A triangle on its way to a leaf.
struct Reference {
  Box box;
  std::uint32_t triangle;
};

/// The binary tree before its nodes are gathered into wide ones. A subtree of n triangles takes
/// places [i, i + 2n − 1), so that threads build halves into one array with no order among them.
struct BinaryNode {
  Box box;
  std::uint32_t first = 0, count = 0;  ///< references of the subtree
  std::uint32_t right = 0;             ///< the left child is the next node; 0: leaf
};

class Builder {
 public:
  Builder(const std::vector<double>& vertices, const std::vector<std::uint32_t>& triangles)
      : vertices_(vertices), triangles_(triangles) {}

  Bvh build() {
    const auto count = static_cast<std::uint32_t>(triangles_.size() / 3);
    Bvh bvh;
    if (count == 0) return bvh;
    references_.resize(count);
    tbb::parallel_for(std::uint32_t{0}, count, [&](std::uint32_t t) {
      references_[t] = {triangle_box(t), t};
    });
    binary_.resize(2 * std::size_t{count} - 1);
    split(0, 0, count, 0);
    bvh.root = gather(0, bvh);
    references_ = {};
    binary_ = {};
    tbb::parallel_for(std::size_t{0}, bvh.blocks.size(),
                      [&](std::size_t i) { fill(bvh.blocks[i]); });
    return bvh;
  }

 private:
  const double* corner(std::uint32_t triangle, int i) const {
    return &vertices_[3 * std::size_t{triangles_[3 * std::size_t{triangle} + std::size_t(i)]}];
  }

  Box triangle_box(std::uint32_t triangle) const {
    Box box;
    for (int i = 0; i < 3; ++i) {
      const double* p = corner(triangle, i);
      for (int k = 0; k < 3; ++k) {
        box.lower[k] = std::min(box.lower[k], rounded_down(p[k]));
        box.upper[k] = std::max(box.upper[k], rounded_up(p[k]));
      }
    }
    return box;
  }

  void split(std::uint32_t at, std::uint32_t first, std::uint32_t count, int depth) {
    BinaryNode& node = binary_[at];
    node.first = first;
    node.count = count;
    Box centres;
    for (std::uint32_t i = first; i < first + count; ++i) {
      const Box& box = references_[i].box;
      node.box.extend(box);
      for (int k = 0; k < 3; ++k) {
        centres.lower[k] = std::min(centres.lower[k], box.centre2(k));
        centres.upper[k] = std::max(centres.upper[k], box.centre2(k));
      }
    }
    if (count <= kBvhWidth) return;
    const std::uint32_t left =
        depth < kHeuristicDepth ? partition(first, count, centres) : count / 2;
    node.right = at + 2 * left;
    const auto left_half = [=, this] { split(at + 1, first, left, depth + 1); };
    const auto right_half = [=, this] {
      split(at + 2 * left, first + left, count - left, depth + 1);
    };
    if (count > kParallelSize) {
      tbb::parallel_invoke(left_half, right_half);
    } else {
      left_half();
      right_half();
    }
  }

  /// Splits the range where the binned surface area heuristic is least; returns the left count.
  std::uint32_t partition(std::uint32_t first, std::uint32_t count, const Box& centres) {
    struct Bin {
      Box box;
      std::uint32_t count = 0;
    };
    float best_cost = kInfinity;
    int best_axis = -1, best_bin = 0;
    const auto begin = references_.begin() + first, end = begin + count;
    const auto bin_of = [&](const Box& box, int axis) {
      const float extent = centres.upper[axis] - centres.lower[axis];
      const float place = (box.centre2(axis) - centres.lower[axis]) / extent * float(kBins);
      return std::min(static_cast<int>(place), kBins - 1);
    };
    for (int axis = 0; axis < 3; ++axis) {
      if (!(centres.upper[axis] > centres.lower[axis])) continue;
      std::array<Bin, kBins> bins;
      for (auto it = begin; it != end; ++it) {
        Bin& bin = bins[std::size_t(bin_of(it->box, axis))];
        bin.box.extend(it->box);
        ++bin.count;
      }
      std::array<float, kBins> right_cost;
      Box box;
      std::uint32_t n = 0;
      for (int b = kBins - 1; b > 0; --b) {
        box.extend(bins[std::size_t(b)].box);
        n += bins[std::size_t(b)].count;
        right_cost[std::size_t(b)] = n == 0 ? kInfinity : box.half_area() * blocks_of(n);
      }
      box = Box();
      n = 0;
      for (int b = 1; b < kBins; ++b) {
        box.extend(bins[std::size_t(b - 1)].box);
        n += bins[std::size_t(b - 1)].count;
        const float cost =
            n == 0 ? kInfinity : box.half_area() * blocks_of(n) + right_cost[std::size_t(b)];
        if (cost < best_cost) {
          best_cost = cost;
          best_axis = axis;
          best_bin = b;
        }
      }
    }
    if (best_axis < 0) return count / 2;  // all centres coincide: any half is as good
    const auto middle = std::partition(
        begin, end, [&](const Reference& r) { return bin_of(r.box, best_axis) < best_bin; });
    return static_cast<std::uint32_t>(middle - begin);
  }

  static float blocks_of(std::uint32_t n) {
    const std::uint32_t blocks = (n + kBvhWidth - 1) / kBvhWidth;
    return float(blocks);
  }

  /// Turns a binary subtree into wide nodes, opening the child of largest area while there is room.
  std::uint32_t gather(std::uint32_t at, Bvh& bvh) {
    if (binary_[at].right == 0) return add_block(binary_[at], bvh);
    std::array<std::uint32_t, kBvhWidth> children = {at + 1, binary_[at].right};
    int count = 2;
    while (count < kBvhWidth) {
      int widest = -1;
      for (int i = 0; i < count; ++i) {
        const BinaryNode& child = binary_[children[std::size_t(i)]];
        if (child.right == 0) continue;
        if (widest < 0 ||
            child.box.half_area() > binary_[children[std::size_t(widest)]].box.half_area())
          widest = i;
      }
      if (widest < 0) break;
      std::uint32_t& opened = children[std::size_t(widest)];
      children[std::size_t(count++)] = binary_[opened].right;
      ++opened;
    }
    const auto index = static_cast<std::uint32_t>(bvh.nodes.size());
    bvh.nodes.emplace_back();
    BvhNode wide;
    for (int i = 0; i < kBvhWidth; ++i) {
      const Box box = i < count ? binary_[children[std::size_t(i)]].box : Box();
      for (int k = 0; k < 3; ++k) {
        wide.lower[k][i] = box.lower[k];
        wide.upper[k][i] = box.upper[k];
      }
      wide.child[i] = i < count ? gather(children[std::size_t(i)], bvh) : kBvhEmpty;
    }
    bvh.nodes[index] = wide;
    return index;
  }

  std::uint32_t add_block(const BinaryNode& leaf, Bvh& bvh) {
    TriangleBlock block;
    for (int i = 0; i < kBvhWidth; ++i) {
      const auto lane = static_cast<std::uint32_t>(i);
      block.triangle[i] = lane < leaf.count ? references_[leaf.first + lane].triangle : kNoTriangle;
    }
    bvh.blocks.push_back(block);
    return kBvhLeaf | static_cast<std::uint32_t>(bvh.blocks.size() - 1);
  }

  void fill(TriangleBlock& block) const {
    for (int i = 0; i < kBvhWidth; ++i) {
      const std::uint32_t t = block.triangle[i];
      TriangleFrame<double> f = {{1e18, 1e18, 1e18}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, 0, 0, 0};
      if (t != kNoTriangle) f = make_triangle_frame(corner(t, 0), corner(t, 1), corner(t, 2));
      for (int k = 0; k < 3; ++k) {
        block.origin[k][i] = static_cast<float>(f.origin[k]);
        block.u[k][i] = static_cast<float>(f.u[k]);
        block.v[k][i] = static_cast<float>(f.v[k]);
        block.n[k][i] = static_cast<float>(f.n[k]);
      }
      block.length[i] = static_cast<float>(f.length);
      block.apex[i] = static_cast<float>(f.apex);
      block.height[i] = static_cast<float>(f.height);
    }
  }

  const std::vector<double>& vertices_;
  const std::vector<std::uint32_t>& triangles_;
  std::vector<Reference> references_;
  std::vector<BinaryNode> binary_;
};

}  // namespace

Bvh build_bvh(const std::vector<double>& vertices, const std::vector<std::uint32_t>& triangles) {
  return Builder(vertices, triangles).build();
}

}  // namespace ist
