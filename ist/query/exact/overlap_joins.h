#pragma once

#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "query/exact/exact_sums.h"
#include "query/exact/mesh_tree.h"

// Joins the connected elements of an overlap, on the host and on a GPU.

namespace ist {

/// Sorts on the host and on a GPU, in place.
template <class T, class Less>
IST_HD void heap_sort(T* items, std::uint32_t count, const Less& less) {
  const auto sink = [&](std::uint32_t at, std::uint32_t end) {
    const T item = items[at];
    for (std::uint32_t child = 2 * at + 1; child < end; child = 2 * at + 1) {
      if (child + 1 < end && less(items[child], items[child + 1])) ++child;
      if (!less(item, items[child])) break;
      items[at] = items[child];
      at = child;
    }
    items[at] = item;
  };
  for (std::uint32_t k = count / 2; k > 0; --k) sink(k - 1, count);
  for (std::uint32_t end = count; end > 1; --end) {
    const T last = items[end - 1];
    items[end - 1] = items[0];
    items[0] = last;
    sink(0, end - 1);
  }
}

/// The number of bits of a triangle's name: eight times a pair's name fits into 64.
inline constexpr int kTriangleBits = 28;

template <class Visit>
IST_HD void for_each_bit(std::uint64_t bits, const Visit& visit) {
  for (const std::uint32_t i : set_bits(bits)) visit(i);
}

/// The least power of two that is at least n.
IST_HD inline std::uint32_t power_from(std::uint32_t n) {
  std::uint32_t power = 1;
  while (power < n) power *= 2;
  return power;
}

/// Joins the elements of an overlap: crossings, vertices of crossed blocks, and blocks inside as a
/// whole. Surfaces are connected by the curves where they cross and by vertices inside the other
/// solid.
///
/// `Overlap` is what a query found, with these members; sides are 0, A's, and 1, B's:
///
/// - leads(), lane(), width(), meet(), any(flag), exclusive_count(flag, total): the team. leads()
///   is true in the lane that does serial work; meet() makes what lanes wrote visible to all
/// - load(at), store(at, to), add(at, by), exchange(at, to), replace(at, from, to), least(at, x),
///   most(at, x): atomic accesses. add(), exchange() and replace() return the value before
/// - mesh(side), memory(), pieces(), whole(): PartMemory, PieceMemory, the whole's ExactSums
/// - crossings(), triangle(side, i), end_of(i, e), share_of_edge(i, e), place_of(i, e): in the
///   order of the meshes; an end's position on its edge, 0 to 1, and its place from the origin
/// - first_record(side), end_record(side), side_of(r), record_of(side, block): crossed blocks,
///   those of a side among these numbers
/// - block_of(r), inside_of(r), pierced_of(r), opposite_edge(r, triangle), at(r, vertex)
/// - is_inside(side, block), is_pierced(side, block), for_each_inside(side, visit),
///   for_each_pierced(side, visit): blocks, in their order
/// - vertex(side, number), lane_sums(side, block, origin): from the origin
/// - find_crossing_terms(first), find_triangle_terms(r, h), count_triangles(r): pieces() of eight
///   crossings, of a crossed block's half, of its triangles. All of a team together
template <class Overlap>
class OverlapJoins : public Overlap {
 public:
  using Overlap::Overlap;

 protected:
  using Overlap::lane;
  using Overlap::leads;
  using Overlap::load;
  using Overlap::meet;
  using Overlap::memory;
  using Overlap::mesh;
  using Overlap::opposite_edge;
  using Overlap::pieces;
  using Overlap::width;

  IST_HD void number_elements() noexcept {
    by_names_ = true;
    first_vertex_ = this->crossings();
    first_block_[0] = first_vertex_ + kWidth * records();
    first_block_[1] = first_block_[0] + mesh(0).level[0].count;
  }

  IST_HD void join() noexcept {
    begin();
    meet();
    join_within_blocks();
    list_ends();
    meet();
    join_curves();
    meet();
    for (int side = 0; side < 2; ++side) join_holes(side);
    join_edges();
    for (int side = 0; side < 2; ++side) {
      join_vertices(side);
      join_blocks(side);
      meet();
    }
  }

