#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "base/elementary.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/triangle_frame.h"
#include "mesh/hierarchy/bvh.h"

// Many triangles are sorted into cells of a coarse grid first. The tree over the cells is cheap;
// below a few cells each, a single thread builds the rest.

namespace ist {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
/// Below this depth ranges are halved at any cost: stacks have a fixed size.
constexpr int kHeuristicDepth = 40;
// Below that, counts are halved: of the cells of one grid, then of the triangles of one cell.
static_assert(kHeuristicDepth + 12 + 28 < kBvhLevels);
constexpr float kFlat = 1e-30f;         ///< closer centres count as equal
constexpr std::size_t kTreelet = 1024;  ///< triangles below a few cells
constexpr std::size_t kSerial = 8192;   ///< fewer triangles do not repay a grid
constexpr std::size_t kChunk = 16384;   ///< triangles that one thread sorts into cells at a time
constexpr std::size_t kManyItems = 65'536;  ///< so many repay a finer grid

using Lanes [[gnu::vector_size(16)]] = float;  ///< x, y, z and an unused lane
using Places [[gnu::vector_size(16)]] = std::int32_t;

Lanes lowest(Lanes a, Lanes b) { return a < b ? a : b; }
Lanes highest(Lanes a, Lanes b) { return a > b ? a : b; }
Lanes all(float value) { return Lanes{value, value, value, value}; }

struct GrowingBox {
  Lanes lower = all(kInfinity), upper = all(-kInfinity);

  void extend(const GrowingBox& other) {
    lower = lowest(lower, other.lower);
    upper = highest(upper, other.upper);
  }
  float half_area() const {
    const Lanes size = upper - lower;
    return size[0] < 0 ? 0 : size[0] * size[1] + size[1] * size[2] + size[2] * size[0];
  }
};

/// A triangle or a cell of triangles that is sorted into a leaf. The spare lanes store two numbers
/// below 2^30, as bits of floats between 1e-38 and 8: arithmetic with subnormal floats is slow, and
/// with infinite ones it traps.
struct Item {
  Lanes lower, upper;

  Item() {}  // uninitialised, for threads to fill
  Item(const GrowingBox& around, std::uint32_t name, std::uint32_t count)
      : lower(around.lower), upper(around.upper) {
    lower[3] = std::bit_cast<float>(name + kLeastNormal);
    upper[3] = std::bit_cast<float>(count + kLeastNormal);
  }
  GrowingBox box() const { return {lower, upper}; }
  std::uint32_t name() const { return number(lower[3]); }
  std::uint32_t count() const { return number(upper[3]); }
  Lanes centre2() const { return lower + upper; }  // twice the centre

 private:
  static constexpr std::uint32_t kLeastNormal = 0x00800000;
  static std::uint32_t number(float lane) {
    return std::bit_cast<std::uint32_t>(lane) - kLeastNormal;
  }
};

float longest_side(const GrowingBox& box) {
  const Lanes size = box.upper - box.lower;
  return std::max({size[0], size[1], size[2]});
}

/// Bounds of items and of their centres.
struct SortExtent {
  GrowingBox box, centres;
  std::uint32_t count = 0;  ///< triangles

  void add(const Item& item) {
    const Lanes centre2 = item.centre2();
    box.extend(item.box());
    centres.extend({centre2, centre2});
    count += item.count();
  }
  void add(const SortExtent& other) {
    box.extend(other.box);
    centres.extend(other.centres);
    count += other.count;
  }
};

/// The items below one node.
struct Range {
  std::span<Item> items;
  SortExtent extent;
  int depth;
};

/// Equal slices of the box of centres, along all axes at once.
struct Slices {
  Lanes low, scale;
  int last;

