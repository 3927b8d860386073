#include "query/exact/exact_parts.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace ist {

using exact::Point;

namespace {

/// ExactScratch has no more blocks, and eight times a pair's name fits into 64 bits.
constexpr int kTriangleBits = 28;

/// Of an end in the list of its edge, above the number of the next.
constexpr std::uint64_t kEnters = std::uint64_t{1} << 32, kFromFirst = std::uint64_t{2} << 32;

template <class Visit>
void for_each_bit(std::uint64_t bits, const Visit& visit) {
  for (; bits != 0; bits &= bits - 1) visit(static_cast<std::uint32_t>(std::countr_zero(bits)));
}

}  // namespace

std::uint32_t ExactParts::root(std::uint32_t element) noexcept {
  std::uint32_t* const parent = scratch_.parent.get();
  while (parent[element] != element) {
    parent[element] = parent[parent[element]];
    element = parent[element];
  }
  return element;
}

/// The lower number stays the root, so that parts do not depend on the order.
void ExactParts::unite(std::uint32_t x, std::uint32_t y) noexcept {
  x = root(x);
  y = root(y);
  if (x != y) scratch_.parent[std::max(x, y)] = std::min(x, y);
}

std::uint32_t ExactParts::vertex_element(const Side& own, const CrossedBlock& crossed,
                                         std::uint32_t vertex) const noexcept {
  const auto place = static_cast<std::uint32_t>(&crossed - own.marks.blocks.get());
  return (own.is_b ? vertices_of_b_ : out_.crossings) + kWidth * place + vertex;
}

std::uint32_t ExactParts::first_middle(const Side& own, std::uint32_t place) const noexcept {
  return 3 * kWidth * ((own.is_b ? sides_[0].marks.count : 0) + place);
}

std::uint32_t ExactParts::block_element(const Side& own, std::uint32_t block) const noexcept {
  return (own.is_b ? blocks_of_b_ : blocks_of_a_) + block;
}

std::uint32_t ExactParts::triangle_element(const Side& own, const CrossedBlock& crossed,
                                           std::uint32_t t) const noexcept {
  if (one_) return 0;
  const std::uint32_t edge = 3 * t + opposite_edge(crossed, t);
  if (crossed.pierced >> edge & 1)
    return scratch_.middles[first_middle(own, own.marks.place[crossed.block]) + edge];
  return vertex_element(own, crossed, own.mesh.blocks[crossed.block].corner[edge % 3][t]);
}

/// Each element by itself, and no end in the list of an edge.
void ExactParts::begin() noexcept {
  vertices_of_b_ = out_.crossings + kWidth * sides_[0].marks.count;
  blocks_of_a_ = vertices_of_b_ + kWidth * sides_[1].marks.count;
  blocks_of_b_ = blocks_of_a_ + sides_[0].mesh.level[0].count;
  const auto alone = [&](std::uint32_t element) {
    scratch_.parent[element] = element;
    scratch_.part[element] = kNoIndex;
  };
  for (std::uint32_t i = 0; i < blocks_of_a_; ++i) alone(i);
  for (const Side& own : sides_)
    for_each_block(own.marks.inside, own.mesh.level[0].count,
                   [&](std::uint32_t block) { alone(block_element(own, block)); });
  for (const Side& own : sides_)
    for (std::uint32_t c = 0; c < own.marks.count; ++c) {
      const CrossedBlock& crossed = own.marks.blocks[c];
      for_each_bit(crossed.pierced, [&](std::uint32_t edge) {
        scratch_.middles[first_middle(own, c) + edge] = kNoIndex;
      });
    }
}