  IST_HD std::uint32_t vertex_element(std::uint32_t record, std::uint32_t vertex) const noexcept {
    return first_vertex_ + kWidth * record + vertex;
  }
  IST_HD std::uint32_t block_element(int side, std::uint32_t block) const noexcept {
    return first_block_[side] + block;
  }
  IST_HD std::uint32_t records() const noexcept {
    return this->end_record(0) > this->end_record(1) ? this->end_record(0) : this->end_record(1);
  }
  IST_HD const MeshBlock& block_of(std::uint32_t record) const noexcept {
    return mesh(this->side_of(record)).blocks[this->number_of(record)];
  }

  /// Calls visit(block) for this lane's share of the blocks inside as a whole.
  template <class Visit>
  IST_HD void for_each_of_lane(int side, const Visit& visit) noexcept {
    std::uint32_t next = lane();
    this->for_each_inside(side, [&](std::uint32_t b) {
      if (next == 0) visit(b);
      next = next == 0 ? width() - 1 : next - 1;
    });
  }

  IST_HD std::uint32_t root(std::uint32_t element) noexcept {
    std::uint32_t* const parent = memory().parent;
    for (std::uint32_t up = load(parent[element]); up != element; up = load(parent[element])) {
      const std::uint32_t above = load(parent[up]);
      this->store(parent[element], above);
      element = above;
    }
    return element;
  }

  IST_HD bool is_root(std::uint32_t element) const noexcept {
    return load(memory().parent[element]) == element;
  }

  /// root() without changing any links.
  IST_HD std::uint32_t top(std::uint32_t element) const noexcept {
    const std::uint32_t* const parent = memory().parent;
    while (parent[element] != element) element = parent[element];
    return element;
  }

  /// Joins two elements. The lower number becomes the root, so that parts do not depend on the
  /// order.
  IST_HD void unite(std::uint32_t x, std::uint32_t y) noexcept {
    for (;;) {
      x = root(x);
      y = root(y);
      if (x == y) return;
      const std::uint32_t low = x < y ? x : y, high = x < y ? y : x;
      if (this->replace(memory().parent[high], high, low) == high) return;
    }
  }

  /// The index of a crossed block's first edge.
  IST_HD static std::uint32_t first_middle(std::uint32_t record) noexcept {
    return 3 * kWidth * record;
  }

  bool by_names_ = true;  ///< connections follow from names of crossings and their ends

 private:
  /// Flags of an end in the list of its edge, above the number of the next.
  static constexpr std::uint64_t kEnters = std::uint64_t{1} << 32,
                                 kFromFirst = std::uint64_t{2} << 32;

  /// Makes each element its own root, and empties the lists of ends of edges.
  IST_HD void begin() noexcept {
    const auto alone = [&](std::uint32_t element) {
      memory().parent[element] = element;
      memory().part[element] = kNoIndex;
    };
    for (std::uint32_t i = lane(); i < first_block_[0]; i += width()) alone(i);
    for (int side = 0; side < 2; ++side)
      for_each_of_lane(side, [&](std::uint32_t b) { alone(block_element(side, b)); });
    for (std::uint32_t r = lane(); r < records(); r += width())
      for_each_bit(this->pierced_of(r), [&](std::uint32_t edge) {
        memory().middles[first_middle(r) + edge] = kNoIndex;
      });
  }

  /// Joins vertices inside along edges that nothing pierces. Each lane has its own crossed blocks.
  IST_HD void join_within_blocks() noexcept {
    for (std::uint32_t r = lane(); r < records(); r += width()) {
      const std::uint64_t pierced = this->pierced_of(r);
      const std::uint32_t inside = this->inside_of(r);
      if (pierced == 0 || inside == 0) continue;
      const MeshBlock& block = block_of(r);
      for (std::uint32_t edge = 0; edge < 3u * block.triangles; ++edge) {
        const std::uint32_t p = block.corner[edge % 3][edge / 3],
                            q = block.corner[(edge + 1) % 3][edge / 3];
        if ((pierced >> edge & 1) == 0 && (inside >> p & 1) != 0)
          unite(vertex_element(r, p), vertex_element(r, q));
      }
    }
  }

