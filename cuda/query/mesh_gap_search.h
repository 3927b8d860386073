#pragma once

#include <cmath>
#include <cstdint>
#include <new>

#include "cuda/query/mesh_gap_memory.h"

// The distance of two meshes by one team, like MeshGapSearch of query/exact/mesh_distance.cpp:
// depth first, the nearest child first. Two pairs of nodes are opened together: item k of 32 is
// child k % 16 of pair k / 16. Triangles of two blocks that may be near enough are measured in
// float, which bounds the distance from above. Pairs that may be the nearest are queued and
// measured in double.

namespace ist::gpu {

template <class Team, class Real>
class MeshGapSearch {
 public:
  /// Maps, meshes, reach and best of `memory` are set.
  IST_HD MeshGapSearch(const Team& team, MeshGapMemory<Real>& memory, const Vec3& toward)
      : team_(team), m_(memory) {
    const double blur = sizeof(Real) == 4 ? float_gap_blur(m_.reach) : gap_slack(m_.reach);
    for (int side = team_.lane(); side < 2; side += Team::kWidth)
      new (&m_.look[side])
          BoxLook<Real, Real>(m_.map[side], side == 0 ? blur : blur / m_.map[0].scale);
    for (int k = team_.lane(); k < 12; k += Team::kWidth)
      m_.row[k / 4].x[k % 4] =
          static_cast<float>(k % 4 < 3 ? m_.map[0].m[3 * (k / 4) + k % 4] : m_.map[0].t[k / 4]);
    team_.sync();
    look_along<Real>(team_, m_, toward);
  }

  /// Runs until everything within the limit is visited, or `most` pairs were opened.
  IST_HD void run(double limit, std::uint32_t most) {
    if (team_.lane() == 0) {
      limit_to(m_, limit);
      m_.stack_a[0] = word(MeshNode::at(m_.mesh[0].top, 0), true);
      m_.stack_b[0] = MeshNode::at(m_.mesh[1].top, 0).word;
      m_.stack_squared[0] = 0;
    }
    size_ = 1;
    team_.sync();
    while (!done()) {
      const int first = wanted_below(size_);
      size_ = first + 1;
      if (first < 0 || (stopped_ = visits_ >= most)) break;
      if (is_leaf(first)) {
        ++visits_;
        size_ = first;
        meet(node_a(first).number(), node_b(first).number(),
             static_cast<double>(m_.stack_squared[first]));
        continue;
      }
      int second = most - visits_ > 1 ? wanted_below(first) : -1;
      if (second >= 0 && is_leaf(second)) second = -1;
      visits_ += second >= 0 ? 2 : 1;
      size_ = second >= 0 ? second : first;
      open(first, second);
    }
    if constexpr (sizeof(Real) == 4) queued_ = cull(team_, m_, queued_, m_.limit_in_floats());
    measure_but(sizeof(Real) == 4 ? kMeshGapLeft : 0);
  }

  /// Measures the first triangles of both, so that a stopped search has an answer.
  IST_HD void begin() {
    queued_ = append(team_, m_, queued_, team_.lane() == 0, 0, 0, 0);
    measure_but(0);
  }
  /// The number of pairs of triangles left in the queue, at most kMeshGapLeft; 0 if the answer is
  /// known.
  IST_HD std::uint32_t queued() const { return done() ? 0 : queued_; }

  IST_HD bool stopped() const { return stopped_; }
  IST_HD std::uint32_t visits() const { return visits_; }
  IST_HD std::uint32_t tests() const { return tests_; }
  /// The squared distance below which no pending pair can be.
  IST_HD double left() const {
    Real least = kHuge;
    for (int k = team_.lane(); k < size_; k += Team::kWidth)
      least = m_.stack_squared[k] < least ? m_.stack_squared[k] : least;
    return static_cast<double>(team_.min(least));
  }

 private:
  static constexpr int kItemsALane = kMeshGapItems / Team::kWidth;
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static constexpr std::uint32_t kOpensA = 1u << 31;
  static constexpr Real kHuge = sizeof(Real) == 4 ? Real(5e37) : Real(1e307);  ///< squared
  static_assert(kMaxLevels <= 8 && kMeshGapQueue >= 3 * kBatch);

  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }
  IST_HD bool done() const { return m_.crosses != 0 || m_.best.least <= 0; }

