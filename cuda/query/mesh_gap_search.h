#pragma once

#include <cmath>
#include <cstdint>
#include <new>

#include "base/team.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/float_gaps.h"
#include "query/exact/box_gaps.h"
#include "query/exact/crossing.h"
#include "query/exact/mesh_gap.h"
#include "query/exact/overlap_formulas.h"

// The distance of two meshes by one team, as MeshGapSearch of query/exact/mesh_distance.cpp: depth
// first, the nearest child first. Two pairs of nodes are opened together: item k of 32 is child
// k % 16 of pair k / 16. Of two blocks the triangles that may be near enough are measured in
// floats, which bounds the distance from above; what may be as near waits to be measured in double.

namespace ist::gpu {

#define IST_FORMULA IST_HD inline
#include "query/exact/box_gap_formulas-inl.h"
#undef IST_FORMULA

/// What box formulas are written in.
template <class Number>
struct OneBoxGap {
  using T = Number;
  using V = Number;
  IST_HD static V set(T x) { return x; }
  IST_HD static V magnitude(V x) { return std::abs(x); }
  IST_HD static V lesser(V x, V y) { return x < y ? x : y; }
  IST_HD static V greater(V x, V y) { return x > y ? x : y; }
  IST_HD static bool all(bool x) { return x; }
};

constexpr int kMeshGapPairs = 2;  ///< opened together
constexpr int kMeshGapItems = kMeshGapPairs * static_cast<int>(kWidth);
/// What waits are groups of children, each deeper than the one below.
constexpr int kMeshGapRoom = kMeshGapItems * (2 * (kMaxLevels - 1) + 1);
constexpr std::uint32_t kMeshGapQueue = 96;  ///< pairs of triangles to be measured

constexpr std::uint32_t kMeshGapLeft = 32;  ///< of them what a search leaves at most

/// What a team that measures keeps at hand of a pair.
struct MeshGapPair {
  Similarity map[2];  ///< to A's frame, to B's
  MeshTree mesh[2];
  double reach;
  NearestTriangles best;
  exact::Point level;  ///< along which level faces are apart
  std::uint32_t crosses;
  std::uint32_t queue[kMeshGapQueue][2];  ///< pairs of triangles, 16 · block + lane
  float apart[kMeshGapQueue];             ///< what floats know of their distance: it is no less

  IST_HD exact::Point corner(int side, std::uint32_t triangle, int k) const {
    const MeshBlock& block = in_global_memory(mesh[side].blocks)[triangle / kWidth];
    return vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }
  /// In A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(map[0], at);
  }
};

/// And one that searches.
template <class Real>
struct MeshGapMemory : MeshGapPair {
  const FloatBlock* in_floats[2];
  Quad row[3];  ///< of the map to A's frame, the shift last
  BoxLook<Real, Real> look[2];
  float way[3][3];         ///< the axes of A's look
  double limit;            ///< what is farther decides nothing
  Real squared_limit;      ///< with what rounds
  Real limit_of_boxes[2];  ///< the same in the frames of A and B
  /// Of nodes that wait: MeshNode, of A's with a bit more if it is to be opened.
  std::uint32_t stack_a[kMeshGapRoom], stack_b[kMeshGapRoom];
  Real stack_squared[kMeshGapRoom];  ///< no nearer than that
  Real key[kMeshGapItems];
  ExactTriangle triangles[2][kWidth];  ///< their boxes along the axes of A's look
  float vertices[3][2][kWidth];        ///< of two blocks, A's frame
  std::uint8_t near[2][kWidth];        ///< triangles that may be near enough
  std::uint8_t met[kWidth * kWidth];   ///< pairs of them, 16 · A's + B's
  WayAxes axes[2];                     ///< as A's look has them, and B's

  // In floats: a coordinate in A's frame is off by so much of the reach at most.
  static constexpr float kPlacing = 1e-6f;

  IST_HD float reach_in_floats() const { return static_cast<float>(reach); }

  /// What floats do to distances of triangles, of the reach.
  static constexpr float kOff = 4 * kPlacing;
  IST_HD float limit_in_floats() const {
    return static_cast<float>(std::fmin(limit, 1e15)) * (1 + 4e-6f) + kOff * reach_in_floats();
  }

  IST_HD float along(int k, const float (&x)[3]) const {
    return std::fma(way[k][0], x[0], std::fma(way[k][1], x[1], way[k][2] * x[2]));
  }
  IST_HD static float squared_gap(float low, float high, float other_low, float other_high) {
    const float gap = std::fmax(0.0f, std::fmax(low - other_high, other_low - high));
    return gap * gap;
  }