  /// Names the ends of segments, lists them by their edges, and empties the table of join_curves().
  IST_HD void list_ends() noexcept {
    const std::uint32_t mask = curve_mask();
    for (std::uint32_t i = lane(); i <= mask; i += width()) memory().keys[i] = 0;
    for (std::uint32_t i = lane(); i < 2 * this->crossings(); i += width()) {
      const CrossingEnd end = this->end_of(i / 2, static_cast<int>(i % 2));
      const int side = end.of_b ? 1 : 0;
      const MeshBlock& block = mesh(side).blocks[end.triangle / kWidth];
      const std::uint32_t of_block = end.triangle % kWidth;
      const std::uint32_t r = this->record_of(side, end.triangle / kWidth);
      const std::uint32_t next =
          this->exchange(memory().middles[first_middle(r) + 3 * of_block + end.edge], i);
      memory().other_keys[i] =
          next | (end.enters ? kEnters : 0) | (end.from_first ? kFromFirst : 0);
      const std::uint32_t p = block.vertex[block.corner[end.edge][of_block]],
                          q = block.vertex[block.corner[(end.edge + 1) % 3][of_block]];
      memory().ends[i] = {std::uint64_t{p < q ? p : q} << 32 | (p < q ? q : p), 0, i / 2,
                          this->triangle(end.of_b ? 0 : 1, i / 2), end.of_b};
    }
  }
  IST_HD std::uint32_t curve_mask() const noexcept {
    return power_from(2 * this->crossings() + 1) - 1;
  }

  /// Joins segments that end at the same point, which is on an edge of two triangles and in a
  /// triangle of the other solid. A hash table finds it by its name.
  IST_HD void join_curves() noexcept {
    const PiercedEnd* const ends = memory().ends;
    std::uint64_t* const table = memory().keys;  // numbers of ends, from 1
    const std::uint32_t mask = curve_mask();
    for (std::uint32_t i = lane(); i < 2 * this->crossings(); i += width()) {
      const PiercedEnd& end = ends[i];
      const std::uint64_t mixed =
          (end.edge ^ (std::uint64_t{end.other} << 20)) * 0x9e3779b97f4a7c15u + (end.of_b ? 1 : 0);
      for (std::uint64_t slot = (mixed ^ mixed >> 29) >> 3 & mask;; slot = (slot + 1) & mask) {
        const std::uint64_t before =
            this->replace(table[slot], std::uint64_t{0}, i + std::uint64_t{1});
        if (before == 0) break;
        const PiercedEnd& found = ends[before - 1];
        if (found.edge != end.edge || found.other != end.other || found.of_b != end.of_b) continue;
        unite(end.crossing, found.crossing);
        break;
      }
    }
  }