  Slices(const GrowingBox& centres, int count)
      : low(centres.lower), scale(all(0)), last(count - 1) {
    low[3] = 0;
    for (int k = 0; k < 3; ++k) {
      const float size = centres.upper[k] - centres.lower[k];
      if (size > kFlat) scale[k] = static_cast<float>(count) / size;
    }
  }
  Places of(const Item& item) const {
    const Places place = __builtin_convertvector((item.centre2() - low) * scale, Places);
    const Places most = {last, last, last, last};
    return place < most ? place : most;
  }
};

float blocks_of(std::uint32_t triangles) {
  return static_cast<float>((triangles + kBvhWidth - 1) / kBvhWidth);
}

/// The position of a cut: slices before `bin` along `axis` go left. None: axis < 0.
struct Cut {
  int axis = -1, bin = 0;
};

/// The minimum of the binned surface area heuristic.
template <int kBins>
Cut cheapest_cut(const Range& range, const Slices& slices) {
  GrowingBox boxes[3][kBins];
  std::uint32_t counts[3][kBins] = {};
  for (const Item& item : range.items) {
    const Places place = slices.of(item);
    for (int k = 0; k < 3; ++k) {
      boxes[k][place[k]].extend(item.box());
      counts[k][place[k]] += item.count();
    }
  }
  Cut best;
  float least = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(slices.scale[axis] > 0)) continue;
    float right[kBins];
    GrowingBox box;
    std::uint32_t n = 0;
    for (int b = kBins - 1; b > 0; --b) {
      box.extend(boxes[axis][b]);
      n += counts[axis][b];
      right[b] = n == 0 ? kInfinity : box.half_area() * blocks_of(n);
    }
    box = GrowingBox();
    n = 0;
    for (int b = 1; b < kBins; ++b) {
      box.extend(boxes[axis][b - 1]);
      n += counts[axis][b - 1];
      if (n == 0) continue;
      const float cost = box.half_area() * blocks_of(n) + right[b];
      if (cost < least) {
        least = cost;
        best = {axis, b};
      }
    }
  }
  return best;
}

SortExtent extent_of(std::span<const Item> items) {
  SortExtent extent;
  for (const Item& item : items) extent.add(item);
  return extent;
}

std::array<Range, 2> parted(const Range& range, std::size_t left) {
  const std::span<Item> first = range.items.first(left), second = range.items.subspan(left);
  return {Range{first, extent_of(first), range.depth + 1},
          Range{second, extent_of(second), range.depth + 1}};
}

/// Divides a few triangles across the longest side into a full block and the rest.
std::array<Range, 2> parted_few(const Range& range) {
  const Lanes size = range.extent.centres.upper - range.extent.centres.lower;
  const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : (size[1] >= size[2] ? 1 : 2);
  std::sort(range.items.begin(), range.items.end(), [&](const Item& a, const Item& b) {
    return std::pair(float{a.centre2()[axis]}, a.name()) <
           std::pair(float{b.centre2()[axis]}, b.name());
  });
  return parted(range, kBvhWidth);
}

std::array<Range, 2> halves(const Range& range) {
  constexpr std::size_t kMany = 64;  // items: finer slices repay their cost
  const std::size_t count = range.items.size();
  if (count == range.extent.count && count <= 2 * kBvhWidth) return parted_few(range);
  if (range.depth >= kHeuristicDepth) return parted(range, count / 2);
  const Slices slices(range.extent.centres, count < kMany ? 8 : 16);
  const Cut cut = count < kMany ? cheapest_cut<8>(range, slices) : cheapest_cut<16>(range, slices);
  if (cut.axis < 0)
    return parted(range,
                  count / 2);  // all centres coincide: any half is equally good
  SortExtent extent[2];
  std::size_t left = 0, right = count;
  const auto is_left = [&](const Item& item) {
    const bool is = slices.of(item)[cut.axis] < cut.bin;
    extent[is ? 0 : 1].add(item);
    return is;
  };
  while (left < right) {
    if (is_left(range.items[left]))
      ++left;
    else
      std::swap(range.items[left], range.items[--right]);
  }
  return {Range{range.items.first(left), extent[0], range.depth + 1},
          Range{range.items.subspan(left), extent[1], range.depth + 1}};
}

/// A hierarchy whose blocks are not filled yet.
struct Tree {
  std::vector<BvhNode> nodes;
  std::vector<std::array<std::uint32_t, kBvhWidth>> leaves;  ///< triangles
  std::uint32_t root = kBvhEmpty;
};

