#pragma once

#include <cmath>
#include <cstdint>
#include <new>

#include "cuda/query/exact_memory.h"
#include "numerics/team.h"
#include "query/exact/box_gaps.h"
#include "query/exact/crossing.h"
#include "query/exact/mesh_gap.h"
#include "query/exact/overlap_formulas.h"

// The distance of two meshes by one team, as MeshGapSearch of query/exact/mesh_distance.cpp: depth
// first, the nearest child first. Two pairs of nodes are opened together: item k of 32 is child
// k % 16 of pair k / 16. Of two blocks the triangles that may be near enough wait, until a team's
// width of them is measured in double.

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
constexpr std::uint32_t kMeshGapQueue = 64;  ///< pairs of triangles to be measured

/// What a team keeps at hand of a pair.
template <class Real>
struct MeshGapMemory {
  Similarity map[2];  ///< to A's frame, to B's
  MeshTree mesh[2];
  const FloatBlock* in_floats[2];
  Quad row[3];  ///< of the map to A's frame, the shift last
  BoxLook<Real> look[2];
  float way[3][3];     ///< the axes of A's look
  exact::Point level;  ///< along which level faces are apart
  NearestTriangles best;
  double reach;
  double limit, squared_limit;  ///< what is farther decides nothing
  std::uint32_t crosses;
  /// Of nodes that wait: MeshNode, of A's with a bit more if it is to be opened.
  std::uint32_t stack_a[kMeshGapRoom], stack_b[kMeshGapRoom];
  Real stack_squared[kMeshGapRoom];  ///< no nearer than that
  Real key[kMeshGapItems];
  ExactTriangle triangles[2][kWidth];  ///< their boxes along the axes of A's look
  float vertices[3][2][kWidth];        ///< of two blocks, A's frame
  std::uint8_t near[2][kWidth];        ///< triangles that may be near enough
  std::uint32_t queue[kMeshGapQueue][2];

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

/// By copies, so that the triangles themselves may stay in registers.
IST_HD_COLD bool triangles_cross(exact::Point a0, exact::Point a1, exact::Point a2, exact::Point b0,
                                 exact::Point b1, exact::Point b2) {
  return exact::cross_exactly({a0, a1, a2}, {b0, b1, b2});
}

/// Farther pairs decide nothing. By one lane.
template <class Real>
IST_HD void limit_to(MeshGapMemory<Real>& m, double distance) {
  m.limit = distance;
  m.squared_limit = distance * distance;
}

/// Solids are seen along the way from A to B from now on, unless it is zero.
template <class Team, class Real>
IST_HD void look_along(const Team& team, MeshGapMemory<Real>& m, const exact::Point& way) {
  const bool known = dot(way, way) > 0;
  const WayAxes axes = known ? axes_along(way) : WayAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const WayAxes back = seen_back(axes, m.map[1], m.map[0].scale);
  for (int k = team.lane(); k < 18; k += Team::kWidth) {
    const int j = k % 9 / 3, axis = k % 3;
    if (k < 9) m.way[j][axis] = static_cast<float>(axes.way[j][axis]);
    if (known) m.look[k / 9].turn(k < 9 ? axes : back, j, axis);
  }
  team.sync();
}

/// Measures the next so many pairs of triangles that wait, no more than the team is wide. A
/// function of its own: the search needs its registers.
template <class Real, class Team>
IST_HD_COLD void measure_triangles(const Team& team, MeshGapMemory<Real>& memory,
                                   std::uint32_t first, std::uint32_t count) {
  MeshGapMemory<Real>& m = *team.memory(&memory);
  const auto lane = static_cast<std::uint32_t>(team.lane());
  const bool has = lane < count;
  const std::uint32_t(&slot)[2] = m.queue[(first + (has ? lane : 0)) % kMeshGapQueue];
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
  const std::uint64_t wanted = team.min(wants ? name : NearestTriangles::kNone);
  const bool any_crosses = team.any(crosses);
  team.sync();  // all have read the best
  if (lane == 0) {
    m.best.least = next.least;
    m.best.alike = next.alike;
    if (any_crosses) m.crosses = 1;
  }
  if (wants && name == wanted) m.best.set(squared, name, found.on_a, found.between);
  team.sync();
  if (any_crosses || !(next.least < before)) return;
  const double distance = std::sqrt(next.least);
  if (lane == 0)
    limit_to(m, std::fmin(m.limit, sizeof(Real) == 4 ? distance + gap_slack(m.reach)
                                                     : (1 - kGapsAlike) * distance));
  if (!(distance > 0)) {
    team.sync();
    return;
  }
  const exact::Point toward = (1 / distance) * m.best.between;
  if (lane == 0) m.level = toward;
  look_along(team, m, toward);
  if (wants && name == wanted) {
    exact::Point level = toward;
    level_with(a.corner, toward, level);
    level_with(b.corner, toward, level);
    m.level = level;
  }
  team.sync();
}

template <class Team, class Real>
class MeshGapSearch {
 public:
  /// Maps, meshes, reach and best of `memory` are set.
  IST_HD MeshGapSearch(const Team& team, MeshGapMemory<Real>& memory, const Vec3& toward)
      : team_(team), m_(memory) {
    const double blur = sizeof(Real) == 4 ? float_gap_blur(m_.reach) : gap_slack(m_.reach);
    if (team_.lane() == 0) new (&m_.look[0]) BoxLook<Real>(m_.map[0], blur);
    if (team_.lane() == Team::kWidth - 1)
      new (&m_.look[1]) BoxLook<Real>(m_.map[1], blur / m_.map[0].scale);
    for (int k = team_.lane(); k < 12; k += Team::kWidth)
      m_.row[k / 4].x[k % 4] =
          static_cast<float>(k % 4 < 3 ? m_.map[0].m[3 * (k / 4) + k % 4] : m_.map[0].t[k / 4]);
    if (team_.lane() == 0) m_.crosses = 0, m_.level = {0, 0, 0};
    team_.sync();
    look_along(team_, m_, toward);
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
        if (queued_ > kFew) measure_waiting();
        continue;
      }
      int second = most - visits_ > 1 ? wanted_below(first) : -1;
      if (second >= 0 && is_leaf(second)) second = -1;
      visits_ += second >= 0 ? 2 : 1;
      size_ = second >= 0 ? second : first;
      open(first, second);
    }
    measure_waiting();
  }

  /// Measures the first triangles of both: what is stopped has an answer.
  IST_HD void begin() {
    queue(team_.lane() == 0, 0, 0);
    measure_waiting();
  }

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
  static_assert(kMaxLevels <= 8 && kMeshGapQueue >= 2 * kBatch);
  /// Pairs of triangles that wait for others: a limit that is known sooner saves more.
  static constexpr std::uint32_t kFew = 4;

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
    const double limit = m_.squared_limit;
    for (; top > 0; top -= Team::kWidth) {
      const int k = top - 1 - team_.lane();
      int total = 0;
      const int lane =
          team_.first(k >= 0 && static_cast<double>(m_.stack_squared[k]) <= limit, total);
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
  IST_HD static Real coarse(double x) {
    const auto single = static_cast<float>(x < 1e37 ? x : 1e37);
    return static_cast<Real>(float_of(bits_of(single) & 0xfffff000u));
  }

  /// Child `lane` of the opened node of a pair that waits; whether it may be near enough.
  IST_HD bool look_below(int pair, std::uint32_t lane, Child& child) const {
    const bool of_a = (m_.stack_a[pair] & kOpensA) != 0;
    const MeshNode a = node_a(pair), b = node_b(pair);
    const MeshNode node = of_a ? a : b, other = of_a ? b : a;
    const int side = of_a ? 0 : 1;
    const MeshTree::Level* const level = m_.mesh[side].level + node.level();
    if (lane >= level[-1].count - kWidth * node.number()) return false;
    const MiddleBox one = box_of(m_.mesh[1 - side], other.level(), other.number());
    const SeenBox seen = m_.look[side].see(m_.map[side], one);
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
    const double scale = m_.map[0].scale, unit = of_a ? 1 : scale * scale;
    const double limit = m_.squared_limit / unit;
    const auto beyond = static_cast<Real>(std::fmin(limit, static_cast<double>(kHuge)) *
                                          (1 + 4 * kGapRounding<Real>));
    Real squared, apart;
    if (!measure_boxes<OneBoxGap<Real>>(m_.look[side], seen, box, beyond, squared, apart) ||
        !(squared <= beyond))
      return false;
    const double gap = unit * ((1 - 2 * kGapRounding<Real>)*static_cast<double>(squared));
    if (gap > m_.squared_limit) return false;
    const auto least = static_cast<Real>(gap), before = m_.stack_squared[pair];
    child.squared = least > before ? least : before;
    child.key = gap > 0 ? coarse(static_cast<double>(child.squared)) : apart;
    const MeshNode below = MeshNode::at(node.level() - 1, kWidth * node.number() + lane);
    const MeshNode next_a = of_a ? below : a, next_b = of_a ? b : below;
    double longest = 0;
    for (int k = 0; k < 3; ++k) longest = std::fmax(longest, 2 * one.half[k]);
    const double own = static_cast<double>(size) * (of_a ? 1 : scale);
    const double others = longest * (of_a ? scale : 1);
    child.a =
        word(next_a, opens_a(next_a.level(), next_b.level(), of_a ? own >= others : others >= own));
    child.b = next_b.word;
    return true;
  }

  /// Whether all of two blocks is no nearer than the best, to rounding, and comes after it: so are
  /// most pairs of level faces, which floats cannot tell from nearer ones.
  IST_HD bool cannot_answer(std::uint32_t a, std::uint32_t b, double squared) const {
    const NearestTriangles& best = m_.best;
    const std::uint64_t first = std::uint64_t{kWidth * a} << 32 | kWidth * b;
    if (!(best.pair < first)) return false;
    const double distance = std::sqrt(best.least);
    if (distance < 4 * best.rounding) return false;
    const double sooner = distance - 4 * float_gap_blur(m_.reach);
    if (sooner > 0 && squared < 0.999 * (sooner * sooner)) return false;
    const exact::Point level = m_.level;
    double last = -HUGE_VAL, next = HUGE_VAL;
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth);
      const MeshBlock& block = in_global_memory(m_.mesh[side].blocks)[side == 0 ? a : b];
      const exact::Point x = m_.vertex(side, block.vertex[item(i) % static_cast<int>(kWidth)]);
      const double along = dot(level, x);
      if (side == 0)
        last = std::fmax(last, along);
      else
        next = std::fmin(next, along);
    }
    return team_.min(next) - team_.max(last) >= distance - 0.5 * best.rounding;
  }

  /// The triangles of two blocks that may be near enough wait. `squared`: the blocks are no nearer.
  IST_HD void meet(std::uint32_t a, std::uint32_t b, double squared) {
    if (cannot_answer(a, b, squared)) return;
    int rows, columns;
    float far = 0;
    if constexpr (sizeof(Real) == 4) {
      far = place_blocks(a, b, rows, columns);
    } else {
      rows = in_global_memory(m_.mesh[0].blocks)[a].triangles;
      columns = in_global_memory(m_.mesh[1].blocks)[b].triangles;
    }
    const int pairs = rows * columns;
    for (int first = 0; first < pairs && !done(); first += Team::kWidth) {
      const int k = first + team_.lane();
      bool waits = k < pairs;
      std::uint32_t i = waits ? static_cast<std::uint32_t>(k / columns) : 0;
      std::uint32_t j =
          waits ? static_cast<std::uint32_t>(k) - i * static_cast<std::uint32_t>(columns) : 0;
      if constexpr (sizeof(Real) == 4) {
        i = m_.near[0][i];
        j = m_.near[1][j];
        waits = waits && may_be_near(m_.triangles[0][i], m_.triangles[1][j], far);
      }
      queue(waits, kWidth * a + i, kWidth * b + j);
    }
  }

  /// Appends a pair of triangles of each lane that `adds`.
  IST_HD void queue(bool adds, std::uint32_t a, std::uint32_t b) {
    int total = 0;
    const auto before = static_cast<std::uint32_t>(team_.exclusive_count(adds, total));
    if (adds) {
      std::uint32_t(&slot)[2] = m_.queue[(head_ + queued_ + before) % kMeshGapQueue];
      slot[0] = a;
      slot[1] = b;
    }
    queued_ += static_cast<std::uint32_t>(total);
    team_.sync();
    if (queued_ >= kBatch) measure(kBatch);
  }
  IST_HD void measure_waiting() {
    while (queued_ > 0 && !done()) measure(queued_ < kBatch ? queued_ : kBatch);
  }
  IST_HD void measure(std::uint32_t count) {
    const std::uint32_t first = head_;
    head_ = (head_ + count) % kMeshGapQueue;
    queued_ -= count;
    tests_ += count;
    measure_triangles<Real>(team_, m_, first, count);
  }

  // In floats: a coordinate in A's frame is off by so much of the reach at most.
  static constexpr float kPlacing = 1e-6f;

  IST_HD float reach() const { return static_cast<float>(m_.reach); }

  /// The vertex of a block that the last byte names.
  IST_HD void vertex(int side, std::uint32_t name, float (&out)[3]) const {
    for (int k = 0; k < 3; ++k) out[k] = m_.vertices[k][side][name & 0xFF];
  }

  /// Of two blocks the triangles that may be within the limit of the other; and the limit, with all
  /// that floats are off by.
  IST_HD float place_blocks(std::uint32_t a, std::uint32_t b, int& of_a, int& of_b) {
    const FloatBlock& block_a = in_global_memory(m_.in_floats[0])[a];
    const FloatBlock& block_b = in_global_memory(m_.in_floats[1])[b];
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth), v = item(i) % static_cast<int>(kWidth);
      const FloatBlock& block = side == 0 ? block_a : block_b;
      float at[3] = {block.x[0][v], block.x[1][v], block.x[2][v]};
      if (side == 1) {
        const float own[3] = {at[0], at[1], at[2]};
        for (int axis = 0; axis < 3; ++axis) {
          const Quad m = m_.row[axis];
          at[axis] =
              std::fma(m.x[0], own[0], std::fma(m.x[1], own[1], std::fma(m.x[2], own[2], m.x[3])));
        }
      }
      for (int axis = 0; axis < 3; ++axis) m_.vertices[axis][side][v] = at[axis];
    }
    team_.sync();
    constexpr float kFar = 1e30f;
    float low_a[3] = {kFar, kFar, kFar}, high_a[3] = {-kFar, -kFar, -kFar};
    float low_b[3] = {kFar, kFar, kFar}, high_b[3] = {-kFar, -kFar, -kFar};
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(item(i)) % kWidth;
      const std::uint32_t corners = (side == 0 ? block_a : block_b).corner[t];
      float p[3], q[3], r[3];
      vertex(side, corners, p);
      vertex(side, corners >> 8, q);
      vertex(side, corners >> 16, r);
      const bool is = corners >> 24 != 0;
      ExactTriangle& out = m_.triangles[side][t];
      out.call(t | corners << 8);
      for (int k = 0; k < 3; ++k) {
        const float x = along(k, p), y = along(k, q), z = along(k, r);
        const float low = is ? std::fmin(x, std::fmin(y, z)) : kFar,
                    high = is ? std::fmax(x, std::fmax(y, z)) : -kFar;
        out.low.x[k] = low;
        out.high.x[k] = high;
        low_a[k] = std::fmin(low_a[k], side == 0 ? low : kFar);
        high_a[k] = std::fmax(high_a[k], side == 0 ? high : -kFar);
        low_b[k] = std::fmin(low_b[k], side == 1 ? low : kFar);
        high_b[k] = std::fmax(high_b[k], side == 1 ? high : -kFar);
      }
    }
    float size = 0;
    for (int k = 0; k < 3; ++k) {
      low_a[k] = team_.min(low_a[k]), high_a[k] = team_.max(high_a[k]);
      low_b[k] = team_.min(low_b[k]), high_b[k] = team_.max(high_b[k]);
      size += (high_a[k] - low_a[k]) + (high_b[k] - low_b[k]);
    }
    team_.sync();
    const float off = 4 * kPlacing * reach();
    const float far = static_cast<float>(std::fmin(m_.limit, 1e15)) * (1 + 4e-6f) + off;
    size += far;
    of_a = of_b = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int side = item(i) / static_cast<int>(kWidth);
      const auto t = static_cast<std::uint32_t>(item(i)) % kWidth;
      ExactTriangle& triangle = m_.triangles[side][t];
      float squared = 0;
      for (int k = 0; k < 3; ++k) {
        const float low = side == 0 ? low_b[k] : low_a[k], high = side == 0 ? high_b[k] : high_a[k];
        squared += squared_gap(triangle.low.x[k], triangle.high.x[k], low, high);
      }
      const bool is = triangle.low.x[0] <= triangle.high.x[0];
      const bool near = is && squared <= far * far;
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

  IST_HD float along(int k, const float (&x)[3]) const {
    return std::fma(m_.way[k][0], x[0], std::fma(m_.way[k][1], x[1], m_.way[k][2] * x[2]));
  }
  IST_HD static float squared_gap(float low, float high, float other_low, float other_high) {
    const float gap = std::fmax(0.0f, std::fmax(low - other_high, other_low - high));
    return gap * gap;
  }

  /// A triangle's plane, and how high over it, times the length of its normal, all is too far.
  IST_HD void place_plane(int side, float far, float size, ExactTriangle& out) const {
    const std::uint32_t name = out.name();
    float p[3], q[3], r[3], u[3], v[3], longest = 0;
    vertex(side, name >> 8, p);
    vertex(side, name >> 16, q);
    vertex(side, name >> 24, r);
    for (int k = 0; k < 3; ++k) {
      u[k] = q[k] - p[k];
      v[k] = r[k] - p[k];
      longest += std::abs(u[k]) + std::abs(v[k]);
    }
    Quad& n = out.plane;
    float squared = 0;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      n.x[k] = std::fma(u[l], v[m], -(u[m] * v[l]));
      squared = std::fma(n.x[k], n.x[k], squared);
    }
    n.x[3] = -std::fma(n.x[0], p[0], std::fma(n.x[1], p[1], n.x[2] * p[2]));
    // Sides are off by what places their ends, the normal by that times the other side.
    out.margin() = far * std::sqrt(squared) * (1 + 4e-6f) + 8 * kPlacing * reach() * longest * size;
  }

  /// Whether triangles may be so near: by their boxes, then by the planes of both.
  IST_HD bool may_be_near(const ExactTriangle& a, const ExactTriangle& b, float far) const {
    const Quad low_a = a.low, high_a = a.high, low_b = b.low, high_b = b.high;
    float squared = 0;
    for (int k = 0; k < 3; ++k)
      squared += squared_gap(low_a.x[k], high_a.x[k], low_b.x[k], high_b.x[k]);
    return squared <= far * far && reaches(a, b.name(), 1) && reaches(b, a.name(), 0);
  }

  /// Whether a triangle of a side comes so near to another's plane.
  IST_HD bool reaches(const ExactTriangle& plane, std::uint32_t name, int side) const {
    const Quad n = plane.plane;
    float least = 1e38f, most = -1e38f;
    for (int k = 0; k < 3; ++k) {
      float x[3];
      vertex(side, name >> (8 + 8 * k), x);
      const float height =
          std::fma(n.x[0], x[0], std::fma(n.x[1], x[1], std::fma(n.x[2], x[2], n.x[3])));
      least = std::fmin(least, height);
      most = std::fmax(most, height);
    }
    return least <= plane.margin() && most >= -plane.margin();
  }

  const Team& team_;
  MeshGapMemory<Real>& m_;
  int size_ = 0;
  std::uint32_t visits_ = 0, tests_ = 0;
  std::uint32_t head_ = 0, queued_ = 0;
  bool stopped_ = false;
};

}  // namespace ist::gpu