  /// Joins a curve that is in one triangle and surrounds an outside region to the narrowest curve
  /// around it there, or to the triangle's corners.
  IST_HD void join_holes(int side) noexcept {
    CurveExtent* const curves = memory().curves;
    const std::uint32_t count = this->crossings();
    for (std::uint32_t i = lane(); i < count; i += width())
      if (is_root(i)) curves[i].triangle = this->triangle(side, i);
    meet();
    for (std::uint32_t i = lane(); i < count; i += width())
      if (const std::uint32_t first = root(i);
          this->triangle(side, i) != this->triangle(side, first))
        this->store(curves[first].triangle, kNoIndex);
    meet();
    bool alone = false;
    for (std::uint32_t i = lane(); i < count; i += width())
      alone = alone || (is_root(i) && load(curves[i].triangle) != kNoIndex);
    if (!this->any(alone)) return;
    if (leads()) join_holes_of(side, count);
    meet();
  }
  IST_HD void join_holes_of(int side, std::uint32_t count) noexcept {
    using exact::Point;
    CurveExtent* const curves = memory().curves;
    by_names_ = false;
    for (std::uint32_t i = 0; i < count; ++i) {
      CurveExtent& curve = curves[root(i)];
      const Point from = this->place_of(i, 0), to = this->place_of(i, 1);
      if (root(i) == i) curve = {curve.triangle, from, from, {0, 0, 0}};
      for (int k = 0; k < 3; ++k) {
        if (from[k] < curve.low[k]) curve.low[k] = from[k];
        if (from[k] > curve.high[k]) curve.high[k] = from[k];
      }
      curve.area = curve.area + (side == 1 ? -1.0 : 1.0) * cross(from, to);
    }
    for (std::uint32_t i = 0; i < count; ++i) {
      const CurveExtent& hole = curves[i];
      if (root(i) != i || hole.triangle == kNoIndex) continue;
      const std::uint32_t number = hole.triangle / kWidth, lane = hole.triangle % kWidth;
      const MeshBlock& block = mesh(side).blocks[number];
      const std::uint32_t r = this->record_of(side, number);
      const Point corner = this->at(r, block.corner[0][lane]);
      const Point normal = cross(this->at(r, block.corner[1][lane]) - corner,
                                 this->at(r, block.corner[2][lane]) - corner);
      if (dot(hole.area, normal) >= 0) continue;
      std::uint32_t around = kNoIndex;
      double narrowest = HUGE_VAL;
      for (std::uint32_t j = 0; j < count; ++j) {
        const CurveExtent& curve = curves[root(j)];
        if (this->triangle(side, j) != hole.triangle || root(j) == i) continue;
        const Point wide = curve.high - curve.low;
        const bool holds = curve.low.x <= hole.low.x && curve.low.y <= hole.low.y &&
                           curve.low.z <= hole.low.z && curve.high.x >= hole.high.x &&
                           curve.high.y >= hole.high.y && curve.high.z >= hole.high.z;
        if (!holds || !(dot(wide, wide) < narrowest)) continue;
        narrowest = dot(wide, wide);
        around = j;
      }
      if (around != kNoIndex)
        unite(i, around);
      else if (this->is_inside(side, number))
        unite(i, block_element(side, number));
      else if (this->inside_of(r) >> block.corner[0][lane] & 1)
        unite(i, vertex_element(r, block.corner[0][lane]));
    }
  }

  /// Joins the ends of the pieces of edges that are inside.
  IST_HD void join_edges() noexcept {
    if (leads()) pieces().taken = 0;
    meet();
    for (std::uint32_t r = lane(); r < records(); r += width()) {
      const MeshBlock& block = block_of(r);
      for_each_bit(this->pierced_of(r), [&](std::uint32_t edge) {
        // The triangle on the edge's other side has the same ends.
        const std::uint32_t t = edge / 3;
        if (edge % 3 != opposite_edge(r, t) &&
            block.vertex[block.corner[edge % 3][t]] > block.vertex[block.corner[(edge + 1) % 3][t]])
          return;
        std::uint32_t& middle = memory().middles[first_middle(r) + edge];
        middle = join_edge(r, edge, middle);
      });
    }
  }

