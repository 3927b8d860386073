#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include <ist/query.h>

#include "query/budget.h"
#include "query/leaf_kernel.h"
#include "query/node_kernel.h"
#include "query/precision.h"
#include "query/relative_pose.h"
#include "query/sphere_tree.h"
#include "query/unresolved.h"
#include "query/workspace.h"

namespace ist {
namespace {

// Pairs between two looks at the limits: a few microseconds.
constexpr std::size_t kChunk = 64;

// Sums whose rounding may exceed this share are taken again in double. The bound is some hundred
// times what rounding does, so float keeps 1e-5.
constexpr double kGrazing = 3e-4;

/// The finished sums and what is known of pairs that were not opened, in A's unit frame; positions
/// relative to B's unit-frame origin.
struct Overlap {
  double volume = 0;
  double error = 0;  ///< bound on the rounding of `volume`
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
};

double total(const double (&lanes)[kSumLanes]) {
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

Eigen::Vector3d total(const double (&lanes)[3][kSumLanes]) {
  return {total(lanes[0]), total(lanes[1]), total(lanes[2])};
}

Overlap finish(const LeafSums& sums, Precision precision) {
  Overlap overlap;
  overlap.volume = M_PI / 3 * total(sums.caps);
  // A lens is good to a few units in the last place, and at most 33 of them meet in one lane
  // before the sum goes on in double.
  const double relative = precision == Precision::single ? 4e-6 : 1e-14;
  overlap.error = 2 * M_PI * total(sums.error) + relative * overlap.volume;
  overlap.force = -2 * M_PI * total(sums.force);
  overlap.torque = -2 * M_PI * total(sums.torque);
  overlap.moment = M_PI / 3 * total(sums.moment);
  return overlap;
}

/// The staged descent of DESIGN 7: node pairs level by level, then pairs of leaf blocks.
class Descent {
 public:
  Descent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
          const QuerySettings& settings, Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        map_(pose.a_from_b),
        inverse_(pose.b_from_a),
        precision_(precision_for(a, b, pose)),
        settings_(settings),
        min_radius_(settings.min_radius / pose.unit_a),
        scratch_(scratch),
        budget_(settings) {}

  void run() {
    level_a_ = a_.top;
    level_b_ = b_.top;
    scratch_.now.a[0] = scratch_.now.b[0] = 0;
    scratch_.now.size = estimate(level_a_, 0, level_b_, 0).bound > 0 ? 1 : 0;
    while (level_a_ > 0 || level_b_ > 0) {
      if (!open_level()) return;
    }
    open_leaves();
  }

  /// Best answer; `left_bound` is what the pairs that were not opened can add at most.
  Overlap overlap() const {
    Overlap result = finish(sums_, precision_);
    result.volume += left_.volume;
    result.force += left_.force;
    result.torque += left_.torque;
    result.moment += left_.moment;
    return result;
  }
  double left_bound() const { return left_bound_; }
  double left_guess() const { return left_.volume; }
  bool stopped() const { return stopped_; }
  std::uint32_t visits() const { return budget_.visits(); }
  std::uint32_t lenses() const { return sums_.lenses; }

 private:
  PairEstimate estimate(int level_a, std::uint32_t a, int level_b, std::uint32_t b) const {
    return estimate_pair(a_, level_a, a, b_, level_b, b, map_);
  }

  /// Opens one side of every pair of the current list. False if the budget stopped it.
  bool open_level() {
    const double cube = map_.scale * map_.scale * map_.scale;
    const bool open_a = level_b_ == 0 || (level_a_ > 0 && a_.typical_cube(level_a_) >=
                                                              cube * b_.typical_cube(level_b_));
    if (min_radius_ > 0) drop_small([&](double ra, double rb) { return open_a ? ra : rb; });
    PairList& now = scratch_.now;
    PairList& next = scratch_.next;
    if (now.size > budget_.left()) rank();

    const NodeStage stage = open_a ? NodeStage{&a_, &b_, level_a_, level_b_, &map_, precision_}
                                   : NodeStage{&b_, &a_, level_b_, level_a_, &inverse_, precision_};
    next.size = 0;
    std::size_t done = 0;
    while (done < now.size) {
      const std::size_t room = (scratch_.capacity - next.size) / kWidth;
      const std::size_t n = budget_.grant(std::min({kChunk, now.size - done, room}));
      if (n == 0) break;
      next.size += open_a ? open_nodes(stage, now.a.get() + done, now.b.get() + done, n,
                                       next.a.get() + next.size, next.b.get() + next.size)
                          : open_nodes(stage, now.b.get() + done, now.a.get() + done, n,
                                       next.b.get() + next.size, next.a.get() + next.size);
      done += n;
    }
    const bool finished = done == now.size;
    if (!finished) leave(now, done);
    --(open_a ? level_a_ : level_b_);
    std::swap(now, next);
    if (!finished) leave(now, 0);
    return finished;
  }

  void open_leaves() {
    if (min_radius_ > 0) drop_small([](double ra, double rb) { return std::max(ra, rb); });
    PairList& now = scratch_.now;
    const bool by_error = settings_.relative_error > 0;
    double waiting = 0;  // bound on the pairs still to come
    if (by_error || now.size > budget_.left()) waiting = rank();

    LeafStage stage{&a_, &b_, &map_, precision_};
    std::size_t done = 0;
    while (done < now.size) {
      if (by_error && accurate(waiting)) break;
      const std::size_t n = budget_.grant(std::min(kChunk, now.size - done));
      if (n == 0) break;
      add_leaf_pairs(stage, now.a.get() + done, now.b.get() + done, n, sums_);
      if (by_error)
        for (std::size_t i = done; i < done + n; ++i) waiting -= scratch_.ranked[i].bound;
      done += n;
    }
    leave(now, done);

    // A few grazing lenses are all rounding in float; they are as few as they are shallow.
    const Overlap sum = finish(sums_, precision_);
    if (precision_ == Precision::single && sum.error > kGrazing * sum.volume) {
      stage.precision = precision_ = Precision::twice;
      sums_ = LeafSums();
      add_leaf_pairs(stage, now.a.get(), now.b.get(), done, sums_);
    }
  }

  bool accurate(double waiting) const {
    const Overlap sure = finish(sums_, precision_);
    const double spread = 2 * sure.error + waiting + left_bound_;
    return spread <= settings_.relative_error * (sure.volume + sure.error + waiting + left_bound_);
  }

  /// Sorts the current list, largest bound first; returns the sum of the bounds.
  double rank() {
    PairList& now = scratch_.now;
    RankedPair* ranked = scratch_.ranked.get();
    for (std::size_t i = 0; i < now.size; ++i)
      ranked[i] = {estimate(level_a_, now.a[i], level_b_, now.b[i]).bound, now.a[i], now.b[i]};
    std::sort(ranked, ranked + now.size, [](const RankedPair& l, const RankedPair& r) {
      if (l.bound != r.bound) return l.bound > r.bound;
      return l.a != r.a ? l.a < r.a : l.b < r.b;
    });
    double sum = 0;
    for (std::size_t i = 0; i < now.size; ++i) {
      now.a[i] = ranked[i].a;
      now.b[i] = ranked[i].b;
      sum += ranked[i].bound;
    }
    return sum;
  }

  /// Leaves the pairs unopened of which `measured(radius_a, radius_b)` is under the limit.
  template <class Measured>
  void drop_small(Measured measured) {
    PairList& now = scratch_.now;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < now.size; ++i) {
      const double ra = a_.ball(level_a_, now.a[i]).r;
      const double rb = b_.ball(level_b_, now.b[i]).r * map_.scale;
      if (measured(ra, rb) < min_radius_) {
        leave_pair(now.a[i], now.b[i]);
      } else {
        now.a[kept] = now.a[i];
        now.b[kept++] = now.b[i];
      }
    }
    now.size = kept;
  }

  void leave(const PairList& list, std::size_t from) {
    for (std::size_t i = from; i < list.size; ++i) leave_pair(list.a[i], list.b[i]);
  }

  void leave_pair(std::uint32_t a, std::uint32_t b) {
    const PairEstimate pair = estimate(level_a_, a, level_b_, b);
    const Eigen::Vector3d lever = pair.centre - Eigen::Vector3d(map_.t[0], map_.t[1], map_.t[2]);
    stopped_ = true;
    left_bound_ += pair.bound;
    left_.volume += pair.volume;
    left_.force += pair.force;
    left_.torque += lever.cross(pair.force);
    left_.moment += pair.volume * lever;
  }

  const SphereTree& a_;
  const SphereTree& b_;
  const Similarity& map_;
  const Similarity& inverse_;
  Precision precision_;
  const QuerySettings& settings_;
  const double min_radius_;  ///< A's unit frame
  Workspace::Impl& scratch_;
  Budget budget_;
  int level_a_ = 0, level_b_ = 0;  ///< of the current list
  LeafSums sums_;
  Overlap left_;  ///< guess of what was not opened
  double left_bound_ = 0;
  bool stopped_ = false;
};

}  // namespace

Penetration penetration(const PlacedTree& a, const PlacedTree& b, const QuerySettings& settings,
                        Workspace& workspace) noexcept {
  Penetration result;
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose) {
    result.status = QueryStatus::invalid_pose;
    return result;
  }
  const SphereTree tree_a = sphere_tree(a.tree, settings.measure);
  const SphereTree tree_b = sphere_tree(b.tree, settings.measure);
  Descent descent(tree_a, tree_b, *pose, settings, workspace.impl());
  descent.run();
  const Overlap overlap = descent.overlap();