  /// A triangle's plane; how high over it, times the length of its normal, all is too far.
  IST_HD float place_plane(const float (&t)[3][3], float far, float size, Quad& n) const {
    float u[3], v[3], longest = 0;
    for (int k = 0; k < 3; ++k) {
      u[k] = t[1][k] - t[0][k];
      v[k] = t[2][k] - t[0][k];
      longest += std::abs(u[k]) + std::abs(v[k]);
    }
    float squared = 0;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n.x[k] = std::fma(u[l], v[m], -(u[m] * v[l]));
      squared = std::fma(n.x[k], n.x[k], squared);
    }
    n.x[3] = -std::fma(n.x[0], t[0][0], std::fma(n.x[1], t[0][1], n.x[2] * t[0][2]));
    // Sides are off by what places their ends, the normal by that times the other side.
    return far * std::sqrt(squared) * (1 + 4e-6f) +
           8 * kPlacing * reach_in_floats() * longest * size;
  }

  IST_HD static bool reaches(const Quad& n, float margin, const float (&t)[3][3]) {
    float least = 1e38f, most = -1e38f;
    for (int k = 0; k < 3; ++k) {
      const float height =
          std::fma(n.x[0], t[k][0], std::fma(n.x[1], t[k][1], std::fma(n.x[2], t[k][2], n.x[3])));
      least = std::fmin(least, height);
      most = std::fmax(most, height);
    }
    return least <= margin && most >= -margin;
  }

  /// A point of B's frame.
  IST_HD void to_a(float (&x)[3]) const {
    const float own[3] = {x[0], x[1], x[2]};
    for (int axis = 0; axis < 3; ++axis) {
      const Quad m = row[axis];
      x[axis] =
          std::fma(m.x[0], own[0], std::fma(m.x[1], own[1], std::fma(m.x[2], own[2], m.x[3])));
    }
  }
};

/// By copies, so that the triangles themselves may stay in registers.
IST_HD_COLD bool triangles_cross(exact::Point a0, exact::Point a1, exact::Point a2, exact::Point b0,
                                 exact::Point b1, exact::Point b2) {
  return exact::cross_exactly({a0, a1, a2}, {b0, b1, b2});
}

/// Farther pairs decide nothing. By one lane.
template <class Real>
IST_HD void limit_to(MeshGapMemory<Real>& m, double distance) {
  constexpr double kMost = sizeof(Real) == 4 ? 5e37 : 1e307;
  const double scale = m.map[0].scale, squared = distance * distance;
  const auto rounded = [](double x) {
    return static_cast<Real>(std::fmin(x, kMost) * (1 + 4 * kGapRounding<Real>));
  };
  m.limit = distance;
  m.squared_limit = rounded(squared);
  m.limit_of_boxes[0] = m.squared_limit;
  m.limit_of_boxes[1] = rounded(squared / (scale * scale));
}

/// Solids are seen along the way from A to B from now on, unless it is zero.
template <class Real, class Team>
IST_HD_COLD void look_along(const Team& team, MeshGapMemory<Real>& memory, exact::Point way) {
  MeshGapMemory<Real>& m = *team.memory(&memory);
  const bool known = dot(way, way) > 0;
  if (team.lane() == 0) {
    m.axes[0] = known ? axes_along(way) : WayAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    m.axes[1] = seen_back(m.axes[0], m.map[1], m.map[0].scale);
  }
  team.sync();
  for (int k = team.lane(); k < 18; k += Team::kWidth) {
    const int side = k / 9, j = k % 9 / 3, axis = k % 3;
    const double along = (&m.axes[side].way[j].x)[axis];
    if (side == 0) m.way[j][axis] = static_cast<float>(along);
    if (known) m.look[side].turn(m.axes[side].way[j], along, j, axis);
  }
  team.sync();
}

/// Something is as near as this, that way.
template <class Real, class Team>
IST_HD void come_to(const Team& team, MeshGapMemory<Real>& m, double distance,
                    const exact::Point& between) {
  if (team.lane() == 0) limit_to(m, std::fmin(m.limit, distance));
  const double length = std::sqrt(dot(between, between));
  look_along<Real>(team, m, length > 0 ? (1 / length) * between : exact::Point{0, 0, 0});
}

