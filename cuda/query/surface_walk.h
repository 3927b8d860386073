#pragma once

#include <cstdint>

#include "cuda/query/ball_tests.h"
#include "cuda/query/disc_part.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/surface_source.h"
#include "numerics/host_device.h"

// A tree gone down against the surface in an asset: SurfaceDescent (query/field/surface_descent.h)
// depth first, by one team. Each node of the tree has a short list of nodes of the surface that
// come near it; its children inherit what comes near them, and one without any is inside or outside
// as a whole. Sides are told from a node to its children by the triangles between their centres.

namespace ist::gpu {

constexpr int kListRoom = 32;
static_assert(kListRoom <= kSeen && kSeen <= 32);  // all are seen; a bit each
/// Nodes of a surface that wait while a block's are opened: a list, and what opening two at a time
/// adds on each level.
constexpr int kOpenRoom = kListRoom + kMaxLevels * (kItems - kPairsAtOnce) + kPairsAtOnce;

/// A node of the tree whose children are looked at one after another; a leaf while it is opened.
struct ProbeFrame {
  double centre[3], reach;  ///< a ball about the node's, the field's frame: moved_ball()
  std::uint32_t block;
  bool inside;          ///< whether the centre is
  bool triangles;       ///< what comes near is of what is seen, else of the list
  std::uint32_t left;   ///< children that the surface comes near, still to be looked at
  std::uint32_t sides;  ///< children whose centres are inside
  int count;            ///< of the list
  SurfaceNode list[kListRoom];
  /// [half of the items][child] what comes near, a bit each.
  std::uint32_t near[2][kWidth];

  IST_HD std::uint32_t near_child(int child) const { return near[0][child] | near[1][child]; }
};

struct SurfaceWalkMemory : ProbeMemory {
  int wanted[kMaxLevels];  ///< rank down to which the list of a node of a level is opened
  ProbeFrame frame[kMaxLevels];
  SurfaceNode open[kOpenRoom];
  /// Sees the triangles of the first frame on the way down whose list holds nothing else; those
  /// below it inherit them.
  TestMemory<SurfaceSource::Id> tests;
};

/// Makes a node's ball one about it, whose centre is to tell sides: it lies on no plane, edge or
/// corner where solids are aligned.
IST_HD inline void moved_ball(double (&x)[3], double& r) {
  move_away(r, x);
  r *= 1 + kMoved;
}

/// Of a node of a tree, the field's frame: moved_ball().
IST_HD inline void node_ball(const TreeRef& tree, int level, std::uint32_t number,
                             const Similarity& a_from_b, double (&x)[3], double& r) {
  const NodeBall ball = tree.ball(level, number);
  a_from_b.apply_fused(ball.centre, x);
  r = ball.r * a_from_b.scale;
  moved_ball(x, r);
}

/// Finds the balls that a surface's triangles meet, part by part; sums those that lie inside as a
/// whole.
template <class Team>
class SurfaceWalk {
 public:
  IST_HD SurfaceWalk(const Team& team, SurfaceWalkMemory& memory, PartSums& sums)
      : team_(team),
        m_(memory),
        sums_(sums),
        source_(memory.field.mesh, memory.open),
        tests_(team, memory, memory.tests, source_, sums) {}

  /// `inside`: whether the centre of the root's node_ball() is.
  IST_HD void start(bool inside) {
    if (team_.lane() == 0) {
      plan();
      m_.open[0] = m_.field.mesh.root_node();
      m_.frame[m_.tree.top].inside = inside;
    }
    team_.sync();
    size_ = 1;
    begin(m_.tree.top, 0);
  }

  /// Hands over what triangles meet, part by part: take(met, end), `end` being false where more of
  /// the same part follows; stops where that is false. At the end of a part nothing is open: the
  /// source's room is free then.
  ///
  /// One small step after another: each is in the kernel's code once, which would overflow the
  /// instruction cache otherwise.
  template <class Take>
  IST_HD void run(const Take& take) {
    for (;;) {
      if (tests_.step()) continue;
      const bool ends = !tests_.full();
      if (ends && opening_) {
        go_on();
      } else if (ends && more_ && tests_.room()) {
        more_ = next();
      } else {
        if (!take(tests_.met(), ends) || (ends && !more_)) return;
        tests_.forget(ends);
      }
    }
  }