  // No point is counted more often than κ A's κ B, nor beyond either tree's own volume.
  const double scale = pose->a_from_b.scale;
  const double volume_a = tree_a.header->volume_sum;
  const double volume_b = tree_b.header->volume_sum * (scale * scale * scale);
  const double cap = (1 + 1e-9) * std::min(volume_a * static_cast<double>(tree_b.header->overlap),
                                           volume_b * static_cast<double>(tree_a.header->overlap));
  const double sure = overlap.volume - descent.left_guess();
  const double lowest = std::max(0.0, sure - overlap.error);
  const double highest =
      std::max(lowest, std::min(cap, sure + overlap.error + descent.left_bound()));

  const double unit = pose->unit_a;
  const double unit3 = unit * unit * unit;
  result.volume = unit3 * std::clamp(overlap.volume, lowest, highest);
  result.volume_min = unit3 * lowest;
  result.volume_max = unit3 * highest;
  result.node_visits = descent.visits();
  result.sphere_pairs = descent.lenses();
  if (descent.stopped()) result.status = QueryStatus::budget_exhausted;
  if (overlap.volume > 0) {
    const Eigen::Vector3d origin_b(pose->a_from_b.t[0], pose->a_from_b.t[1], pose->a_from_b.t[2]);
    result.centroid = pose->to_world(overlap.moment / overlap.volume + origin_b);
  }
  result.translation_gradient = unit * unit * (pose->rotation_a * overlap.force);
  result.rotation_gradient = unit3 * (pose->rotation_a * overlap.torque) +
                             pose->unit_offset_b.cross(result.translation_gradient);
  return result;
}

}  // namespace ist