/// Segments that end at the same place go on in each other: it is an edge of one triangle and
/// another that shares the edge, against one of the other solid. A table finds it by its name.
void ExactParts::join_curves() noexcept {
  PiercedEnd* const ends = scratch_.ends.get();
  std::uint64_t* const table = scratch_.keys.get();  // numbers of ends, from 1
  std::uint64_t* const next = scratch_.other_keys.get();
  const std::uint32_t mask = std::bit_ceil(2 * out_.crossings + 1) - 1;
  std::fill_n(table, mask + 1, 0);
  for (std::uint32_t i = 0; i < 2 * out_.crossings; ++i) {
    const Crossings::End end = scratch_.crossings.end_of(i / 2, static_cast<int>(i % 2));
    Side& own = side(end.of_b);
    const MeshBlock& mesh = own.mesh.blocks[end.triangle / kWidth];
    const std::uint32_t lane = end.triangle % kWidth;
    const std::uint32_t place = own.marks.place[end.triangle / kWidth];
    std::uint32_t& first = scratch_.middles[first_middle(own, place) + 3 * lane + end.edge];
    next[i] = first | (end.enters ? kEnters : 0) | (end.from_first ? kFromFirst : 0);
    first = i;
    const std::uint32_t p = mesh.vertex[mesh.corner[end.edge][lane]],
                        q = mesh.vertex[mesh.corner[(end.edge + 1) % 3][lane]];
    const std::uint64_t edge = std::uint64_t{std::min(p, q)} << 32 | std::max(p, q);
    const std::uint32_t other = scratch_.crossings.triangle(end.of_b ? 0 : 1, i / 2);
    ends[i] = {edge, 0, i / 2, other, end.of_b};
    const std::uint64_t mixed =
        (edge ^ (std::uint64_t{other} << 20)) * 0x9e3779b97f4a7c15u + (end.of_b ? 1 : 0);
    std::uint64_t slot = (mixed ^ mixed >> 29) >> 3 & mask;
    for (; table[slot] != 0; slot = (slot + 1) & mask) {
      const PiercedEnd& found = ends[table[slot] - 1];
      if (found.edge == edge && found.other == other && found.of_b == end.of_b) break;
    }
    if (table[slot] != 0)
      unite(i / 2, ends[table[slot] - 1].crossing);
    else
      table[slot] = i + 1;
  }
}

/// A curve that lies in one triangle and goes round what is outside belongs to the narrowest one
/// there that goes around it, or to the triangle's corners.
void ExactParts::join_holes(Side& own) noexcept {
  const auto triangle_of = [&](std::uint32_t i) {
    return scratch_.crossings.triangle(own.is_b ? 1 : 0, i);
  };
  CurveExtent* const curves = scratch_.curves.get();
  std::uint32_t alone = 0;  // curves in one triangle
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    const std::uint32_t first = root(i);
    std::uint32_t& triangle = curves[first].triangle;
    if (first == i) {
      triangle = triangle_of(i);
      ++alone;
    } else if (triangle != kNoIndex && triangle != triangle_of(i)) {
      triangle = kNoIndex;
      --alone;
    }
  }
  if (alone == 0) return;
  by_names_ = false;
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    CurveExtent& curve = curves[root(i)];
    Point from, to;
    segment(i, from, to);
    if (root(i) == i) curve = {curve.triangle, from, from, {}};
    curve.low = {std::min(curve.low.x, from.x), std::min(curve.low.y, from.y),
                 std::min(curve.low.z, from.z)};
    curve.high = {std::max(curve.high.x, from.x), std::max(curve.high.y, from.y),
                  std::max(curve.high.z, from.z)};
    curve.area = curve.area + (own.is_b ? -1.0 : 1.0) * cross(from, to);
  }
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    const CurveExtent& hole = curves[i];
    if (root(i) != i || hole.triangle == kNoIndex) continue;
    const MeshBlock& mesh = own.mesh.blocks[hole.triangle / kWidth];
    const std::uint32_t lane = hole.triangle % kWidth;
    const CrossedBlock& block = crossed_block(own, hole.triangle);
    const Point corner = block.at(mesh.corner[0][lane]);
    const Point normal =
        cross(block.at(mesh.corner[1][lane]) - corner, block.at(mesh.corner[2][lane]) - corner);
    if (dot(hole.area, normal) >= 0) continue;
    std::uint32_t around = kNoIndex;
    double narrowest = HUGE_VAL;
    for (std::uint32_t j = 0; j < out_.crossings; ++j) {
      const CurveExtent& curve = curves[root(j)];
      if (triangle_of(j) != hole.triangle || root(j) == i) continue;
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
    else if (has(own.marks.inside, hole.triangle / kWidth))
      unite(i, block_element(own, hole.triangle / kWidth));
    else if (block.inside >> mesh.corner[0][lane] & 1)
      unite(i, vertex_element(own, block, mesh.corner[0][lane]));
  }
}