 private:
  /// As SurfaceDescent opens the larger of both.
  IST_HD void plan() {
    const SurfaceRef& surface = m_.field.mesh;
    const double scale = m_.place.a_from_b.scale, cube = scale * scale * scale;
    for (int k = 1; k <= m_.tree.top; ++k) {
      int at = surface.top;
      while (at > 0 && surface.cube[at] >= cube * m_.tree.cube[k + 1]) --at;
      m_.wanted[k] = at > 0 ? at + 1 : kTriangle;
    }
  }

  /// That of a child of the frame in work.
  IST_HD bool place_child(const ProbeFrame& frame, int child, double (&x)[3], double& r) const {
    const bool there = place_ball(m_, level_, frame.block, child, x, r);
    moved_ball(x, r);
    return there;
  }

  /// Begins with a node; what comes near it is in m_.open, in its list, or seen.
  IST_HD void begin(int level, std::uint32_t number) {
    opening_ = first_ = true;
    target_ = level;
    double centre[3], reach;
    node_ball(m_.tree, level, number, m_.place.a_from_b, centre, reach);
    if (team_.lane() == 0) {
      ProbeFrame& frame = m_.frame[level];
      frame.block = number;
      for (int k = 0; k < 3; ++k) frame.centre[k] = centre[k];
      frame.reach = reach;
      if (level < m_.tree.top)
        frame.inside = (m_.frame[level + 1].sides >> (number % kWidth) & 1) != 0;
    }
    team_.sync();
  }

  /// Opens what comes near the node it began with; then its children are next, or of a leaf what of
  /// its triangles is tested together.
  IST_HD void go_on() {
    const bool leaf = target_ == 0;
    while (size_ > 0 && (!leaf || rank_of(m_.open[size_ - 1]) > kTriangleBlock)) open_two(leaf);
    if (leaf)
      stage_leaf();
    else
      start_frame();
  }

  /// Goes on to the next child that the surface comes near, or to two leaves; false at the end.
  IST_HD bool next() {
    if (m_.tree.top == 0) return false;
    while (m_.frame[level_].left == 0) {
      if (level_ == m_.tree.top) return false;
      ++level_;
    }
    const ProbeFrame& frame = m_.frame[level_];
    const std::uint32_t left = frame.left, rest = left & (left - 1);
    const int child = lowest_bit(left);
    const bool leaves = level_ == 1 && frame.triangles;
    const bool two = leaves && rest != 0;
    team_.sync();  // `left` has been read
    if (team_.lane() == 0) m_.frame[level_].left = two ? rest & (rest - 1) : rest;
    if (leaves) {
      stage_leaves(frame, child, two ? lowest_bit(rest) : child);
      return true;
    }
    count_ = size_ = 0;
    inherits_ = frame.triangles;
    seen_ = frame.near_child(child);
    if (!inherits_) share_list(frame, seen_);
    begin(level_ - 1, frame.block * kWidth + static_cast<std::uint32_t>(child));
    return true;
  }

  /// Shares out what of a frame's list comes near a child: what is to be opened for that, and what
  /// is small enough for its list.
  IST_HD void share_list(const ProbeFrame& frame, std::uint32_t near) {
    const int child_level = level_ - 1;
    for (int base = 0; base < frame.count; base += Team::kWidth) {
      const int k = base + team_.lane();
      const bool comes = k < frame.count && (near >> k & 1) != 0;
      const SurfaceNode node = comes ? frame.list[k] : 0;
      put(comes && !is_listed(child_level, rank_of(node)),
          comes && is_listed(child_level, rank_of(node)), child_level, node);
    }
  }

  /// Whether nodes of a rank go to the list of a node of the tree; a leaf has none.
  IST_HD bool is_listed(int level, int rank) const { return level > 0 && rank <= m_.wanted[level]; }

  /// Puts a lane's node on what is open, or on a frame's list.
  IST_HD void put(bool open, bool listed, int level, SurfaceNode node) {
    int total = 0;
    int place = size_ + team_.exclusive_count(open, total);
    if (open) m_.open[place] = node;
    size_ += total;
    place = count_ + team_.exclusive_count(listed, total);
    if (listed) m_.frame[level].list[place] = node;
    count_ += total;
  }

  /// Readies the test of leaves that are children of a frame whose triangles are seen: two, or
  /// one by both halves.
  IST_HD void stage_leaves(const ProbeFrame& frame, int child, int other) {
    for (int half = team_.lane(); half < 2; half += Team::kWidth) {
      const int at = half == 0 ? child : other;
      TestedBlock& tested = m_.tests.tested[half];
      double r;
      place_child(frame, at, tested.from, r);
      tested.inside = (frame.sides >> at & 1) != 0;
      tested.block = frame.block * kWidth + static_cast<std::uint32_t>(at);
      tested.triangles = frame.near_child(at);
    }
    team_.sync();
    tests_.stage(other != child, true, true);
  }