/// Measures so many pairs of triangles of the queue, no more than the team is wide. Whether one is
/// nearer than all before.
template <class Team>
IST_HD bool measure_triangles(const Team& team, MeshGapPair& memory, std::uint32_t first,
                              std::uint32_t count) {
  MeshGapPair& m = *team.memory(&memory);
  const auto lane = static_cast<std::uint32_t>(team.lane());
  const bool has = lane < count;
  const std::uint32_t(&slot)[2] = m.queue[first + (has ? lane : 0)];
  const std::uint32_t of_a = slot[0], of_b = slot[1];
  exact::Flat a, b;
  for (int k = 0; k < 3; ++k) a.corner[k] = m.corner(0, of_a, k);
  for (int k = 0; k < 3; ++k) b.corner[k] = m.corner(1, of_b, k);
  exact::flatten(a);
  exact::flatten(b);
  bool unclear = false;
  const exact::NearestPoints found = exact::nearest_points(a, b, gap_slack(m.reach), unclear);
  const bool crosses =
      has && unclear &&
      triangles_cross(a.corner[0], a.corner[1], a.corner[2], b.corner[0], b.corner[1], b.corner[2]);
  const double squared = has ? found.squared : HUGE_VAL;
  const std::uint64_t name = has ? std::uint64_t{of_a} << 32 | of_b : NearestTriangles::kNone;
  NearestTriangles next = m.best;
  const double before = next.least;
  next.meet(team.min(squared));
  // Of those that are as near the lowest.
  const bool wants = has && next.wants(squared, name);
  const std::uint64_t lowest = team.min(wants ? name : NearestTriangles::kNone);
  const bool any_crosses = team.any(crosses);
  team.sync();  // all have read the best
  if (lane == 0) {
    m.best.least = next.least;
    m.best.alike = next.alike;
    if (any_crosses) m.crosses = 1;
  }
  if (wants && name == lowest) {
    m.best.set(squared, name, found.on_a, found.between);
    if (const double distance = std::sqrt(squared); distance > 0) {
      const exact::Point way = (1 / distance) * found.between;
      exact::Point level = way;
      level_with(a.corner, way, level);
      level_with(b.corner, way, level);
      m.level = level;
    }
  }
  team.sync();
  return next.least < before && !any_crosses;
}
/// Measures the last ones of the queue, of so many; how many are left. What seldom runs are
/// functions of their own: the search needs its registers, and the device its instruction cache.
template <class Real, class Team>
IST_HD_COLD std::uint32_t measure_last(const Team& team, MeshGapMemory<Real>& memory,
                                       std::uint32_t queued) {
  MeshGapMemory<Real>& m = *team.memory(&memory);
  constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  const std::uint32_t count = queued < kBatch ? queued : kBatch, left = queued - count;
  if (measure_triangles(team, m, left, count)) {
    const double distance = std::sqrt(m.best.least);
    const exact::Point between = m.best.between;
    team.sync();
    come_to<Real>(team, m,
                  sizeof(Real) == 4 ? distance + gap_slack(m.reach) : (1 - kGapsAlike) * distance,
                  between);
  }
  return left;
}

/// Appends a pair of triangles of each lane that `adds`, for which there is room; how many there
/// are.
template <class Team>
IST_HD std::uint32_t append(const Team& team, MeshGapPair& m, std::uint32_t queued, bool adds,
                            std::uint32_t a, std::uint32_t b, float apart) {
  int total = 0;
  const std::uint32_t at = queued + static_cast<std::uint32_t>(team.exclusive_count(adds, total));
  if (adds) {
    m.queue[at][0] = a;
    m.queue[at][1] = b;
    m.apart[at] = apart;
  }
  team.sync();
  return queued + static_cast<std::uint32_t>(total);
}

/// Leaves out of a queue of so many what is certain to be farther; how many are left.
template <class Team>
IST_HD_COLD std::uint32_t cull(const Team& team, MeshGapPair& memory, std::uint32_t count,
                               float far) {
  MeshGapPair& m = *team.memory(&memory);
  constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  std::uint32_t left = 0;
  IST_ROLLED
  for (std::uint32_t first = 0; first < count; first += kBatch) {
    const std::uint32_t k = first + static_cast<std::uint32_t>(team.lane());
    const std::uint32_t at = k < count ? k : first, a = m.queue[at][0], b = m.queue[at][1];
    const float apart = m.apart[at];
    team.sync();
    left = append(team, m, left, k < count && apart <= far, a, b, apart);
  }
  return left;
}