/// Makes the node of a range and opens the children of largest area while it has free slots.
/// `is_leaf(range)`; child(range): the number of the node or leaf of a range.
template <class IsLeaf, class Child>
std::uint32_t add_node(const Range& range, std::vector<BvhNode>& nodes, const IsLeaf& is_leaf,
                       const Child& child) {
  std::array<Range, kBvhWidth> children;
  int count = 0;
  children[std::size_t(count++)] = range;
  while (count < kBvhWidth) {
    int widest = -1;
    float most = -1;
    for (int i = 0; i < count; ++i) {
      const Range& each = children[std::size_t(i)];
      if (is_leaf(each) || !(each.extent.box.half_area() > most)) continue;
      most = each.extent.box.half_area();
      widest = i;
    }
    if (widest < 0) break;
    const std::array<Range, 2> two = halves(children[std::size_t(widest)]);
    children[std::size_t(widest)] = two[0];
    children[std::size_t(count++)] = two[1];
  }
  const auto index = static_cast<std::uint32_t>(nodes.size());
  nodes.emplace_back();
  for (int i = 0; i < kBvhWidth; ++i) {
    const GrowingBox box = i < count ? children[std::size_t(i)].extent.box : GrowingBox();
    for (int k = 0; k < 3; ++k) {
      nodes[index].lower[k][i] = box.lower[k];
      nodes[index].upper[k][i] = box.upper[k];
    }
    const std::uint32_t below = i < count ? child(children[std::size_t(i)], i) : kBvhEmpty;
    nodes[index].child[i] = below;
  }
  return index;
}

std::uint32_t add_below(const Range& range, Tree& tree) {
  const auto is_leaf = [](const Range& r) { return r.items.size() <= kBvhWidth; };
  if (!is_leaf(range))
    return add_node(range, tree.nodes, is_leaf,
                    [&](const Range& part, int) { return add_below(part, tree); });
  auto& leaf = tree.leaves.emplace_back();
  leaf.fill(kNoTriangle);
  for (std::size_t i = 0; i < range.items.size(); ++i) leaf[i] = range.items[i].name();
  return kBvhLeaf | static_cast<std::uint32_t>(tree.leaves.size() - 1);
}

std::size_t chunks_of(std::size_t count) { return (count + kChunk - 1) / kChunk; }

std::span<Item> chunk_of(std::span<Item> items, std::size_t chunk) {
  return items.subspan(chunk * kChunk, std::min(kChunk, items.size() - chunk * kChunk));
}

SortExtent extent_of_many(std::span<Item> items) {
  return tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::size_t>(0, chunks_of(items.size()), 1), SortExtent(),
      [&](const tbb::blocked_range<std::size_t>& range, SortExtent extent) {
        for (std::size_t c = range.begin(); c < range.end(); ++c)
          extent.add(extent_of(chunk_of(items, c)));
        return extent;
      },
      [](SortExtent a, const SortExtent& b) {
        a.add(b);
        return a;
      });
}

Tree tree_of(const Range& range);

/// A range in a grid's cells, and the tree over them down to groups of a few.
class CellTree {
 public:
  explicit CellTree(const Range& range)
      : range_(range), edge_(range.items.size() < kManyItems ? 8 : 16) {
    const GrowingBox& centres = range.extent.centres;
    low_ = centres.lower;
    scale_ = all(static_cast<float>(edge_) / longest_side(centres));
    low_[3] = scale_[3] = 0;
    count_cells();
    const SortExtent whole = extent_of(cells_);
    add_top({cells_, whole, range.depth});
  }