  /// Readies the test of a leaf with triangles of its own, from the top of what is open, alone or
  /// in blocks.
  IST_HD void stage_leaf() {
    const ProbeFrame& frame = m_.frame[0];
    if (team_.lane() == 0) m_.tests.seen.look_from(frame.centre, frame.reach);
    const int rank = size_ > 0 ? rank_of(m_.open[size_ - 1]) : kTriangle;
    const int most = rank == kTriangle ? kSeen : kPairsAtOnce;
    const int each = rank == kTriangle ? 1 : static_cast<int>(kWidth);
    int have = 0;
    while (have < most && have < size_ && rank_of(m_.open[size_ - 1 - have]) == rank) ++have;
    team_.sync();
    std::uint32_t near = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      bool comes = item(i) < have * each;
      if (comes) {
        const std::uint32_t id =
            number_of(m_.open[size_ - 1 - item(i) / each]) * static_cast<std::uint32_t>(each) +
            static_cast<std::uint32_t>(item(i) % each);
        see(item(i), id);
        comes = SeenTriangles::meets(m_.tests.seen.from_centre(item(i)), 1 + kSeenRoom);
      }
      near |= team_.ballot(comes) << (i * Team::kWidth);
    }
    size_ -= have;
    for (int half = team_.lane(); half < 2; half += Team::kWidth) {
      TestedBlock& tested = m_.tests.tested[half];
      for (int k = 0; k < 3; ++k) tested.from[k] = frame.centre[k];
      tested.inside = frame.inside;
      tested.block = frame.block;
      tested.triangles = near;
    }
    team_.sync();
    opening_ = size_ > 0;
    tests_.stage(false, first_, !opening_);
    first_ = false;
  }