/// What an edge has inside joins what bounds it, end by end.
void ExactParts::join_edges() noexcept {
  for (Side& own : sides_)
    for (std::uint32_t c = 0; c < own.marks.count; ++c) {
      const CrossedBlock& crossed = own.marks.blocks[c];
      const MeshBlock& mesh = own.mesh.blocks[crossed.block];
      for_each_bit(crossed.pierced, [&](std::uint32_t edge) {
        // The triangle on its other side has the same ends.
        const std::uint32_t t = edge / 3;
        if (edge % 3 != opposite_edge(crossed, t) &&
            mesh.vertex[mesh.corner[edge % 3][t]] > mesh.vertex[mesh.corner[(edge + 1) % 3][t]])
          return;
        std::uint32_t& middle = scratch_.middles[first_middle(own, c) + edge];
        middle = join_edge(own, crossed, edge, middle);
      });
    }
}

/// Returns what the middle of the edge hangs together with. `first`: of the list of its ends.
///
/// Where copies coincide ends lie nearer to each other than they are known, and their order may say
/// that nothing is inside in the middle: the nearest end stands for it, so that sums lose nothing.
std::uint32_t ExactParts::join_edge(const Side& own, const CrossedBlock& crossed,
                                    std::uint32_t edge, std::uint32_t first) noexcept {
  PiercedEnd* const ends = scratch_.ends.get();
  std::uint32_t count = 0;
  for (std::uint32_t i = first; i != kNoIndex;) {
    const std::uint64_t next = scratch_.other_keys[i];
    ends[count++] = {next, scratch_.crossings.end(static_cast<int>(i % 2), Crossings::kT)[i / 2],
                     i / 2, 0, false};
    i = static_cast<std::uint32_t>(next);
  }
  by_names_ = by_names_ && count <= 2;
  if (count > 1)
    std::sort(ends, ends + count, [](const PiercedEnd& x, const PiercedEnd& y) {
      const bool first_half = (x.edge & kFromFirst) != 0;
      if (first_half != ((y.edge & kFromFirst) != 0)) return first_half;
      return x.t < y.t || (x.t == y.t && x.crossing < y.crossing);
    });
  const MeshBlock& mesh = own.mesh.blocks[crossed.block];
  const std::uint32_t p = mesh.corner[edge % 3][edge / 3],
                      q = mesh.corner[(edge + 1) % 3][edge / 3];
  std::uint32_t inside = crossed.inside >> p & 1 ? vertex_element(own, crossed, p) : kNoIndex;
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
  if (inside != kNoIndex && (crossed.inside >> q & 1) != 0)
    unite(inside, vertex_element(own, crossed, q));
  return middle != kNoIndex ? middle : nearest;
}

/// Vertices inside, along edges that nothing pierces and from block to block. A table finds those
/// that are one.
void ExactParts::join_vertices(Side& own) noexcept {
  const auto matters = [](const CrossedBlock& crossed) {
    return crossed.pierced != 0 && crossed.inside != 0;
  };
  int count = 0;
  for (std::uint32_t c = 0; c < own.marks.count; ++c)
    if (matters(own.marks.blocks[c])) count += std::popcount(own.marks.blocks[c].inside);
  std::uint64_t* const table = scratch_.keys.get();  // vertex and element
  const std::uint32_t mask = std::bit_ceil(2 * static_cast<std::uint32_t>(count) + 1) - 1;
  constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  std::fill_n(table, mask + 1, kEmpty);
  for (std::uint32_t c = 0; c < own.marks.count; ++c) {
    const CrossedBlock& crossed = own.marks.blocks[c];
    if (!matters(crossed)) continue;
    const MeshBlock& mesh = own.mesh.blocks[crossed.block];
    for (std::uint32_t edge = 0; edge < 3u * mesh.triangles; ++edge) {
      const std::uint32_t p = mesh.corner[edge % 3][edge / 3],
                          q = mesh.corner[(edge + 1) % 3][edge / 3];
      if ((crossed.pierced >> edge & 1) == 0 && (crossed.inside >> p & 1) != 0)
        unite(vertex_element(own, crossed, p), vertex_element(own, crossed, q));
    }
    for_each_bit(crossed.inside, [&](std::uint32_t v) {
      const std::uint32_t vertex = mesh.vertex[v], element = vertex_element(own, crossed, v);
      std::uint32_t slot = vertex * 2654435769u >> 7 & mask;
      while (table[slot] != kEmpty && table[slot] >> 32 != vertex) slot = (slot + 1) & mask;
      if (table[slot] == kEmpty)
        table[slot] = std::uint64_t{vertex} << 32 | element;
      else
        unite(element, static_cast<std::uint32_t>(table[slot]));
    });
  }
}

