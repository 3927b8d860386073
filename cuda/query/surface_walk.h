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
static_assert(kListRoom <= kStaged && kListRoom <= 32);  // all are seen; a bit each
/// Nodes of a surface that wait while a block's are opened: a list, and what opening two at a time
/// adds on each level.
constexpr int kOpenRoom = kListRoom + kMaxLevels * (kItems - kPairsAtOnce) + kPairsAtOnce;

/// A node of the tree whose children are looked at one after another; a leaf while it is opened.
struct ProbeFrame {
  std::uint32_t block;
  int count;
  bool triangles;           ///< all of the list
  double centre[3], reach;  ///< the node's ball, the field's frame
  SurfaceNode list[kListRoom];
  /// [half of the lanes][child] which of the list come near, a bit each.
  std::uint32_t near[2][kWidth];
};

struct SurfaceMemory : ProbeMemory {
  int wanted[kMaxLevels];  ///< rank down to which the list of a node of a level is opened
  ProbeFrame frame[kMaxLevels];
  SurfaceNode open[kOpenRoom];
  /// Of its triangles those in the list of the frame in work are seen, if it holds no others.
  DiscMemory discs;
};

template <class Team>
class SurfaceWalk {
 public:
  IST_HD SurfaceWalk(const Team& team, SurfaceMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field.mesh, memory.open),
        discs_(team, memory.discs, source_, memory.place.a_from_b.t, sums) {}