/// Whether all of two blocks is no nearer than the best, to rounding, and comes after it: so are
/// most pairs of level faces, which floats cannot tell from nearer ones. `squared`: the blocks are
/// no nearer.
template <class Team>
IST_HD_COLD bool cannot_answer(const Team& team, const MeshGapPair& m, std::uint32_t a,
                               std::uint32_t b, double squared) {
  const NearestTriangles& best = m.best;
  const std::uint64_t first = std::uint64_t{kWidth * a} << 32 | kWidth * b;
  if (!(best.pair < first)) return false;
  const double distance = std::sqrt(best.least);
  if (distance < 4 * best.rounding) return false;
  const double sooner = distance - 4 * float_gap_blur(m.reach);
  if (sooner > 0 && squared < 0.999 * (sooner * sooner)) return false;
  const exact::Point level = m.level;
  double last = -HUGE_VAL, next = HUGE_VAL;
  for (int k = team.lane(); k < kMeshGapItems; k += Team::kWidth) {
    const int side = k / static_cast<int>(kWidth);
    const MeshBlock& block = in_global_memory(m.mesh[side].blocks)[side == 0 ? a : b];
    const double along = dot(level, m.vertex(side, block.vertex[k % static_cast<int>(kWidth)]));
    if (side == 0)
      last = std::fmax(last, along);
    else
      next = std::fmin(next, along);
  }
  return team.min(next) - team.max(last) >= distance - 0.5 * best.rounding;
}

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

  /// Until all that is within the limit is met, or `most` pairs were opened.
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

  /// Measures the first triangles of both: what is stopped has an answer.
  IST_HD void begin() {
    queued_ = append(team_, m_, queued_, team_.lane() == 0, 0, 0, 0);
    measure_but(0);
  }
  /// Pairs of triangles that are left in the queue, kMeshGapLeft at most, unless the answer is
  /// there.
  IST_HD std::uint32_t queued() const { return done() ? 0 : queued_; }

  IST_HD bool stopped() const { return stopped_; }
  IST_HD std::uint32_t visits() const { return visits_; }
  IST_HD std::uint32_t tests() const { return tests_; }
  /// Squared: what waits is no nearer.
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

  /// The topmost below `top` that may still be near enough; −1: none is.
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

  /// Opens one or two pairs; their children go on top, the nearest last.
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

  /// Drops digits: level faces are equally near but for roundings, and then the lowest number is to
  /// come first.
  IST_HD static Real coarse(Real x) {
    if constexpr (sizeof(Real) == 4) return float_of(bits_of(x) & 0xfffff000u);
    return static_cast<Real>(
        float_of(bits_of(static_cast<float>(x < 1e37 ? x : 1e37)) & 0xfffff000u));
  }

  /// Child `lane` of the opened node of a pair that waits; whether it may be near enough.
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
    child.key = gap > 0 ? coarse(child.squared) : apart;
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

  /// The triangles of two blocks that may be near enough wait. `squared`: the blocks are no nearer.
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
        const bool is = k < rows * columns;
        const auto i = static_cast<std::uint32_t>(is ? k / columns : 0),
                   j = static_cast<std::uint32_t>(is ? k % columns : 0);
        queued_ = append(team_, m_, queued_, is, kWidth * a + i, kWidth * b + j, 0);
        measure_but(kBatch - 1);
      }
    }
  }

  /// Until no more than so many are in the queue, or the answer is there.
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
  /// The vertex of a block that the last byte names.
  IST_HD void vertex(int side, std::uint32_t name, float (&out)[3]) const {
    for (int k = 0; k < 3; ++k) out[k] = m_.vertices[k][side][name & 0xFF];
  }

  /// Of two blocks the triangles that may be within the limit of the other; and the limit, with all
  /// that floats are off by.
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
    // Most pairs of blocks end here, by the first axis.
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

  /// A triangle's plane, and how high over it, times the length of its normal, all is too far.
  IST_HD void place_plane(int side, float far, float size, ExactTriangle& out) const {
    const std::uint32_t name = out.name();
    float t[3][3];
    for (int k = 0; k < 3; ++k) vertex(side, name >> (8 + 8 * k), t[k]);
    out.margin() = m_.place_plane(t, far, size, out.plane);
  }
  /// Whether triangles may be so near: by their boxes, then by the planes of both.
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

  /// Whether a triangle of a side comes so near to another's plane.
  IST_HD bool reaches(const ExactTriangle& plane, std::uint32_t name, int side) const {
    float t[3][3];
    for (int k = 0; k < 3; ++k) vertex(side, name >> (8 + 8 * k), t[k]);
    return m_.reaches(plane.plane, plane.margin(), t);
  }
  /// Their pairs of triangles that may be near enough: how many.
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

  /// Of a team's width of these the nearest bound the distance; what may be as near waits.
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
    // Loops stay rolled: all of them at once crowd the device's instruction cache.
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
    // However they were found, between planes square to that way nothing is nearer.
    const single::Vec3 way = found.between;
    const float length = std::sqrt(dot(way, way)) * (1 + 1e-6f);
    float last = -1e30f, next = 1e30f;
    for (int c = 0; c < 3; ++c) {
      last = std::fmax(last, dot(way, corner(0, name_a, c)));
      next = std::fmin(next, dot(way, of_b[c]));
    }
    const float apart = length > 0 ? (next - last) / length : 0;
    queued_ = append(team_, m_, queued_, k < met && apart <= m_.limit_in_floats(), kWidth * a + i,
                     kWidth * b + j, apart);
    // Where floats tell no more, or what waits is in each other's way, doubles have to.
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
