#include "query/tree_overlap/descent.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "query/base/precision.h"
#include "query/kernel/lens.h"
#include "query/kernel/node_kernel.h"
#include "query/tree_overlap/answer.h"

namespace ist {
namespace {

// Sums whose bound on rounding exceeds this share are repeated in double. The bound is at least
// fifty times the rounding, so float keeps 1e-5 (property_query, NoGrazingPairIsLost).
constexpr double kGrazing = 5e-4;

/// Two nodes in A's unit frame.
struct Nodes {
  Nodes(const SphereTree& a, TreeNode node_a, const SphereTree& b, TreeNode node_b,
        const Similarity& a_from_b)
      : ball_a(a.ball(node_a)),
        sums_a(a.sums(node_a.level, node_a.block)),
        sums_b(b.sums(node_b.level, node_b.block)) {
    const NodeBall ball_b = b.ball(node_b);
    centre_a = vector(ball_a.centre);
    centre_b = mapped(a_from_b, ball_b.centre);
    radius_b = ball_b.r * a_from_b.scale;
    volume_b = sums_b.volume * (a_from_b.scale * a_from_b.scale * a_from_b.scale);
    distance = (centre_b - centre_a).norm();
  }

  /// An upper bound on the sum over all sphere pairs below (docs/design.md 7): every point of the
  /// overlap lies in at most κ spheres of either tree, and in both balls.
  double bound() const {
    // Covers the rounding of the centres, so that no touching pair seems disjoint.
    const double rounding = 1e-14 * (centre_a.norm() + centre_b.norm() + ball_a.r + radius_b);
    const Lens<double> outer = lens(ball_a.r + rounding, radius_b + rounding, distance);
    return (1 + 1e-9) * std::min({sums_b.overlap * sums_a.volume, sums_a.overlap * volume_b,
                                  sums_a.overlap * sums_b.overlap * outer.volume()});
  }

  /// The estimated overlap of both nodes as balls of uniform density, at most `most`. `origin`: of
  /// B's unit frame.
  Overlap estimate(double most, const Eigen::Vector3d& origin) const {
    Overlap guess;
    const Lens<double> inner = lens(ball_a.r, radius_b, distance);
    const double overlap = inner.volume();
    if (!(overlap > 0)) return guess;
    const double density_a = sums_a.volume / (kBallVolume * ball_a.r * ball_a.r * ball_a.r);
    const double density_b = volume_b / (kBallVolume * radius_b * radius_b * radius_b);
    guess.volume = std::min(density_a * density_b * overlap, most);
    const double share = guess.volume / overlap;
    if (distance > 0) guess.force = share * inner.derivative() / distance * (centre_b - centre_a);
    const Eigen::Vector3d centre =
        (inner.cap_a * centre_a + inner.cap_b * centre_b) / (inner.cap_a + inner.cap_b);
    guess.torque = (centre - origin).cross(guess.force);
    guess.moment = guess.volume * (centre - origin);
    return guess;
  }