/// Blocks inside as a whole, with each other and with what is inside of crossed ones.
void ExactParts::join_blocks(Side& own) noexcept {
  const MeshTree& mesh = own.mesh;
  for_each_block(own.marks.inside, mesh.level[0].count, [&](std::uint32_t b) {
    const MeshBlock& block = mesh.blocks[b];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t other = mesh.neighbours[block.first_neighbour + k] / kWidth;
      if (has(own.marks.inside, other)) {
        if (other < b) unite(block_element(own, b), block_element(own, other));
      } else if (has(own.marks.pierced, other)) {
        const CrossedBlock& crossed = own.marks.blocks[own.marks.place[other]];
        const MeshBlock& beside = mesh.blocks[other];
        for (std::uint32_t v = 0; v < beside.vertices; ++v)
          if (std::find(block.vertex, block.vertex + block.vertices, beside.vertex[v]) !=
              block.vertex + block.vertices)
            unite(block_element(own, b), vertex_element(own, crossed, v));
      }
    }
  });
}

std::uint32_t ExactParts::part_of(std::uint32_t element) noexcept {
  if (one_) return 0;
  std::uint32_t& known = scratch_.part[element];
  if (known != kNoIndex) return known;
  std::uint32_t& part = scratch_.part[root(element)];
  if (part == kNoIndex) {
    part = std::min(parts_, ExactScratch::kMostParts - 1);
    if (part == parts_) {
      scratch_.parts[part] = {};
      scratch_.parts[part].kept = part;
      ++parts_;
    }
  }
  return known = part;
}

/// Of the names of crossings and of their ends, in their order, and of what is inside. They tell
/// what hangs together, unless an edge is pierced more than twice or a curve lies in one triangle.
std::uint64_t ExactParts::hash_of_names() const noexcept {
  std::uint64_t hash = out_.crossings;
  const auto mix = [&](std::uint64_t name) {
    hash = (hash ^ name) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  const Crossings& crossings = scratch_.crossings;
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    const auto edge = [&](int e) {
      return static_cast<std::uint64_t>(static_cast<int>(crossings.end(e, Crossings::kEdge)[i]));
    };
    mix(std::uint64_t{crossings.triangle(0, i)} << (kTriangleBits + 8) |
        std::uint64_t{crossings.triangle(1, i)} << 8 | edge(0) << 4 | edge(1));
  }
  for (const Side& own : sides_) {
    for (std::uint32_t c = 0; c < own.marks.count; ++c) {
      const CrossedBlock& crossed = own.marks.blocks[c];
      std::uint64_t apexes[2];
      std::memcpy(apexes, crossed.apex, sizeof apexes);
      for (const std::uint64_t name : {std::uint64_t{crossed.inside}, apexes[0], apexes[1]})
        mix(name);
    }
    for (std::uint32_t w = 0; w < (own.mesh.level[0].count + 63) / 64; ++w)
      mix(own.marks.inside[w]);
  }
  return std::max(hash, std::uint64_t{1});
}

void ExactParts::name_parts() noexcept {
  if (one_) {
    scratch_.parts[0] = {};
    parts_ = 1;
  }
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    ExactPart& part = scratch_.parts[part_of(i)];
    const std::uint64_t id = (std::uint64_t{scratch_.crossings.triangle(0, i)} << kTriangleBits |
                              scratch_.crossings.triangle(1, i)) +
                             1;
    part.id = part.id == 0 ? id : std::min(part.id, id);
  }
}

