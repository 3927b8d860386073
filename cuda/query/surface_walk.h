#pragma once

#include <cstdint>

#include "cuda/query/disc_sums.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/surface_source.h"
#include "numerics/host_device.h"

// A tree gone down against the surface in an asset: SurfaceDescent (query/field/surface_descent.h)
// depth first, by one team. Each node of the tree has a short list of nodes of the surface that
// come near it; its children inherit what comes near them, and one without any is inside or outside
// as a whole.

namespace ist::gpu {

constexpr int kListRoom = 32;
/// Nodes of a surface that wait while a block's are opened: a list, and what opening two at a time
/// adds on each level.
constexpr int kOpenRoom = kListRoom + kMaxLevels * (kItems - kPairsAtOnce) + kPairsAtOnce;

/// A node of the tree whose children are looked at one after another.
struct ProbeFrame {
  std::uint32_t block;
  int count;
  bool triangles;  ///< all of the list
  SurfaceNode list[kListRoom];
  /// [half of the lanes][child] which of the list come near, a bit each.
  std::uint32_t near[2][kWidth];
};

struct SurfaceMemory : ProbeMemory {
  int wanted[kMaxLevels];  ///< rank down to which the list of a node of a level is opened
  ProbeFrame frame[kMaxLevels];
  SurfaceNode open[kOpenRoom];
  SeenTriangles seen_from_frame;  ///< those in the list of the frame in work
  DiscMemory discs;
};

template <class Team>
class SurfaceWalk {
 public:
  IST_HD SurfaceWalk(const Team& team, SurfaceMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field.mesh, memory.open + kListRoom),
        discs_(team, memory.discs, source_, memory.place.a_from_b.t, sums) {}

  IST_HD void run() {
    if (team_.lane() == 0) {
      plan();
      m_.open[0] = m_.field.mesh.root_node();
    }
    team_.sync();
    const bool is_leaf = m_.tree.top == 0;
    int level = m_.tree.top, child = 0;
    if (!is_leaf) start_frame(level, 0, 1);
    for (bool first = true;; first = false) {
      const bool more = is_leaf ? first : next_child(level, child);
      if (!more || discs_.full()) discs_.finish();
      if (!more) return;
      if (is_leaf) {
        meet_leaf(0, 1);
        continue;
      }
      const ProbeFrame& frame = m_.frame[level];
      const std::uint32_t number = frame.block * kWidth + static_cast<std::uint32_t>(child);
      if (level > 1) {
        start_frame(--level, number, inherit(frame, child));
        child = 0;
        continue;
      }
      if (frame.triangles)
        meet_leaf_in(frame, child);
      else
        meet_leaf(number, inherit(frame, child));
      ++child;
    }
  }

 private:
  /// As SurfaceDescent opens the larger of both.
  IST_HD void plan() {
    const SurfaceRef& surface = m_.field.mesh;
    const double scale = m_.place.a_from_b.scale, cube = scale * scale * scale;
    for (int k = 0; k <= m_.tree.top; ++k) {
      int at = surface.top;
      while (at > 0 && surface.cube[at] >= cube * m_.tree.cube[k + 1]) --at;
      m_.wanted[k] = at > 0 ? at + 1 : kTriangle;
    }
  }

  /// Moves on to a child that the surface comes near, up where a node has none left; false at the
  /// end.
  IST_HD bool next_child(int& level, int& child) const {
    for (;;) {
      const ProbeFrame& frame = m_.frame[level];
      while (child < static_cast<int>(kWidth) && (frame.near[0][child] | frame.near[1][child]) == 0)
        ++child;
      if (child < static_cast<int>(kWidth)) return true;
      if (level == m_.tree.top) return false;
      child = static_cast<int>(frame.block % kWidth) + 1;
      ++level;
    }
  }

  /// Opens what comes near a child; returns how many nodes.
  IST_HD int inherit(const ProbeFrame& frame, int child) {
    const std::uint32_t near = frame.near[0][child] | frame.near[1][child];
    for (int k = team_.lane(); k < frame.count; k += Team::kWidth)
      if ((near >> k & 1) != 0) m_.open[count_bits(near & ((1u << k) - 1))] = frame.list[k];
    team_.sync();
    return count_bits(near);
  }