  IST_HD static std::uint32_t word(MeshNode node, bool opens) {
    return node.word | (opens ? kOpensA : 0);
  }
  IST_HD MeshNode node_a(int k) const { return {m_.stack_a[k] & ~kOpensA}; }
  IST_HD MeshNode node_b(int k) const { return {m_.stack_b[k]}; }
  IST_HD bool is_leaf(int k) const { return node_a(k).level() == 0 && node_b(k).level() == 0; }
  IST_HD static bool opens_a(int level_a, int level_b, bool a_is_larger) {
    return level_b == 0 || (level_a > 0 && a_is_larger);
  }

  /// The topmost pending pair below `top` that may still be near enough; −1 if none is.
  IST_HD int wanted_below(int top) const {
    const Real limit = m_.squared_limit;
    for (; top > 0; top -= Team::kWidth) {
      const int k = top - 1 - team_.lane();
      int total = 0;
      const int lane = team_.first(k >= 0 && m_.stack_squared[k] <= limit, total);
      if (total > 0) return top - 1 - lane;
    }
    return -1;
  }

  struct Child {
    std::uint32_t a, b;
    Real squared, key;
    int place;  ///< −1: too far
  };

  /// Opens one or two pairs. Their children go on top of the stack, the nearest last.
  IST_HD void open(int first, int second) {
    Child child[kItemsALane] = {};
    int count = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int k = item(i) < static_cast<int>(kWidth) ? first : second;
      const bool near =
          k >= 0 && look_below(k, static_cast<std::uint32_t>(item(i)) % kWidth, child[i]);
      int total = 0;
      const int place = count + team_.exclusive_count(near, total);
      child[i].place = near ? place : -1;
      count += total;
    }
    team_.sync();
    for (int i = 0; i < kItemsALane; ++i)
      if (child[i].place >= 0) m_.key[child[i].place] = child[i].key;
    team_.sync();
    for (int i = 0; i < kItemsALane; ++i) {
      if (child[i].place < 0) continue;
      int at = size_;
      for (int k = 0; k < count; ++k) {
        const Real other = m_.key[k];
        at += other > child[i].key || (other == child[i].key && k > child[i].place) ? 1 : 0;
      }
      m_.stack_a[at] = child[i].a;
      m_.stack_b[at] = child[i].b;
      m_.stack_squared[at] = child[i].squared;
    }
    size_ += count;
    team_.sync();
  }

  /// Drops digits. Parallel faces are equally near except for rounding, and then the lowest number
  /// must come first.
  IST_HD static Real coarse(Real x) {
    if constexpr (sizeof(Real) == 4) return float_of(bits_of(x) & 0xfffff000u);
    return static_cast<Real>(
        float_of(bits_of(static_cast<float>(x < 1e37 ? (x > 0 ? x : 0) : 1e37)) & 0xfffff000u));
  }

  /// Tests child `lane` of the opened node of a pending pair. True if it may be near enough.
  IST_HD bool look_below(int pair, std::uint32_t lane, Child& child) const {
    const bool of_a = (m_.stack_a[pair] & kOpensA) != 0;
    const MeshNode a = node_a(pair), b = node_b(pair);
    const MeshNode node = of_a ? a : b, other = of_a ? b : a;
    const int side = of_a ? 0 : 1;
    const MeshTree::Level* const level = m_.mesh[side].level + node.level();
    if (lane >= level[-1].count - kWidth * node.number()) return false;
    const MiddleBox<Real> one = box_of<Real>(m_.mesh[1 - side], other.level(), other.number());
    const SeenBox<Real> seen = m_.look[side].see(one);
    const BoxBlock& from = in_global_memory(level->boxes)[node.number()];
    LaneBox<Real> box;
    float size = 0;
    for (int k = 0; k < 3; ++k) {
      box.low[k] = static_cast<Real>(from.low[k][lane]);
      box.high[k] = static_cast<Real>(from.high[k][lane]);
      box.normal[k] = static_cast<Real>(from.normal[k][lane]);
      size = std::fmax(size, from.high[k][lane] - from.low[k][lane]);
    }
    box.slab_low = static_cast<Real>(from.slab_low[lane]);
    box.slab_high = static_cast<Real>(from.slab_high[lane]);
    const Real scale = m_.look[0].scale, unit = of_a ? Real(1) : scale * scale;
    const Real limit = m_.limit_of_boxes[side];
    Real squared, apart;
    if (!measure_boxes<OneBoxGap<Real>>(m_.look[side], seen, box, limit, squared, apart) ||
        !(squared <= limit))
      return false;
    const Real gap = unit * (Real(1 - 2 * kGapRounding<Real>) * squared);
    const Real before = m_.stack_squared[pair];
    child.squared = gap > before ? gap : before;
    // Distances of solids that are far apart for their size differ in the last digits only.
    child.key = gap <= 0            ? apart
                : sizeof(Real) == 4 ? coarse(child.squared)
                                    : coarse(Real(1 - kGapsAlike) * child.squared - before);
    const MeshNode below = MeshNode::at(node.level() - 1, kWidth * node.number() + lane);
    const MeshNode next_a = of_a ? below : a, next_b = of_a ? b : below;
    Real longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::fmax(longest, 2 * one.half[k]);
    const Real own = static_cast<Real>(size) * (of_a ? Real(1) : scale);
    const Real others = longest * (of_a ? scale : Real(1));
    child.a =
        word(next_a, opens_a(next_a.level(), next_b.level(), of_a ? own >= others : others >= own));
    child.b = next_b.word;
    return true;
  }

  /// Queues the triangles of two blocks that may be near enough. `squared`: the blocks are no
  /// nearer.
  IST_HD void meet(std::uint32_t a, std::uint32_t b, double squared) {
    if (m_.best.pair != NearestTriangles::kNone && cannot_answer(team_, m_, a, b, squared)) return;
    if constexpr (sizeof(Real) == 4) {
      int rows = 0, columns = 0;
      const float far = place_blocks(a, b, rows, columns);
      const int met = meet_triangles(rows, columns, far);
      for (int first = 0; first < met && !done(); first += Team::kWidth)
        look_at_triangles(a, b, first, met);
    } else {
      const int rows = in_global_memory(m_.mesh[0].blocks)[a].triangles,
                columns = in_global_memory(m_.mesh[1].blocks)[b].triangles;
      for (int first = 0; first < rows * columns && !done(); first += Team::kWidth) {
        const int k = first + team_.lane();
        const auto i = static_cast<std::uint32_t>(k < rows * columns ? k / columns : 0),
                   j = static_cast<std::uint32_t>(k < rows * columns ? k % columns : 0);
        const bool is = k < rows * columns && may_be_near(kWidth * a + i, kWidth * b + j);
        queued_ = append(team_, m_, queued_, is, kWidth * a + i, kWidth * b + j, 0);
        measure_but(kBatch - 1);
      }
    }
  }

  /// True if triangles may be within the limit, by their extents along the axes.
  IST_HD bool may_be_near(std::uint32_t of_a, std::uint32_t of_b) const {
    double squared = 0;
    for (const exact::Point& axis : m_.axes[0].axis) {
      double low[2], high[2];
      for (int side = 0; side < 2; ++side) {
        const std::uint32_t name = side == 0 ? of_a : of_b;
        const double p = dot(axis, m_.corner(side, name, 0)),
                     q = dot(axis, m_.corner(side, name, 1)),
                     r = dot(axis, m_.corner(side, name, 2));
        low[side] = std::fmin(p, std::fmin(q, r));
        high[side] = std::fmax(p, std::fmax(q, r));
      }
      const double gap = std::fmax(0.0, std::fmax(low[1] - high[0], low[0] - high[1]));
      squared += gap * gap;
    }
    return squared <= static_cast<double>(m_.squared_limit);
  }

  /// Measures until at most `few` pairs are queued or the answer is known.
  IST_HD void measure_but(std::uint32_t few) {
    IST_ROLLED
    while (queued_ > few && !done()) {
      const std::uint32_t left = measure_last<Real>(team_, m_, queued_);
      tests_ += queued_ - left;
      queued_ = left;
    }
  }

  IST_HD single::Vec3 corner(int side, std::uint32_t name, int k) const {
    float x[3];
    vertex(side, name >> (8 + 8 * k), x);
    return {x[0], x[1], x[2]};
  }
  /// The vertex of a block that the last byte of `name` selects.
  IST_HD void vertex(int side, std::uint32_t name, float (&out)[3]) const {
    for (int k = 0; k < 3; ++k) out[k] = m_.vertices[k][side][name & 0xFF];
  }

  /// Lists the triangles of two blocks that may be within the limit of the other block. Returns the
  /// limit with all errors of floats.
  IST_HD float place_blocks(std::uint32_t a, std::uint32_t b, int& of_a, int& of_b) {
    const FloatBlock& block_a = in_global_memory(m_.in_floats[0])[a];
    const FloatBlock& block_b = in_global_memory(m_.in_floats[1])[b];
    constexpr float kFar = 1e30f;
    float low_a[3] = {kFar, kFar, kFar}, high_a[3] = {-kFar, -kFar, -kFar};
    float low_b[3] = {kFar, kFar, kFar}, high_b[3] = {-kFar, -kFar, -kFar};
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth), v = item(i) % static_cast<int>(kWidth);
      const FloatBlock& block = side == 0 ? block_a : block_b;
      float at[3] = {block.x[0][v], block.x[1][v], block.x[2][v]};
      if (side == 1) m_.to_a(at);
      for (int k = 0; k < 3; ++k) {
        m_.vertices[k][side][v] = at[k];
        const float x = m_.along(k, at);
        low_a[k] = std::fmin(low_a[k], side == 0 ? x : kFar);
        high_a[k] = std::fmax(high_a[k], side == 0 ? x : -kFar);
        low_b[k] = std::fmin(low_b[k], side == 1 ? x : kFar);
        high_b[k] = std::fmax(high_b[k], side == 1 ? x : -kFar);
      }
    }
    const float far = m_.limit_in_floats();
    // Most pairs of blocks are rejected here, by the first axis.
    float apart = 0, size = far;
    of_a = of_b = 0;
    for (int k = 0; k < 3; ++k) {
      low_a[k] = team_.min(low_a[k]), high_a[k] = team_.max(high_a[k]);
      low_b[k] = team_.min(low_b[k]), high_b[k] = team_.max(high_b[k]);
      apart += m_.squared_gap(low_a[k], high_a[k], low_b[k], high_b[k]);
      if (apart > far * far) {
        team_.sync();
        return far;
      }
      size += (high_a[k] - low_a[k]) + (high_b[k] - low_b[k]);
    }
    team_.sync();
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(item(i)) % kWidth;
      const std::uint32_t corners = (side == 0 ? block_a : block_b).corner[t];
      float p[3], q[3], r[3];
      vertex(side, corners, p);
      vertex(side, corners >> 8, q);
      vertex(side, corners >> 16, r);
      ExactTriangle& triangle = m_.triangles[side][t];
      triangle.call(t | corners << 8);
      float squared = 0;
      for (int k = 0; k < 3; ++k) {
        const float x = m_.along(k, p), y = m_.along(k, q), z = m_.along(k, r);
        const float low = std::fmin(x, std::fmin(y, z)), high = std::fmax(x, std::fmax(y, z));
        triangle.low.x[k] = low;
        triangle.high.x[k] = high;
        squared += m_.squared_gap(low, high, side == 0 ? low_b[k] : low_a[k],
                                  side == 0 ? high_b[k] : high_a[k]);
      }
      const bool near = corners >> 24 != 0 && squared <= far * far;
      int more_a = 0, more_b = 0;
      const int at_a = of_a + team_.exclusive_count(near && side == 0, more_a);
      const int at_b = of_b + team_.exclusive_count(near && side == 1, more_b);
      of_a += more_a;
      of_b += more_b;
      if (!near) continue;
      m_.near[side][side == 0 ? at_a : at_b] = static_cast<std::uint8_t>(t);
      place_plane(side, far, size, triangle);
    }
    team_.sync();
    return far;
  }

  /// Computes a triangle's plane, and the height above it, times the normal's length, beyond which
  /// everything is too far.
  IST_HD void place_plane(int side, float far, float size, ExactTriangle& out) const {
    const std::uint32_t name = out.name();
    float t[3][3];
    for (int k = 0; k < 3; ++k) vertex(side, name >> (8 + 8 * k), t[k]);
    out.margin() = m_.place_plane(t, far, size, out.plane);
  }
  /// True if triangles may be within `far`: by their boxes, then by both planes.
  IST_HD bool may_be_near(const ExactTriangle& a, const ExactTriangle& b, float far) const {
    return squared_gap(a, b) <= far * far && reaches(a, b.name(), 1) && reaches(b, a.name(), 0);
  }
  IST_HD static float squared_gap(const ExactTriangle& a, const ExactTriangle& b) {
    const Quad low_a = a.low, high_a = a.high, low_b = b.low, high_b = b.high;
    float squared = 0;
    for (int k = 0; k < 3; ++k)
      squared += MeshGapMemory<Real>::squared_gap(low_a.x[k], high_a.x[k], low_b.x[k], high_b.x[k]);
    return squared;
  }

  /// True if a triangle of a side may be that near to another's plane.
  IST_HD bool reaches(const ExactTriangle& plane, std::uint32_t name, int side) const {
    float t[3][3];
    for (int k = 0; k < 3; ++k) vertex(side, name >> (8 + 8 * k), t[k]);
    return m_.reaches(plane.plane, plane.margin(), t);
  }
  /// Lists the pairs of triangles that may be near enough, and returns their number.
  IST_HD int meet_triangles(int rows, int columns, float far) {
    const int pairs = rows * columns;
    int met = 0;
    for (int first = 0; first < pairs; first += Team::kWidth) {
      const int k = first + team_.lane();
      const int row = k < pairs ? k / columns : 0, column = k < pairs ? k - row * columns : 0;
      const std::uint32_t i = m_.near[0][row], j = m_.near[1][column];
      const bool meets = k < pairs && may_be_near(m_.triangles[0][i], m_.triangles[1][j], far);
      int total = 0;
      const int before = team_.exclusive_count(meets, total);
      if (meets) m_.met[met + before] = static_cast<std::uint8_t>(kWidth * i + j);
      met += total;
    }
    team_.sync();
    return met;
  }

  /// Measures a team's width of these in float. The nearest bounds the distance, and pairs that may
  /// be as near are queued.
  IST_HD void look_at_triangles(std::uint32_t a, std::uint32_t b, int first, int met) {
    const int k = first + team_.lane();
    const std::uint32_t pair = m_.met[k < met ? k : first];
    const std::uint32_t i = pair / kWidth, j = pair % kWidth;
    const std::uint32_t name_a = m_.triangles[0][i].name(), name_b = m_.triangles[1][j].name();
    single::Vec3 of_b[3], side_b[3];
    float inverse_b[3];
    for (int c = 0; c < 3; ++c) of_b[c] = corner(1, name_b, c);
    for (int c = 0; c < 3; ++c) side_b[c] = of_b[(c + 1) % 3] - of_b[c];
    for (int c = 0; c < 3; ++c) inverse_b[c] = single::inverse_of(dot(side_b[c], side_b[c]));
    const single::Face face_b(of_b[0], side_b[0], of_b[2] - of_b[0]);
    const single::Vec3 first_a = corner(0, name_a, 0);
    const single::Face face_a(first_a, corner(0, name_a, 1) - first_a,
                              corner(0, name_a, 2) - first_a);
    single::NearestPoints found = {HUGE_VALF, {}, {}};
    // Loops stay rolled: unrolled code would fill the instruction cache.
    IST_ROLLED
    for (int c = 0; c < 3; ++c) {
      const single::Vec3 from = corner(0, name_a, c),
                         u = corner(0, name_a, c < 2 ? c + 1 : 0) - from;
      const float inverse = single::inverse_of(dot(u, u));
      for (int e = 0; e < 3; ++e)
        single::along_edges(from, u, inverse, of_b[e], side_b[e], inverse_b[e], found);
      face_b.take<true>(from, found);
      face_a.take<false>(corner(1, name_b, c), found);
    }
    const float least = team_.min(found.squared);
    const double distance = std::sqrt(static_cast<double>(least)) + double{m_.kOff} * m_.reach;
    if (distance < m_.limit) {
      int total = 0;
      const int lane = team_.first(found.squared <= least, total);
      const exact::Point between = {double{team_.broadcast(found.between.x, lane)},
                                    double{team_.broadcast(found.between.y, lane)},
                                    double{team_.broadcast(found.between.z, lane)}};
      team_.sync();
      come_to<Real>(team_, m_, distance, between);
    }
    // Nothing is nearer between planes perpendicular to that direction, however the points were
    // found.
    const single::Vec3 between = found.between;
    const float length = std::sqrt(dot(between, between)) * (1 + 1e-6f);
    float last = -1e30f, next = 1e30f;
    for (int c = 0; c < 3; ++c) {
      last = std::fmax(last, dot(between, corner(0, name_a, c)));
      next = std::fmin(next, dot(between, of_b[c]));
    }
    const float apart = length > 0 ? (next - last) / length : 0;
    queued_ = append(team_, m_, queued_, k < met && apart <= m_.limit_in_floats(), kWidth * a + i,
                     kWidth * b + j, apart);
    // If floats no longer decide, or the queue is full, pairs are measured in double.
    const bool touches = m_.limit <= 2 * double{m_.kOff} * m_.reach;
    if (!touches && queued_ + kBatch <= kMeshGapQueue) return;
    if (!touches) queued_ = cull(team_, m_, queued_, m_.limit_in_floats());
    const std::uint32_t few = touches ? 0 : queued_ + kBatch <= kMeshGapQueue ? queued_ : kBatch;
    measure_but(few);
  }

  const Team& team_;
  MeshGapMemory<Real>& m_;
  int size_ = 0;
  std::uint32_t visits_ = 0, tests_ = 0;
  std::uint32_t queued_ = 0;
  bool stopped_ = false;
};

}  // namespace ist::gpu