  /// Goes on to the children of a node, of which is known what comes near: which of it comes near
  /// each child, and on which side the child lies. Children without any are inside or outside as a
  /// whole.
  IST_HD void start_frame() {
    ProbeFrame& frame = m_.frame[target_];
    opening_ = false;
    level_ = target_;
    const bool triangles = inherits_ || see_list(frame);
    if (!inherits_) seen_ = count_ > 0 ? (2u << (count_ - 1)) - 1 : 0;
    sums_.visits += static_cast<std::uint32_t>(count_bits(seen_));
    std::uint32_t there = 0, touched = 0, odd = 0, look = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth),
                lane = item(i) % static_cast<int>(kWidth);
      double x[3], r;
      std::uint32_t near = 0;
      bool crossed = false, untold = false;
      const bool is_child = place_child(frame, lane, x, r);
      if (is_child && triangles) {
        std::uint32_t unclear = 0;
        crossed = tests_.meet(frame.centre, seen_, x, r, {item(i), true}, near, unclear);
        untold = unclear != 0 ||
                 !SurfaceSource::balls_meet({{x[0], x[1], x[2]}, 0}, frame.centre, frame.reach);
      } else if (is_child) {
        near = meet_list(frame, half, x, r);
      }
      frame.near[half][lane] = near;
      there |= team_.ballot(is_child) << (i * Team::kWidth);
      touched |= team_.ballot(near != 0) << (i * Team::kWidth);
      odd |= team_.ballot(crossed) << (i * Team::kWidth);
      look |= team_.ballot(untold) << (i * Team::kWidth);
    }
    constexpr std::uint32_t kChildren = (1u << kWidth) - 1;
    there &= kChildren;
    touched = (touched | touched >> kWidth) & kChildren;
    odd = (odd ^ odd >> kWidth) & kChildren;
    look = triangles ? (look | look >> kWidth) & kChildren : there;
    std::uint32_t sides = frame.inside ? ~odd : odd;
    if (look != 0) sides = (sides & ~look) | look_up(frame, look);
    team_.sync();
    if (team_.lane() == 0) {
      frame.count = count_;
      frame.triangles = triangles;
      frame.left = touched;
      frame.sides = sides;
    }
    team_.sync();
    const std::uint32_t whole = there & ~touched & sides;
    for (int lane = team_.lane(); lane < static_cast<int>(kWidth); lane += Team::kWidth) {
      if ((whole >> lane & 1) == 0) continue;
      const std::uint32_t child = frame.block * kWidth + static_cast<std::uint32_t>(lane);
      sums_.add_whole(m_.sums.level[level_ - 1][child], m_.sums.spheres_below(level_ - 1, child),
                      m_.place.a_from_b);
    }
  }

  /// Sees a triangle, by one lane.
  IST_HD void see(int place, SurfaceSource::Id id) {
    double c[3][3];
    source_.corners(id, c);
    m_.tests.id[place] = id;
    m_.tests.seen.see(place, c);
  }

  /// Sees what is listed of triangles; whether that is all of the list.
  IST_HD bool see_list(const ProbeFrame& frame) {
    if (team_.lane() == 0) m_.tests.seen.look_from(frame.centre, frame.reach);
    team_.sync();
    bool other = false;
    for (int k = team_.lane(); k < count_; k += Team::kWidth) {
      const SurfaceNode node = frame.list[k];
      other = other || rank_of(node) != kTriangle;
      if (rank_of(node) != kTriangle) continue;
      see(k, number_of(node));
    }
    team_.sync();
    return !team_.any(other);
  }

  /// Which of a half of a frame's list comes near a child.
  IST_HD std::uint32_t meet_list(const ProbeFrame& frame, int half, const double (&x)[3],
                                 double r) const {
    float at[3];
    m_.tests.seen.seen(x, at);
    const float radius = m_.tests.seen.seen_radius(r);
    std::uint32_t near = 0;
    IST_ROLLED
    for (int k = half; k < count_; k += 2) {
      const SurfaceNode node = frame.list[k];
      const bool meets = rank_of(node) == kTriangle
                             ? SeenTriangles::meets(m_.tests.seen.from(k, at), radius)
                             : SurfaceSource::balls_meet(m_.field.mesh.ball(node), x, r);
      near |= meets ? 1u << k : 0;
    }
    return near;
  }

  /// Which children's centres are inside, by the grid.
  IST_HD std::uint32_t look_up(const ProbeFrame& frame, std::uint32_t children) {
    std::uint32_t inside = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const bool wanted = item(i) < static_cast<int>(kWidth) && (children >> item(i) & 1) != 0;
      double x[3] = {0, 0, 0}, r;
      if (wanted) place_child(frame, item(i), x, r);
      const bool is_inside = inside_surface(team_, m_.field.mesh, wanted, x);
      inside |= team_.ballot(wanted && is_inside) << (i * Team::kWidth);
    }
    return inside;
  }

  /// Opens the topmost nodes, two where both are to be: the children that come near take their
  /// places, those small enough in the frame's list. Where they would be more than a list holds,
  /// nodes are listed as they are.
  IST_HD void open_two(bool leaf) {
    const ProbeFrame& frame = m_.frame[target_];
    const int have = size_ > 1 && (!leaf || rank_of(m_.open[size_ - 2]) > kTriangleBlock) ? 2 : 1;
    SurfaceNode node[kItemsALane];
    bool near[kItemsALane];
    int more = 0;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth);
      node[i] = half < have ? m_.open[size_ - 1 - half] : 0;
      near[i] = half < have && source_.comes_near(node[i], item(i) % static_cast<int>(kWidth),
                                                  frame.centre, frame.reach);
      int total = 0;
      team_.exclusive_count(near[i], total);
      more += total;
    }
    team_.sync();
    size_ -= have;
    sums_.visits += static_cast<std::uint32_t>(have);
    const bool fits = leaf || count_ + size_ + more <= kListRoom;
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = item(i) / static_cast<int>(kWidth),
                lane = item(i) % static_cast<int>(kWidth);
      const int rank = rank_of(node[i]) - 1;
      const SurfaceNode child =
          surface_node(rank, number_of(node[i]) * kWidth + static_cast<std::uint32_t>(lane));
      const bool listed = fits ? near[i] && is_listed(target_, rank) : half < have && lane == 0;
      put(fits && near[i] && !listed, listed, target_, fits ? child : node[i]);
    }
    team_.sync();
  }

  static constexpr int kItemsALane = kItems / Team::kWidth;
  IST_HD int item(int i) const { return i * Team::kWidth + team_.lane(); }

  const Team& team_;
  SurfaceWalkMemory& m_;
  PartSums& sums_;
  SurfaceSource source_;
  BallTests<Team, SurfaceSource> tests_;
  bool more_ = true;          ///< nodes are left
  int level_ = 0;             ///< where it is: at the children of a frame
  bool opening_ = false;      ///< a node has begun
  int target_ = 0;            ///< its level
  int size_ = 0, count_ = 0;  ///< open, and listed
  bool inherits_ = false;     ///< what comes near is of what the frame above sees
  std::uint32_t seen_ = 0;    ///< that, a bit each
  bool first_ = false;        ///< of a leaf nothing has been tested
};

}  // namespace ist::gpu