  /// Returns the element to which the middle of the edge belongs. `first`: of the list of its ends.
  ///
  /// If copies coincide, ends may be nearer to each other than their error, and their order may
  /// show nothing inside in the middle. The nearest end then represents it, so sums lose nothing.
  IST_HD std::uint32_t join_edge(std::uint32_t r, std::uint32_t edge,
                                 std::uint32_t first) noexcept {
    // The ends of edges are sorted in the memory of curves' ends, each lane's in its own part.
    PiercedEnd* ends = memory().ends;
    std::uint32_t count = 0;
    if (width() > 1) {
      for (std::uint32_t i = first; i != kNoIndex; ++count)
        i = static_cast<std::uint32_t>(memory().other_keys[i]);
      ends += this->add(pieces().taken, count);
      count = 0;
    }
    for (std::uint32_t i = first; i != kNoIndex;) {
      const std::uint64_t next = memory().other_keys[i];
      ends[count++] = {next, this->share_of_edge(i / 2, static_cast<int>(i % 2)), i / 2, 0, false};
      i = static_cast<std::uint32_t>(next);
    }
    by_names_ = by_names_ && count <= 2;
    if (count > 1)
      heap_sort(ends, count, [](const PiercedEnd& x, const PiercedEnd& y) {
        const bool first_half = (x.edge & kFromFirst) != 0;
        if (first_half != ((y.edge & kFromFirst) != 0)) return first_half;
        return x.t < y.t || (x.t == y.t && x.crossing < y.crossing);
      });
    const MeshBlock& block = block_of(r);
    const std::uint32_t p = block.corner[edge % 3][edge / 3],
                        q = block.corner[(edge + 1) % 3][edge / 3];
    const std::uint32_t insides = this->inside_of(r);
    std::uint32_t inside = insides >> p & 1 ? vertex_element(r, p) : kNoIndex;
    std::uint32_t middle = inside, nearest = ends[0].crossing;
    for (std::uint32_t i = 0; i < count; ++i) {
      if ((ends[i].edge & kEnters) != 0) {
        inside = ends[i].crossing;
      } else {
        if (inside != kNoIndex) unite(inside, ends[i].crossing);
        inside = kNoIndex;
      }
      if ((ends[i].edge & kFromFirst) == 0) continue;
      middle = inside;
      nearest = ends[i].crossing;
    }
    if (inside != kNoIndex && (insides >> q & 1) != 0) unite(inside, vertex_element(r, q));
    return middle != kNoIndex ? middle : nearest;
  }

  /// Joins vertices inside that different blocks share. A hash table finds them.
  IST_HD void join_vertices(int side) noexcept {
    const auto is_mixed = [&](std::uint32_t r) {
      return this->side_of(r) == side && this->pierced_of(r) != 0 && this->inside_of(r) != 0;
    };
    const std::uint32_t begin = this->first_record(side), end = this->end_record(side);
    int count = 0;
    for (std::uint32_t r = begin; r < end; ++r)
      if (is_mixed(r)) count += count_bits(this->inside_of(r));
    std::uint64_t* const table = memory().keys;  // vertex and element
    const std::uint32_t mask = power_from(2 * static_cast<std::uint32_t>(count) + 1) - 1;
    constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
    for (std::uint32_t i = lane(); i <= mask; i += width()) table[i] = kEmpty;
    meet();
    for (std::uint32_t r = begin + lane(); r < end; r += width()) {
      if (!is_mixed(r)) continue;
      const MeshBlock& block = block_of(r);
      for_each_bit(this->inside_of(r), [&](std::uint32_t v) {
        const std::uint32_t vertex = block.vertex[v], element = vertex_element(r, v);
        for (std::uint32_t slot = vertex * 2654435769u >> 7 & mask;; slot = (slot + 1) & mask) {
          const std::uint64_t before =
              this->replace(table[slot], kEmpty, std::uint64_t{vertex} << 32 | element);
          if (before == kEmpty) break;
          if (before >> 32 != vertex) continue;
          unite(element, static_cast<std::uint32_t>(before));
          break;
        }
      });
    }
  }

  /// Joins blocks inside as a whole with each other and with the inside vertices of crossed blocks.
  IST_HD void join_blocks(int side) noexcept {
    const MeshTree& all = mesh(side);
    for_each_of_lane(side, [&](std::uint32_t b) {
      const MeshBlock& block = all.blocks[b];
      for (std::uint32_t k = 0; k < block.neighbours; ++k) {
        const std::uint32_t other = all.neighbours[block.first_neighbour + k] / kWidth;
        if (this->is_inside(side, other)) {
          if (other < b) unite(block_element(side, b), block_element(side, other));
        } else if (this->is_pierced(side, other)) {
          const std::uint32_t r = this->record_of(side, other);
          const MeshBlock& beside = all.blocks[other];
          for (std::uint32_t v = 0; v < beside.vertices; ++v)
            for (std::uint32_t w = 0; w < block.vertices; ++w)
              if (block.vertex[w] == beside.vertex[v])
                unite(block_element(side, b), vertex_element(r, v));
        }
      }
    });
  }

  std::uint32_t first_vertex_ = 0, first_block_[2] = {0, 0};  ///< elements
};

}  // namespace ist