  /// The complete tree with all groups.
  Tree tree() {
    const auto items = std::make_unique_for_overwrite<Item[]>(range_.items.size());
    const std::span<Item> sorted(items.get(), range_.items.size());
    sort_into(sorted);
    std::vector<Tree> parts(groups_.size());
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t g) {
      const std::span<Item> group = sorted.subspan(groups_[g].first, groups_[g].count);
      parts[g] = tree_of({group, extent_of(group), groups_[g].depth});
    });
    return joined(parts);
  }

 private:
  /// Cells below one child of a node of the top.
  struct Group {
    std::uint32_t node = kBvhEmpty;
    int lane = 0, depth;
    std::size_t first, count;  ///< triangles
  };

  std::size_t cell_of(const Item& item) const {
    const Places at = __builtin_convertvector((item.centre2() - low_) * scale_, Places);
    const auto along = [&](int k) { return static_cast<std::size_t>(std::min(at[k], edge_ - 1)); };
    return along(0) + std::size_t(edge_) * (along(1) + std::size_t(edge_) * along(2));
  }

  void count_cells() {
    const std::size_t chunks = chunks_of(range_.items.size());
    of_chunk_.resize(chunks * cells_of_grid_);
    tbb::enumerable_thread_specific<std::vector<GrowingBox>> boxes(
        [this] { return std::vector<GrowingBox>(cells_of_grid_); });
    tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
      std::vector<GrowingBox>& of_thread = boxes.local();
      for (const Item& item : chunk_of(range_.items, c)) {
        const std::size_t cell = cell_of(item);
        ++of_chunk_[c * cells_of_grid_ + cell];
        of_thread[cell].extend(item.box());
      }
    });
    for (std::size_t cell = 0; cell < cells_of_grid_; ++cell) {
      std::uint32_t count = 0;
      for (std::size_t c = 0; c < chunks; ++c) count += of_chunk_[c * cells_of_grid_ + cell];
      if (count == 0) continue;
      GrowingBox box;
      for (const std::vector<GrowingBox>& of_thread : boxes) box.extend(of_thread[cell]);
      cells_.emplace_back(box, static_cast<std::uint32_t>(cell), count);
    }
  }

  static bool is_group(const Range& range) {
    return range.items.size() == 1 || range.extent.count <= kTreelet;
  }

  void add_group(const Range& range, std::uint32_t node, int lane) {
    groups_.push_back({node, lane, range.depth, placed_, range.extent.count});
    for (const Item& cell : range.items) {
      for (std::size_t at = cell.name(); at < of_chunk_.size(); at += cells_of_grid_)
        placed_ += std::exchange(of_chunk_[at], static_cast<std::uint32_t>(placed_));
    }
  }

  std::uint32_t add_top(const Range& range) {
    if (is_group(range)) {
      add_group(range, kBvhEmpty, 0);
      return kBvhEmpty;
    }
    const auto index = static_cast<std::uint32_t>(top_.size());
    return add_node(range, top_, is_group, [&](const Range& part, int lane) {
      if (!is_group(part)) return add_top(part);
      add_group(part, index, lane);
      return kBvhEmpty;
    });
  }

  /// Sorts items; of_chunk_ contains the positions of the first items of each chunk in each cell.
  void sort_into(std::span<Item> sorted) {
    tbb::parallel_for(std::size_t{0}, chunks_of(range_.items.size()), [&](std::size_t c) {
      for (const Item& item : chunk_of(range_.items, c))
        sorted[of_chunk_[c * cells_of_grid_ + cell_of(item)]++] = item;
    });
  }

  Tree joined(const std::vector<Tree>& parts) {
    std::vector<std::uint32_t> nodes = {static_cast<std::uint32_t>(top_.size())}, leaves = {0};
    for (const Tree& part : parts) {
      nodes.push_back(nodes.back() + static_cast<std::uint32_t>(part.nodes.size()));
      leaves.push_back(leaves.back() + static_cast<std::uint32_t>(part.leaves.size()));
    }
    Tree whole;
    whole.nodes = std::move(top_);
    whole.nodes.resize(nodes.back());
    whole.leaves.resize(leaves.back());
    whole.root = 0;
    tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t g) {
      const auto moved = [&](std::uint32_t child) {
        if (child == kBvhEmpty) return child;
        return child + ((child & kBvhLeaf) != 0 ? leaves[g] : nodes[g]);
      };
      for (std::size_t i = 0; i < parts[g].nodes.size(); ++i) {
        BvhNode node = parts[g].nodes[i];
        for (std::uint32_t& child : node.child) child = moved(child);
        whole.nodes[nodes[g] + i] = node;
      }
      std::copy(parts[g].leaves.begin(), parts[g].leaves.end(), whole.leaves.begin() + leaves[g]);
      std::uint32_t& place = groups_[g].node == kBvhEmpty
                                 ? whole.root
                                 : whole.nodes[groups_[g].node].child[groups_[g].lane];
      place = moved(parts[g].root);
    });
    return whole;
  }

  const Range range_;
  const int edge_;  ///< of the grid, in cells
  const std::size_t cells_of_grid_ = std::size_t(edge_) * std::size_t(edge_) * std::size_t(edge_);
  Lanes low_, scale_;
  std::vector<std::uint32_t> of_chunk_;  ///< [chunk][cell] items, then the position of the first
  std::vector<Item> cells_;
  std::vector<BvhNode> top_;
  std::vector<Group> groups_;
  std::size_t placed_ = 0;  ///< triangles in groups
};