  /// One small step after another: each is in the kernel's code once, which would overflow the
  /// instruction cache otherwise.
  IST_HD void run() {
    if (team_.lane() == 0) {
      plan();
      m_.open[0] = m_.field.mesh.root_node();
    }
    team_.sync();
    begin(m_.tree.top, 0, 1);
    bool more = true, rest = false;
    for (;;) {
      if (discs_.drain(rest)) continue;
      if (rest) {
        discs_.finish();
        if (!more) return;
        rest = false;
      }
      if (discs_.tests())
        discs_.test();
      else if (opening_)
        go_on();
      else if (more && !discs_.full())
        more = next();
      else
        rest = true;
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
    m_.wanted[0] = kTriangleBlock;
  }

  /// Begins with a node, of which m_.open[0 … size) come near.
  IST_HD void begin(int level, std::uint32_t number, int size) {
    opening_ = true;
    target_ = level;
    size_ = size;
    count_ = 0;
    const NodeBall ball = m_.tree.ball(level, number);
    double centre[3];
    m_.place.a_from_b.apply(ball.centre, centre);
    const double reach = ball.r * m_.place.a_from_b.scale * (1 + 1e-12);
    if (team_.lane() == 0) {
      ProbeFrame& frame = m_.frame[level];
      frame.block = number;
      for (int k = 0; k < 3; ++k) frame.centre[k] = centre[k];
      frame.reach = reach;
    }
    if (level == 0) slot_ = hold_leaf(number, centre, reach);
    team_.sync();
  }

  /// Opens what comes near the node it began with, and ends with it where nothing is left.
  IST_HD void go_on() {
    const bool leaf = target_ == 0;
    while (size_ > 0 && (!leaf || rank_of(m_.open[size_ - 1]) > kTriangleBlock)) open_two(leaf);
    if (!leaf) {
      start_frame();
    } else if (size_ > 0) {
      stage_open(rank_of(m_.open[size_ - 1]));
    } else {
      opening_ = false;
      ++child_;
    }
  }

  /// Goes on to the next child that the surface comes near; false at the end.
  IST_HD bool next() {
    if (m_.tree.top == 0 || !next_child()) return false;
    const ProbeFrame& frame = m_.frame[level_];
    const std::uint32_t number = frame.block * kWidth + static_cast<std::uint32_t>(child_);
    const std::uint32_t near = frame.near[0][child_] | frame.near[1][child_];
    const bool staged = level_ == 1 && frame.triangles;
    for (int k = team_.lane(); k < frame.count; k += Team::kWidth) {
      if ((near >> k & 1) == 0) continue;
      const int place = count_bits(near & ((1u << k) - 1));
      if (staged)
        discs_.stage(place, {number_of(frame.list[k]), 0}, k);
      else
        m_.open[place] = frame.list[k];
    }
    team_.sync();  // the frame below is read no more
    begin(level_ - 1, number, staged ? 0 : count_bits(near));
    if (staged) discs_.ready_tests(slot_, count_bits(near), frame.centre, 2 * frame.reach);
    return true;
  }

  /// Moves on to a child that the surface comes near, up where a node has none left.
  IST_HD bool next_child() {
    for (;;) {
      const ProbeFrame& frame = m_.frame[level_];
      while (child_ < static_cast<int>(kWidth) &&
             (frame.near[0][child_] | frame.near[1][child_]) == 0)
        ++child_;
      if (child_ < static_cast<int>(kWidth)) return true;
      if (level_ == m_.tree.top) return false;
      child_ = static_cast<int>(frame.block % kWidth) + 1;
      ++level_;
    }
  }

  /// Goes on to the children of a node, of which the list comes near: which of it comes near each
  /// child. Children without any are settled.
  IST_HD void start_frame() {
    ProbeFrame& frame = m_.frame[target_];
    opening_ = false;
    level_ = target_;
    child_ = 0;
    sums_.visits += static_cast<std::uint32_t>(count_);
    const bool triangles = see_list(frame);
    if (team_.lane() == 0) {
      frame.count = count_;
      frame.triangles = triangles;
    }
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth),
                lane = item(i) % static_cast<int>(kWidth);
      double x[3], r;
      std::uint32_t near = 0;
      if (place_ball(m_, level_, frame.block, lane, x, r)) {
        r *= 1 + kMoved;
        const SeenBall ball = SeenTriangles::ball(x, r, frame.centre, 2 * frame.reach);
        IST_ROLLED
        for (int k = half; k < count_; k += 2)
          near |= listed_meets(frame, k, x, r, ball) ? 1u << k : 0;
      }
      frame.near[half][lane] = near;
    }
    team_.sync();
    settle(frame, triangles);
  }

  /// Readies what is listed of triangles to be met by the children; whether all of it is.
  IST_HD bool see_list(const ProbeFrame& frame) {
    bool other = false;
    for (int k = team_.lane(); k < count_; k += Team::kWidth) {
      const SurfaceNode node = frame.list[k];
      other = other || rank_of(node) != kTriangle;
      if (rank_of(node) != kTriangle) continue;
      double c[3][3];
      m_.field.mesh.corners(number_of(node), c);
      m_.discs.triangles.see(k, c, frame.centre, 2 * frame.reach);
    }
    team_.sync();
    return !team_.any(other);
  }

  IST_HD bool listed_meets(const ProbeFrame& frame, int k, const double (&x)[3], double r,
                           const SeenBall& ball) const {
    if (rank_of(frame.list[k]) != kTriangle)
      return SurfaceSource::balls_meet(m_.field.mesh.ball(frame.list[k]), x, r);
    return m_.discs.triangles.meets(k, ball);
  }

  /// Adds the children that no surface comes near and that are inside. Where there are but few
  /// triangles, all are told from the first.
  IST_HD void settle(const ProbeFrame& frame, bool triangles) {
    int alone_total = 0, first = -1;
    for (int i = 0; i < kItemsALane; ++i) {
      int total = 0;
      double x[3], r;
      const int lane = team_.first(alone_child(frame, item(i), x, r), total);
      if (total > 0 && first < 0) first = i * Team::kWidth + lane;
      alone_total += total;
    }
    if (alone_total == 0) return;
    const bool from_first = triangles && count_ <= alone_total;
    double start[3] = {0, 0, 0}, r;
    if (from_first) place_ball(m_, level_, frame.block, first, start, r);
    bool first_inside = false;
    for (int i = 0; i < kItemsALane; ++i) {
      double x[3] = {0, 0, 0};
      const bool alone = alone_child(frame, item(i), x, r);
      bool inside = inside_surface(team_, m_.field.mesh, from_first ? item(i) == first : alone, x);
      if (from_first) {
        first_inside = first_inside || team_.any(item(i) == first && inside);
        inside = first_inside;
      }
      if (!alone) continue;
      if (from_first && item(i) != first) {
        const double way[3] = {x[0] - start[0], x[1] - start[1], x[2] - start[2]};
        for (int k = 0; k < count_; ++k)
          if (steps_through(start, way, m_.field.mesh, number_of(frame.list[k]))) inside = !inside;
      }
      if (!inside) continue;
      const std::uint32_t child = frame.block * kWidth + static_cast<std::uint32_t>(item(i));
      sums_.add_whole(m_.sums.level[level_ - 1][child], m_.sums.spheres_below(level_ - 1, child),
                      m_.place.a_from_b);
    }
  }

  /// Whether an item is a child that nothing comes near; its ball.
  IST_HD bool alone_child(const ProbeFrame& frame, int child, double (&x)[3], double& r) const {
    return child < static_cast<int>(kWidth) && (frame.near[0][child] | frame.near[1][child]) == 0 &&
           place_ball(m_, level_, frame.block, child, x, r);
  }

  /// Holds the spheres of a leaf block.
  IST_HD int hold_leaf(std::uint32_t number, const double (&centre)[3], double reach) {
    const int slot = discs_.hold(centre, reach);
    for (int lane = team_.lane(); lane < static_cast<int>(kWidth); lane += Team::kWidth) {
      double x[3], r;
      discs_.set_ball(slot, lane, x, place_ball(m_, 0, number, lane, x, r) ? r : 0);
    }
    return slot;
  }

  /// Stages triangles from the top of what is open, alone or in blocks, for the leaf that is held.
  IST_HD void stage_open(int rank) {
    const int most = rank == kTriangle ? kStaged : kPairsAtOnce;
    int have = 1;
    while (have < most && have < size_ && rank_of(m_.open[size_ - 1 - have]) == rank) ++have;
    const int each = rank == kTriangle ? 1 : static_cast<int>(kWidth);
    discs_.stage_near(slot_, [&](int k, TriangleId& id) {
      if (k >= have * each) return false;
      id = {number_of(m_.open[size_ - 1 - k / each]) * static_cast<std::uint32_t>(each) +
                static_cast<std::uint32_t>(k % each),
            0};
      return true;
    });
    size_ -= have;
  }

  /// Opens the topmost nodes, two where both are to be: what is of the wanted rank goes to the
  /// frame's list, of others the children that come near take their places. Where they would be
  /// more than a list holds, nodes are listed as they are; a leaf has no list.
  IST_HD void open_two(bool leaf) {
    ProbeFrame& frame = m_.frame[target_];
    const int wanted = m_.wanted[target_];
    const int have = size_ > 1 && (!leaf || rank_of(m_.open[size_ - 2]) > wanted) ? 2 : 1;
    const double centre[3] = {frame.centre[0], frame.centre[1], frame.centre[2]};
    const double reach = frame.reach * (1 + kMoved);
    SurfaceNode node[kItemsALane];
    bool near[kItemsALane];
    int more = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      node[i] = half < have ? m_.open[size_ - 1 - half] : 0;
      near[i] = half < have && rank_of(node[i]) > wanted &&
                source_.comes_near(node[i], item(i) % static_cast<int>(kWidth), centre, reach);
      int total = 0;
      team_.exclusive_count(near[i], total);
      more += total;
    }
    team_.sync();
    size_ -= have;
    sums_.visits += static_cast<std::uint32_t>(have);
    const bool fits = leaf || count_ + size_ + more + have <= kListRoom;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      const bool stays = half < have && item(i) % static_cast<int>(kWidth) == 0 &&
                         (!fits || rank_of(node[i]) <= wanted);
      int total = 0;
      int place = count_ + team_.exclusive_count(stays, total);
      if (stays) frame.list[place] = node[i];
      count_ += total;
      place = size_ + team_.exclusive_count(near[i] && fits, total);
      if (near[i] && fits)
        m_.open[place] =
            surface_node(rank_of(node[i]) - 1, number_of(node[i]) * kWidth +
                                                   static_cast<std::uint32_t>(item(i)) % kWidth);
      size_ += total;
    }
    team_.sync();
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  const Team& team_;
  SurfaceMemory& m_;
  PartSums& sums_;
  SurfaceSource source_;
  DiscSums<Team, SurfaceSource> discs_;
  int level_ = 0, child_ = 0;  ///< where it is: at a child of a frame
  bool opening_ = false;       ///< a node has begun
  int target_ = 0;             ///< its level
  int size_ = 0, count_ = 0;   ///< open, and listed
  int slot_ = 0;               ///< of the leaf that is held
};

}  // namespace ist::gpu