  /// Goes on to the children of a node, of which m_.open[0 … size) come near: which of their nodes
  /// come near each child. Children without any are settled.
  IST_HD_ONCE void start_frame(int level, std::uint32_t number, int size) {
    ProbeFrame& frame = m_.frame[level];
    if (team_.lane() == 0) {
      frame.block = number;
      frame.count = 0;
    }
    double centre[3], reach;
    bound(level, number, centre, reach);
    int count = 0;
    while (size > 0) {
      int ready = 0;
      size = open_two(size, size < kPairsAtOnce ? size : kPairsAtOnce, count, m_.wanted[level],
                      centre, reach, frame.list + count, ready);
      count += ready;
    }
    sums_.visits += static_cast<std::uint32_t>(count);
    const bool triangles = see_list(frame, count, centre, reach);
    if (team_.lane() == 0) {
      frame.count = count;
      frame.triangles = triangles;
    }
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth),
                lane = item(i) % static_cast<int>(kWidth);
      double x[3], r;
      std::uint32_t near = 0;
      if (place_ball(m_, level, number, lane, x, r))
        for (int k = half; k < count; k += 2)
          near |= listed_meets(frame, k, x, r * (1 + kMoved), centre, reach) ? 1u << k : 0;
      frame.near[half][lane] = near;
    }
    team_.sync();
    settle(frame, level, count, triangles);
  }

  /// Readies what is listed of triangles to be met by the children; whether all of it is.
  IST_HD bool see_list(const ProbeFrame& frame, int count, const double (&centre)[3],
                       double reach) {
    bool other = false;
    for (int k = team_.lane(); k < count; k += Team::kWidth) {
      other = other || rank_of(frame.list[k]) != kTriangle;
      if (rank_of(frame.list[k]) != kTriangle) continue;
      float seen[SeenTriangles::kNumbers] = {};
      double c[3][3];
      m_.field.mesh.corners(number_of(frame.list[k]), c);
      SeenTriangles::see(c, centre, 2 * reach, seen);
      m_.seen_from_frame.set(k, seen);
    }
    team_.sync();
    return !team_.any(other);
  }

  IST_HD bool listed_meets(const ProbeFrame& frame, int k, const double (&x)[3], double r,
                           const double (&centre)[3], double reach) const {
    if (rank_of(frame.list[k]) != kTriangle)
      return SurfaceSource::balls_meet(m_.field.mesh.ball(frame.list[k]), x, r);
    return m_.seen_from_frame.meets(k, x, r, centre, 2 * reach);
  }

  /// Adds the children that no surface comes near and that are inside. Where there are but few
  /// triangles, all are told from one of them.
  IST_HD void settle(const ProbeFrame& frame, int level, int count, bool triangles) {
    int alone_total = 0, first_lane = -1;
    for (int i = 0; i < kItemsALane; ++i) {
      int total = 0;
      double x[3], r;
      const int lane = team_.first(alone_child(frame, level, item(i), x, r), total);
      if (total > 0 && first_lane < 0) first_lane = i * Team::kWidth + lane;
      alone_total += total;
    }
    if (alone_total == 0) return;
    const bool from_one = triangles && count <= alone_total;
    double start[3] = {0, 0, 0}, r;
    if (from_one) place_ball(m_, level, frame.block, first_lane, start, r);
    const bool first_inside =
        from_one && team_.any(inside_surface(team_, m_.field.mesh, team_.lane() == 0, start));
    for (int i = 0; i < kItemsALane; ++i) {
      double x[3] = {0, 0, 0};
      const bool alone = alone_child(frame, level, item(i), x, r);
      bool inside = first_inside;
      if (!from_one) inside = inside_surface(team_, m_.field.mesh, alone, x);
      if (!alone) continue;
      if (from_one && item(i) != first_lane) {
        const double way[3] = {x[0] - start[0], x[1] - start[1], x[2] - start[2]};
        for (int k = 0; k < count; ++k) {
          double c[3][3];
          m_.field.mesh.corners(number_of(frame.list[k]), c);
          if (steps_through(start, way, c)) inside = !inside;
        }
      }
      if (!inside) continue;
      const std::uint32_t child = frame.block * kWidth + static_cast<std::uint32_t>(item(i));
      sums_.add_whole(m_.sums.level[level - 1][child], m_.sums.spheres_below(level - 1, child),
                      m_.place.a_from_b);
    }
  }

  /// Whether an item is a child that nothing comes near; its ball.
  IST_HD bool alone_child(const ProbeFrame& frame, int level, int child, double (&x)[3],
                          double& r) const {
    return child < static_cast<int>(kWidth) && (frame.near[0][child] | frame.near[1][child]) == 0 &&
           place_ball(m_, level, frame.block, child, x, r);
  }

  /// Holds the spheres of a leaf block; where, and the ball around them.
  IST_HD int hold_leaf(std::uint32_t number, double (&centre)[3], double& reach) {
    bound(0, number, centre, reach);
    const int slot = discs_.hold(centre, reach);
    for (int lane = team_.lane(); lane < static_cast<int>(kWidth); lane += Team::kWidth) {
      double x[3], r;
      discs_.set_ball(slot, lane, x, place_ball(m_, 0, number, lane, x, r) ? r : 0);
    }
    team_.sync();
    return slot;
  }

  /// Puts the spheres of a child, a leaf block, together with the triangles of the frame's list
  /// that come near it.
  IST_HD void meet_leaf_in(const ProbeFrame& frame, int child) {
    double centre[3], reach;
    const int slot =
        hold_leaf(frame.block * kWidth + static_cast<std::uint32_t>(child), centre, reach);
    const std::uint32_t near = frame.near[0][child] | frame.near[1][child];
    for (int k = team_.lane(); k < frame.count; k += Team::kWidth)
      if ((near >> k & 1) != 0)
        discs_.stage(count_bits(near & ((1u << k) - 1)), {number_of(frame.list[k]), 0}, k);
    bound(1, frame.block, centre, reach);
    discs_.meet_staged(slot, count_bits(near), m_.seen_from_frame, centre, 2 * reach);
  }

  /// Puts the spheres of a leaf block together with the triangles below m_.open[0 … size).
  IST_HD void meet_leaf(std::uint32_t number, int size) {
    double centre[3], reach;
    const int slot = hold_leaf(number, centre, reach);
    while (size > 0) {
      const int rank = rank_of(m_.open[size - 1]);
      const int most = rank == kTriangle ? kStaged : kPairsAtOnce;
      int have = 1;  // nodes of a kind, from the top
      while (have < most && have < size && alike(rank, rank_of(m_.open[size - 1 - have]))) ++have;
      if (rank > kTriangleBlock) {
        int ready = 0;
        size = open_two(size, have, -kOpenRoom, kTriangleBlock, centre, reach, nullptr, ready);
        continue;
      }
      const int each = rank == kTriangle ? 1 : static_cast<int>(kWidth);
      discs_.meet(slot, [&](int k, TriangleId& id) {
        if (k >= have * each) return false;
        id = {number_of(m_.open[size - 1 - k / each]) * static_cast<std::uint32_t>(each) +
                  static_cast<std::uint32_t>(k % each),
              0};
        return true;
      });
      size -= have;
    }
  }

  IST_HD static bool alike(int rank, int other) {
    return rank > kTriangleBlock ? other > kTriangleBlock : rank == other;
  }

  /// Takes `have` of m_.open[0 … size), no more than two: what is of the wanted rank is `ready`, of
  /// others the children that come near take their places. Returns how many there are now. Where
  /// with `count` they would be more than a list holds, nodes stay as they are and are ready.
  IST_HD_ONCE int open_two(int size, int have, int count, int wanted, const double (&centre)[3],
                           double reach, SurfaceNode* to, int& ready) {
    SurfaceNode node[kItemsALane];
    bool near[kItemsALane];
    int more = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      node[i] = half < have ? m_.open[size - 1 - half] : 0;
      near[i] = half < have && rank_of(node[i]) > wanted &&
                source_.comes_near(node[i], item(i) % static_cast<int>(kWidth), centre,
                                   reach * (1 + kMoved));
      int total = 0;
      team_.exclusive_count(near[i], total);
      more += total;
    }
    team_.sync();
    size -= have;
    sums_.visits += static_cast<std::uint32_t>(have);
    const bool fits = count + size + more + have <= kListRoom;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      const bool stays = half < have && item(i) % static_cast<int>(kWidth) == 0 &&
                         (!fits || rank_of(node[i]) <= wanted);
      int total = 0;
      int place = ready + team_.exclusive_count(stays, total);
      if (stays) to[place] = node[i];
      ready += total;
      place = size + team_.exclusive_count(near[i] && fits, total);
      if (near[i] && fits)
        m_.open[place] =
            surface_node(rank_of(node[i]) - 1, number_of(node[i]) * kWidth +
                                                   static_cast<std::uint32_t>(item(i)) % kWidth);
      size += total;
    }
    team_.sync();
    return size;
  }

  /// The ball of a node, the field's frame.
  IST_HD void bound(int level, std::uint32_t number, double (&centre)[3], double& reach) const {
    const NodeBall ball = m_.tree.ball(level, number);
    m_.place.a_from_b.apply(ball.centre, centre);
    reach = ball.r * m_.place.a_from_b.scale * (1 + 1e-12);
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  const Team& team_;
  SurfaceMemory& m_;
  PartSums& sums_;
  SurfaceSource source_;
  DiscSums<Team, SurfaceSource> discs_;
};

}  // namespace ist::gpu