bool ExactParts::are_one() noexcept {
  bool one = parts_ == 1;
  for (Side& own : sides_) {
    if (!one) return false;
    for_each_block(own.marks.pierced, own.mesh.level[0].count, [&](std::uint32_t b) {
      const CrossedBlock& crossed = own.marks.blocks[own.marks.place[b]];
      std::int8_t whole[kWidth];
      count_triangles(own.mesh.blocks[b], crossed, whole);
      for (std::uint32_t t = 0; one && t < kWidth; ++t) {
        if (whole[t] == 0) continue;
        one = part_of(triangle_element(own, crossed, t)) == 0;
      }
    });
    for_each_block(own.marks.inside, own.mesh.level[0].count,
                   [&](std::uint32_t b) { one = one && part_of(block_element(own, b)) == 0; });
  }
  return one;
}

void ExactParts::sum_parts() noexcept {
  if (one_ && out_.sums.volume() > 0) {
    scratch_.parts[0].sums = out_.sums;
    return;
  }
  ExactTerms terms;
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    if (i % 8 == 0) crossing_terms(scratch_.crossings, i, out_.origin, terms);
    add_crossing_term(terms, i % 8, scratch_.parts[part_of(i)].sums);
  }
  for (Side& own : sides_) {
    for_each_block(own.marks.pierced, own.mesh.level[0].count, [&](std::uint32_t b) {
      const CrossedBlock& crossed = own.marks.blocks[own.marks.place[b]];
      const MeshBlock& mesh = own.mesh.blocks[b];
      std::int8_t whole[kWidth];
      count_triangles(mesh, crossed, whole);
      for (std::uint32_t t = 0; t < mesh.triangles; ++t) {
        if (t % 8 == 0) triangle_terms(crossed, whole, static_cast<int>(t / 8), terms);
        if (whole[t] == 0) continue;
        add_triangle_term(terms, t % 8,
                          scratch_.parts[part_of(triangle_element(own, crossed, t))].sums);
      }
    });
    for_each_block(own.marks.inside, own.mesh.level[0].count, [&](std::uint32_t b) {
      sum_lane(own, 1, b / kWidth, b % kWidth, scratch_.parts[part_of(block_element(own, b))].sums);
    });
  }
}

/// What is less than nothing is the wall of a cavity in a part: in the largest, as far as can be
/// told from sums.
void ExactParts::join_cavities() noexcept {
  std::uint32_t largest = 0;
  for (std::uint32_t p = 1; p < parts_; ++p)
    if (scratch_.parts[p].sums.volume() > scratch_.parts[largest].sums.volume()) largest = p;
  for (std::uint32_t p = 0; p < parts_; ++p)
    if (scratch_.parts[p].sums.volume() < 0) scratch_.parts[p].kept = largest;
}

void ExactParts::join() noexcept {
  begin();
  join_curves();
  for (Side& own : sides_) join_holes(own);
  join_edges();
  for (Side& own : sides_) join_vertices(own);
  for (Side& own : sides_) join_blocks(own);
}

std::uint32_t ExactParts::divide() noexcept {
  parts_ = 0;
  const std::uint64_t names = kept_ != nullptr ? hash_of_names() : 0;
  one_ = kept_ != nullptr && kept_->one == names;
  if (!one_) join();
  name_parts();
  if (!one_) {
    one_ = are_one();
    if (kept_ != nullptr) kept_->one = one_ && by_names_ ? names : 0;
  }
  sum_parts();
  join_cavities();
  return parts_;
}

std::uint32_t ExactParts::part_of_crossing(std::uint32_t i) noexcept {
  return scratch_.parts[part_of(i)].kept;
}

void ExactParts::segment(std::uint32_t i, Point& from, Point& to) const noexcept {
  from = scratch_.crossings.place_of(i, 0, out_.origin);
  to = scratch_.crossings.place_of(i, 1, out_.origin);
}

}  // namespace ist
