#pragma once

#include <cmath>
#include <cstdint>

#include "base/team.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/float_gaps.h"
#include "query/exact/box_gaps.h"
#include "query/exact/mesh_gap.h"
#include "query/exact/orientation.h"
#include "query/exact/overlap_formulas.h"

// A team's memory for the distance of two meshes, with the queue of pairs of triangles that may be
// the nearest.

namespace ist::gpu {

#define IST_FORMULA IST_HD inline
#include "query/exact/box_gap_formulas-inl.h"
#undef IST_FORMULA

/// The number types of box formulas.
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
/// The size of the stack. It holds groups of children, each deeper than the one below.
constexpr int kMeshGapStack = kMeshGapItems * (2 * (kMaxLevels - 1) + 1);
constexpr std::uint32_t kMeshGapQueue = 96;  ///< pairs of triangles to be measured

constexpr std::uint32_t kMeshGapLeft = 32;  ///< pairs that a search may leave in the queue

/// The memory of a team that measures pairs of triangles.
struct MeshGapPair {
  Similarity map[2];  ///< to A's frame, and to B's
  MeshTree mesh[2];
  double reach;
  NearestTriangles best;
  exact::Point level;  ///< the normal of parallel faces
  std::uint32_t crosses;
  std::uint32_t queue[kMeshGapQueue][2];  ///< pairs of triangles, 16 · block + lane
  float apart[kMeshGapQueue];             ///< a lower bound of their distance from floats

  IST_HD exact::Point corner(int side, std::uint32_t triangle, int k) const {
    const MeshBlock& block = in_global_memory(mesh[side].blocks)[triangle / kWidth];
    return vertex(side, block.vertex[block.corner[k][triangle % kWidth]]);
  }
  /// A vertex in A's frame.
  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    const double* const x = in_global_memory(mesh[side].vertices) + std::size_t{3} * number;
    const exact::Point at = {x[0], x[1], x[2]};
    return side == 0 ? at : map_point(map[0], at);
  }
};

/// The memory of a team that searches.
template <class Real>
struct MeshGapMemory : MeshGapPair {
  const FloatBlock* in_floats[2];
  Quad row[3];  ///< of the map to A's frame, the translation last
  BoxLook<Real, Real> look[2];
  float axis[3][3];        ///< the axes along which A's extents are compared
  double limit;            ///< pairs farther apart than this do not matter
  Real squared_limit;      ///< including rounding
  Real limit_of_boxes[2];  ///< the same in the frames of A and B
  /// Pending pairs of nodes (MeshNode). A's has a further bit that is set if it is opened next.
  std::uint32_t stack_a[kMeshGapStack], stack_b[kMeshGapStack];
  Real stack_squared[kMeshGapStack];  ///< squared lower bounds
  Real key[kMeshGapItems];
  ExactTriangle triangles[2][kWidth];  ///< their boxes along the axes of comparison
  float vertices[3][2][kWidth];        ///< of two blocks, A's frame
  std::uint8_t near[2][kWidth];        ///< triangles that may be near enough
  std::uint8_t met[kWidth * kWidth];   ///< pairs of them, 16 · A's + B's
  GapAxes axes[2];                     ///< for A's nodes, and for B's

  // The error of a float coordinate in A's frame, relative to the reach.
  static constexpr float kPlacing = 1e-6f;

  IST_HD float reach_in_floats() const { return static_cast<float>(reach); }

  /// The error of triangles' distances in float, relative to the reach.
  static constexpr float kOff = 4 * kPlacing;
  IST_HD float limit_in_floats() const {
    return static_cast<float>(std::fmin(limit, 1e15)) * (1 + 4e-6f) + kOff * reach_in_floats();
  }

  IST_HD float along(int k, const float (&x)[3]) const {
    return std::fma(axis[k][0], x[0], std::fma(axis[k][1], x[1], axis[k][2] * x[2]));
  }
  IST_HD static float squared_gap(float low, float high, float other_low, float other_high) {
    const float gap = std::fmax(0.0f, std::fmax(low - other_high, other_low - high));
    return gap * gap;
  }

  /// Computes a triangle's plane. Returns the height above it, times the normal's length, beyond
  /// which everything is too far.
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
    // A side has the errors of its ends, and the normal that error times the other side.
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

  /// Maps a point of B's frame to A's.
  IST_HD void to_a(float (&x)[3]) const {
    const float own[3] = {x[0], x[1], x[2]};
    for (int axis = 0; axis < 3; ++axis) {
      const Quad m = row[axis];
      x[axis] =
          std::fma(m.x[0], own[0], std::fma(m.x[1], own[1], std::fma(m.x[2], own[2], m.x[3])));
    }
  }
};

/// The arguments are copies, so that the triangles themselves may stay in registers.
IST_HD_COLD bool triangles_cross(exact::Point a0, exact::Point a1, exact::Point a2, exact::Point b0,
                                 exact::Point b1, exact::Point b2) {
  return exact::cross_exactly({a0, a1, a2}, {b0, b1, b2});
}

/// Sets the limit beyond which pairs do not matter. Called by one lane.
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

/// Sets the direction from A to B along which extents are compared from now on, unless it is zero.
template <class Real, class Team>
IST_HD_COLD void look_along(const Team& team, MeshGapMemory<Real>& memory, exact::Point direction) {
  MeshGapMemory<Real>& m = *team.memory(&memory);
  const bool known = dot(direction, direction) > 0;
  if (team.lane() == 0) {
    m.axes[0] = known ? axes_along(direction) : GapAxes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    m.axes[1] = seen_back(m.axes[0], m.map[1], m.map[0].scale);
  }
  team.sync();
  for (int k = team.lane(); k < 18; k += Team::kWidth) {
    const int side = k / 9, j = k % 9 / 3, axis = k % 3;
    const double along = (&m.axes[side].axis[j].x)[axis];
    if (side == 0) m.axis[j][axis] = static_cast<float>(along);
    if (known) m.look[side].turn(m.axes[side].axis[j], along, j, axis);
  }
  team.sync();
}

/// Records that some points are as near as this, in that direction.
template <class Real, class Team>
IST_HD void come_to(const Team& team, MeshGapMemory<Real>& m, double distance,
                    const exact::Point& between) {
  if (team.lane() == 0) limit_to(m, std::fmin(m.limit, distance));
  const double length = std::sqrt(dot(between, between));
  look_along<Real>(team, m, length > 0 ? (1 / length) * between : exact::Point{0, 0, 0});
}

/// Measures `count` pairs of the queue, at most a team's width. True if one is nearer than all
/// before.
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
  // The lowest of equally near pairs counts.
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
      const exact::Point direction = (1 / distance) * found.between;
      exact::Point level = direction;
      level_with(a.corner, direction, level);
      level_with(b.corner, direction, level);
      m.level = level;
    }
  }
  team.sync();
  return next.least < before && !any_crosses;
}
/// Measures the last pairs of a queue and returns the number left. Rare code is in separate
/// functions, since the search needs its registers and the device its instruction cache.
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

/// Appends a pair of triangles from each lane that `adds`, for which there must be space. Returns
/// the queue's new length.
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

/// Drops from a queue the pairs that are certainly farther, and returns the number left.
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

/// True if no triangles of two blocks are nearer than the best pair, up to rounding, and they come
/// after it. This excludes most pairs of parallel faces, which floats cannot distinguish from
/// nearer ones. `squared`: a lower bound for the blocks.
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

}  // namespace ist::gpu