  NodeBall ball_a;
  NodeSums sums_a, sums_b;
  Eigen::Vector3d centre_a, centre_b;
  double radius_b, volume_b, distance;
};

/// Larger bounds first; a total order, since no two pairs are equal.
bool before(const RankedPair& l, const RankedPair& r) {
  if (l.bound != r.bound) return l.bound > r.bound;
  return l.a != r.a ? l.a < r.a : l.b < r.b;
}

}  // namespace

bool opens_a(const SphereTree& a, int level_a, const SphereTree& b, int level_b,
             double scale) noexcept {
  return opens_a(level_a, a.typical_cube(level_a), level_b, b.typical_cube(level_b), scale);
}

Descent::Descent(const SphereTree& a, const SphereTree& b, const RelativePose& pose,
                 const DescentLimits& limits, Workspace::Impl& scratch, ContactBins* bins)
    : a_(a),
      b_(b),
      pose_(pose),
      map_(pose.a_from_b),
      precision_(precision_for(a.root(), b.root(), pose.a_from_b.scale)),
      limits_(limits),
      scratch_(scratch),
      bins_(bins),
      budget_(limits.max_visits) {}

void Descent::run() noexcept {
  level_a_ = a_.top;
  level_b_ = b_.top;
  scratch_.now.a[0] = scratch_.now.b[0] = 0;
  scratch_.now.size = Nodes(a_, {level_a_, 0}, b_, {level_b_, 0}, map_).bound() > 0 ? 1 : 0;
  while (level_a_ > 0 || level_b_ > 0) {
    if (!open_level()) return;
  }
  open_leaves();
}

Overlap Descent::overlap() const {
  Overlap result = sure();
  result.add(unopened_);
  return result;
}

Overlap Descent::sure() const {
  Overlap result = finish(sums_, precision_);
  Overlap contained = contained_overlap(true, contained_a_);
  contained.add(contained_overlap(false, contained_b_));
  result.add(contained);
  result.error += sum_rounding(precision_) * contained.volume;
  return result;
}

bool Descent::open_level() {
  const bool open_a = opens_a(a_, level_a_, b_, level_b_, map_.scale);
  PairList& now = scratch_.now;
  PairList& next = scratch_.next;
  choose();
  const NodeStage stage =
      open_a ? NodeStage{&a_, &b_, level_a_, level_b_, &map_, precision_}
             : NodeStage{&b_, &a_, level_b_, level_a_, &pose_.b_from_a, precision_};
  next.size = 0;
  std::size_t done = 0;
  while (done < now.size) {
    const std::size_t free = (scratch_.capacity - next.size) / kWidth;
    const std::size_t n = budget_.grant(std::min({kNodePairs, now.size - done, free}));
    if (n == 0) break;
    open_pairs(stage, open_a, done, n);
    done += n;
  }
  const bool finished = done == now.size;
  if (!finished) estimate_unopened(now, done);
  --(open_a ? level_a_ : level_b_);
  std::swap(now, next);
  if (!finished) estimate_unopened(now, 0);
  return finished;
}

void Descent::open_pairs(const NodeStage& stage, bool open_a, std::size_t from, std::size_t n) {
  const PairList& now = scratch_.now;
  PairList& next = scratch_.next;
  const std::uint32_t* const x = (open_a ? now.a : now.b).get() + from;
  const std::uint32_t* const y = (open_a ? now.b : now.a).get() + from;
  std::uint32_t* const out_x = (open_a ? next.a : next.b).get() + next.size;
  std::uint32_t* const out_y = (open_a ? next.b : next.a).get() + next.size;
  if (stage.level_y != kSphereLevel) {
    next.size += open_nodes(stage, x, y, n, out_x, out_y, nullptr);
    return;
  }
  std::uint32_t contained_x[kWidth * (kNodePairs + 1)], contained_y[kWidth * (kNodePairs + 1)];
  ContainedNodes contained{contained_x, contained_y};
  next.size += open_nodes(stage, x, y, n, out_x, out_y, &contained);
  add_contained(open_a, stage.level_x - 1, contained);
}

void Descent::add_contained(bool of_a, int level, const ContainedNodes& contained) {
  const SphereTree& tree = of_a ? a_ : b_;
  add_subtrees(tree, level, contained.x, contained.size, of_a ? contained_a_ : contained_b_);
  if (bins_ == nullptr) return;
  for (std::size_t i = 0; i < contained.size; ++i) {
    SubtreeSums sums;
    add_subtrees(tree, level, contained.x + i, 1, sums);
    bins_->add_guess(of_a ? level : kSphereLevel, of_a ? contained.x[i] : contained.y[i],
                     of_a ? kSphereLevel : level, of_a ? contained.y[i] : contained.x[i],
                     contained_overlap(of_a, sums));
  }
}

Overlap Descent::contained_overlap(bool of_a, const SubtreeSums& contained) const {
  if (!of_a) return whole_spheres(contained, map_);
  Overlap overlap = whole_spheres(contained, Similarity::identity());
  overlap.moment -= overlap.volume * vector(map_.t);
  return overlap;
}

void Descent::open_leaves() {
  PairList& now = scratch_.now;
  if (now.size > 0) scratch_.leaves->forget(precision_);
  choose();
  const std::size_t done = budget_.grant(now.size);
  add_leaves(0, done);
  estimate_unopened(now, done);
  now.size = done;

  // In float a few grazing lenses are mostly rounding; shallow contacts have few.
  const Overlap sum = sure();
  if (precision_ == Precision::float32 && !limits_.keep_rounding &&
      sum.error > kGrazing * sum.volume && now.size > 0) {
    precision_ = Precision::float64;
    scratch_.leaves->forget(precision_);
    sums_ = LeafSums();
    if (bins_ != nullptr) bins_->forget_sums();
    add_leaves(0, now.size);
  }
}

void Descent::add_leaves(std::size_t from, std::size_t n) {
  if (n == 0) return;
  const std::uint32_t* const a = scratch_.now.a.get() + from;
  const std::uint32_t* const b = scratch_.now.b.get() + from;
  LeafStage stage{&a_, &b_, level_a_, level_b_, &map_, precision_};
  if (bins_ != nullptr) stage.bins = bins_->touch(level_a_, a, level_b_, b, n);
  add_leaf_pairs(stage, *scratch_.leaves, a, b, n, sums_);
}

void Descent::choose() {
  const std::size_t left = budget_.left();
  PairList& now = scratch_.now;
  PairList& next = scratch_.next;
  if (left == 0 || now.size <= left) return;
  RankedPair* ranked = scratch_.ranked.get();
  double* bounds = scratch_.bounds.get();
  for (std::size_t i = 0; i < now.size; ++i) {
    bounds[i] = Nodes(a_, {level_a_, now.a[i]}, b_, {level_b_, now.b[i]}, map_).bound();
    ranked[i] = {bounds[i], now.a[i], now.b[i]};
  }
  RankedPair* const last = ranked + left - 1;
  std::nth_element(ranked, last, ranked + now.size, before);
  std::size_t chosen = 0, others = left;
  for (std::size_t i = 0; i < now.size; ++i) {
    // (both lists stay within capacity even if a damaged asset's bounds are NaN)
    const bool is_other =
        others < now.size && (chosen == left || before(*last, {bounds[i], now.a[i], now.b[i]}));
    std::size_t& to = is_other ? others : chosen;
    next.a[to] = now.a[i];
    next.b[to++] = now.b[i];
  }
  next.size = now.size;
  std::swap(now, next);
}

void Descent::estimate_unopened(const PairList& list, std::size_t from) {
  Overlap guesses;
  for (std::size_t i = from; i < list.size; ++i) {
    const Nodes nodes(a_, {level_a_, list.a[i]}, b_, {level_b_, list.b[i]}, map_);
    stopped_ = true;
    const double bound = nodes.bound();
    unopened_bound_ += bound;
    const Overlap guess = nodes.estimate(bound, vector(map_.t));
    guesses.add(guess);
    if (bins_ != nullptr) bins_->add_guess(level_a_, list.a[i], level_b_, list.b[i], guess);
  }
  unopened_.add(guesses);
}

Penetration Descent::penetration() const noexcept {
  const Overlap overlap = this->overlap();

  // Each point is counted at most κ_A κ_B times, which also limits the sum by either tree's volume.
  const double scale = pose_.a_from_b.scale;
  const double volume_a = a_.header->volume_sum;
  const double volume_b = b_.header->volume_sum * (scale * scale * scale);
  const double cap = (1 + 1e-9) * std::min(volume_a * static_cast<double>(b_.header->overlap),
                                           volume_b * static_cast<double>(a_.header->overlap));
  const double sure = overlap.volume - unopened_.volume;
  const double lowest = std::max(0.0, sure - overlap.error);
  const double highest = std::max(lowest, std::min(cap, sure + overlap.error + unopened_bound_));

  Penetration result = world_answer(overlap, lowest, highest, pose_);
  result.node_visits = budget_.visits();
  result.sphere_pairs = sums_.lenses + contained_a_.spheres + contained_b_.spheres;
  if (stopped_) result.status = QueryStatus::budget_exhausted;
  const double unit = pose_.unit_a;
  return kept_within(std::min(volume_a, volume_b) * (unit * unit * unit), result);
}

}  // namespace ist