Tree tree_of(const Range& range) {
  if (range.items.size() > kSerial && range.depth < kHeuristicDepth &&
      longest_side(range.extent.centres) > kFlat)
    return CellTree(range).tree();
  Tree tree;
  tree.root = add_below(range, tree);
  return tree;
}

class TrianglesToSort {
 public:
  TrianglesToSort(std::span<const double> vertices, std::span<const std::uint32_t> corners)
      : vertices_(vertices), corners_(corners) {}

  Item item(std::uint32_t triangle) const {
    const double *a = corner(triangle, 0), *b = corner(triangle, 1), *c = corner(triangle, 2);
    GrowingBox box;
    for (int k = 0; k < 3; ++k) {
      box.lower[k] = rounded_down(std::min({a[k], b[k], c[k]}));
      box.upper[k] = rounded_up(std::max({a[k], b[k], c[k]}));
    }
    return {box, triangle, 1};
  }

  TriangleBlock block(const std::array<std::uint32_t, kBvhWidth>& triangles) const {
    TriangleBlock block;
    for (int i = 0; i < kBvhWidth; ++i) {
      const std::uint32_t t = triangles[std::size_t(i)];
      TriangleFrame<double> f = absent_frame();
      if (t != kNoTriangle) f = make_triangle_frame(corner(t, 0), corner(t, 1), corner(t, 2));
      write_frame(block, i, f);
      block.triangle[i] = t;
    }
    return block;
  }

 private:
  const double* corner(std::uint32_t triangle, int i) const {
    return &vertices_[3 * std::size_t{corners_[3 * std::size_t{triangle} + std::size_t(i)]}];
  }

  const std::span<const double> vertices_;
  const std::span<const std::uint32_t> corners_;
};

}  // namespace

Bvh build_bvh(std::span<const double> vertices, std::span<const std::uint32_t> corners) {
  const auto count = static_cast<std::uint32_t>(corners.size() / 3);
  Bvh bvh;
  if (count == 0) return bvh;
  const TrianglesToSort triangles(vertices, corners);
  auto items = std::make_unique_for_overwrite<Item[]>(count);
  tbb::parallel_for(std::uint32_t{0}, count,
                    [&](std::uint32_t t) { items[t] = triangles.item(t); });
  const std::span<Item> all(items.get(), count);
  const Tree tree = tree_of({all, extent_of_many(all), 0});
  items.reset();
  bvh.root = tree.root;
  bvh.nodes = std::make_unique_for_overwrite<BvhNode[]>(tree.nodes.size());
  bvh.blocks = std::make_unique_for_overwrite<TriangleBlock[]>(tree.leaves.size());
  tbb::parallel_for(std::size_t{0}, tree.nodes.size(),
                    [&](std::size_t i) { bvh.nodes[i] = tree.nodes[i]; });
  tbb::parallel_for(std::size_t{0}, tree.leaves.size(),
                    [&](std::size_t i) { bvh.blocks[i] = triangles.block(tree.leaves[i]); });
  bvh.oriented = oriented_boxes(
      {vertices.data(), corners.data(), static_cast<std::uint32_t>(vertices.size() / 3), count,
       bvh.nodes.get(), bvh.blocks.get(), bvh.root},
      tree.nodes.size());
  return bvh;
}

}  // namespace ist
