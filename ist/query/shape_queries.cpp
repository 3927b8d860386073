#include <ist/query.h>
#include <ist/shapes.h>
#include <algorithm>
#include <limits>
#include <optional>
#include <type_traits>

#include "query/base/budget.h"
#include "query/base/no_answer.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/contact/write_patches.h"
#include "query/scratch/workspace.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"
#include "query/solid_queries.h"
#include "query/tree_overlap/answer.h"
#include "query/tree_overlap/open_runs.h"

namespace ist {
namespace {

/// The sums of a traversal of a tree against a surface: summed balls, nodes wholly inside, and half
/// of each unopened node. `bins` get the same sums.
class ProbeTally {
 public:
  ProbeTally(const SphereTree& probes, const RelativePose& pose, ContactBins* bins) noexcept
      : probes_(probes), pose_(pose), map_(pose.a_from_b), bins_(bins) {}

  /// Adds the summed balls of a leaf block.
  void add(std::uint32_t block, const ProbeTotal& part) noexcept {
    total_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, 0, block, part.overlap);
  }

  /// Counts pairs of balls and triangles, or balls that a shape was sampled for.
  void count(std::uint32_t pairs) noexcept { pairs_ += pairs; }

  /// Adds nodes that lie inside.
  void add_contained(int level, const std::uint32_t* nodes, std::size_t n) noexcept {
    add_subtrees(probes_, level, nodes, n, contained_);
    if (bins_ == nullptr) return;
    for (std::size_t i = 0; i < n; ++i) {
      SubtreeSums sums;
      add_subtrees(probes_, level, nodes + i, 1, sums);
      bins_->add_guess(0, 0, level, nodes[i], whole_spheres(sums, map_));
    }
  }

  /// Adds half of a node that was not opened.
  void add_unopened(int level, std::uint32_t block) noexcept {
    const NodeBall ball = probes_.ball(level, block);
    Overlap part;
    part.volume =
        0.5 * (probes_.sums(level, block).volume * (map_.scale * map_.scale * map_.scale));
    part.moment = part.volume * (mapped(map_, ball.centre) - vector(map_.t));
    left_ += 2 * part.volume;
    guess_.add(part);
    if (bins_ != nullptr) bins_->add_guess(0, 0, level, block, part);
    stopped_ = true;
  }

  /// The answer in world units. `off`: bound on the error of the surface, its unit frame.
  Penetration answer(double off, std::uint32_t visits) const noexcept {
    Overlap sum = total_.overlap;
    sum.add(whole_spheres(contained_, map_));
    sum.error = 2 * off * total_.area + 1e-13 * (total_.crossed + sum.volume);
    const double scale = map_.scale;
    const double most = probes_.header->volume_sum * (scale * scale * scale) * (1 + 1e-9);
    const double lowest = std::max(0.0, sum.volume - sum.error);
    const double highest =
        std::max(lowest, std::min(most, sum.volume + sum.error + (1 + 1e-9) * left_));
    add_guess(sum);
    Penetration result = world_answer(sum, lowest, highest, pose_);
    result.node_visits = visits;
    result.sphere_pairs = pairs_ + contained_.spheres;
    if (stopped_) result.status = QueryStatus::budget_exhausted;
    return result;
  }

 private:
  /// Adds half of the unopened nodes. The force is assumed to grow with the volume.
  void add_guess(Overlap& sum) const noexcept {
    if (!(left_ > 0)) return;
    if (sum.volume > 0) {
      const double factor = 1 + guess_.volume / sum.volume;
      sum.force *= factor;
      sum.torque *= factor;
    }
    sum.add(guess_);
  }

  const SphereTree& probes_;
  const RelativePose& pose_;
  const Similarity& map_;
  ContactBins* const bins_;
  ProbeTotal total_;
  SubtreeSums contained_;
  double left_ = 0;  ///< volume of unopened nodes
  Overlap guess_;    ///< half of it
  std::uint32_t pairs_ = 0;
  bool stopped_ = false;
};

/// The overlap of the spheres of a tree with a shape that can be sampled. Level by level: a node
/// whose ball the surface does not reach is wholly inside or outside.
template <class Sampler>
class ShapeDescent {
 public:
  /// All arguments must outlive the traversal. A is the shape.
  ShapeDescent(Sampler& shape, const SphereTree& probes, const RelativePose& pose,
               const DescentLimits& limits, Workspace::Impl& scratch,
               ContactBins* bins = nullptr) noexcept
      : shape_(shape),
        probes_(probes),
        map_(pose.a_from_b),
        scratch_(scratch),
        budget_(limits.max_visits),
        tally_(probes, pose, bins) {}

  void run() noexcept {
    PairList& now = scratch_.now;
    now.a[0] = 0;
    now.size = 1;
    int level = probes_.top;
    for (; level > 0 && now.size > 0; --level) {
      if (!open(level)) return;
      std::swap(scratch_.now, scratch_.next);
    }
    for (std::size_t i = 0; i < now.size; ++i) {
      if (budget_.grant(1) == 0) return add_unopened(0, i);
      sum_block(now.a[i]);
    }
  }

  Penetration penetration() const noexcept {
    const double reach = map_.scale * probes_.header->root[3] + vector(map_.t).norm();
    return tally_.answer(shape_.error() + 1e-15 * reach, budget_.visits());
  }

 private:
  /// Opens the nodes of the current list; false if a limit stopped it, with the rest in the tally.
  bool open(int level) noexcept {
    const PairList& now = scratch_.now;
    PairList& next = scratch_.next;
    next.size = 0;
    std::uint32_t contained[kWidth];
    for (std::size_t i = 0; i < now.size; ++i) {
      const std::uint32_t block = now.a[i];
      if (budget_.grant(1) == 0 || next.size + kWidth > scratch_.capacity) {
        add_unopened(level, i);
        for (std::size_t k = 0; k < next.size; ++k) tally_.add_unopened(level - 1, next.a[k]);
        return false;
      }
      ProbeBalls balls;
      place_probes(probes_, level, block, map_, balls);
      const std::uint32_t used = std::min(kWidth, probes_.count(level - 1) - kWidth * block);
      std::size_t count = 0;
      for (std::uint32_t lane = 0; lane < used; ++lane) {
        const double d = shape_.sample(balls.centre(lane)).distance;
        const double reach = sure_reach(balls.r[lane], shape_.error());
        const std::uint32_t child = kWidth * block + lane;
        if (d >= reach) continue;
        if (d <= -reach) {
          contained[count++] = child;
        } else {
          next.a[next.size++] = child;
        }
      }
      tally_.add_contained(level - 1, contained, count);
    }
    return true;
  }

  void sum_block(std::uint32_t block) noexcept {
    ProbeBalls balls;
    place_probes(probes_, 0, block, map_, balls);
    const std::uint32_t lanes = std::min(kWidth, probes_.header->sphere_count - kWidth * block);
    ProbeTotal part;
    std::uint32_t pairs = 0;
    if constexpr (requires { shape_.block(balls, lanes, map_.t, pairs); }) {
      part = shape_.block(balls, (1u << lanes) - 1, map_.t, pairs);
    } else {
      for (std::size_t i = 0; i < lanes; ++i) {
        const Eigen::Vector3d at = balls.centre(i);
        const BallPart ball = shape_.part(at, balls.r[i]);
        if (!(ball.volume > 0)) continue;
        ++pairs;
        add_part(at - vector(map_.t), ball.volume, Eigen::Vector3d(ball.gradient),
                 Eigen::Vector3d(ball.moment), part.overlap);
        part.area += ball.area;
        if (ball.area > 0) part.crossed += ball_volume(balls.r[i]);
      }
    }
    tally_.add(block, part);
    tally_.count(pairs);
  }

  void add_unopened(int level, std::size_t from) noexcept {
    const PairList& now = scratch_.now;
    for (std::size_t i = from; i < now.size; ++i) tally_.add_unopened(level, now.a[i]);
  }

  Sampler& shape_;
  const SphereTree& probes_;
  const Similarity& map_;
  Workspace::Impl& scratch_;
  Budget budget_;
  ProbeTally tally_;
};

/// The gaps between a shape and a tree's inner spheres and cover balls, in the shape's frame.
template <class Sampler>
class GapSearch : GapStack {
 public:
  GapSearch(Sampler& shape, const SphereTree& tree, const RelativePose& pose,
            const SeparationSettings& settings, Workspace::Impl& scratch) noexcept
      : GapStack(scratch, visit_limit(settings.max_visits), kInfinity, kInfinity),
        shape_(shape),
        tree_(tree),
        pose_(pose),
        map_(pose.a_from_b) {}

  Separation run() noexcept {
    const bool stopped = search(
        {-kInfinity, -kInfinity, 0, 0, tree_.top, 0}, [&](const WaitingPair& pair) { open(pair); },
        [&] { return gap_ <= 0; });
    return answer(stopped);
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  [[gnu::noinline]] void open(const WaitingPair& pair) noexcept {
    const int level = pair.level_a;
    const std::uint32_t below = tree_.count(level - 1);
    for (std::uint32_t lane = 0; lane < kWidth && kWidth * pair.a + lane < below; ++lane) {
      const std::uint32_t child = kWidth * pair.a + lane;
      const NodeBall ball = tree_.ball(level - 1, child);
      const double cover_radius = level == 0 ? static_cast<double>(tree_.sphere_cover[child])
                                             : tree_.cover(level - 1, child);
      const Eigen::Vector3d x = mapped(map_, ball.centre);
      const double distance = shape_.nearest(x).distance;
      const double gap = distance - ball.r * map_.scale;
      const double cover = distance - cover_radius * map_.scale;
      if (!wanted(gap, cover)) continue;
      if (level == 0) {
        ++pairs_;
        cover_ = std::min(cover_, cover);
        if (gap >= gap_) continue;
        gap_ = gap;
        centre_ = x;
        radius_ = ball.r * map_.scale;
        continue;
      }
      add({gap, cover, child, 0, level - 1, 0, gap});
    }
  }

  Separation answer(bool stopped) noexcept {
    Separation result;
    result.node_visits = budget_.visits();
    result.sphere_pairs = pairs_;
    if (stopped) result.status = QueryStatus::budget_exhausted;
    if (gap_ <= 0) return result;
    const double unit = pose_.unit_a;
    const double reach = map_.scale * std::max(tree_.header->root[3], tree_.header->root_cover) +
                         vector(map_.t).norm();
    const double off =
        shape_.error() + distance_error(Precision::float64, reach) + pose_.rounding_of_world();
    result.distance_min = unit * std::max(0.0, cover_ - off);
    if (!(gap_ < kInfinity)) {  // stopped before any sphere
      result.distance = result.distance_max = kInfinity;
      return result;
    }
    result.distance = unit * gap_;
    result.distance_max = unit * (gap_ + off);
    const Eigen::Vector3d outward = shape_.nearest(centre_).gradient;
    const double length = outward.norm();
    const Eigen::Vector3d out =
        length > 0 ? Eigen::Vector3d(outward / length) : Eigen::Vector3d::Zero().eval();
    result.point_b = pose_.to_world(centre_ - radius_ * out);
    result.point_a = pose_.to_world(centre_ - (radius_ + gap_) * out);
    result.normal = pose_.rotation() * out;
    return result;
  }

  Sampler& shape_;
  const SphereTree& tree_;
  const RelativePose& pose_;
  const Similarity& map_;
  Eigen::Vector3d centre_ = Eigen::Vector3d::Zero();
  double radius_ = 0;
  std::uint32_t pairs_ = 0;
};

/// Best-first search for an overlap: opens the ball deepest for its size. All in the shape's frame.
template <class Sampler>
class ShapeOverlapSearch {
 public:
  ShapeOverlapSearch(Sampler& shape, const SphereTree& tree, const RelativePose& pose,
                     Workspace::Impl& scratch) noexcept
      : shape_(shape), tree_(tree), map_(pose.a_from_b), waiting_(scratch) {
    const double reach = map_.scale * std::max(tree_.header->root[3], tree_.header->root_cover) +
                         vector(map_.t).norm();
    error_ = shape_.error() + distance_error(Precision::float64, reach) + pose.rounding_of_world();
  }

  YesNo run() noexcept {
    if (gap(tree_.ball(tree_.top, 0).centre, tree_.header->root_cover) > error_) return YesNo::no;
    return waiting_.search({0, 0, tree_.top, 0}, covers_touch_,
                           [&](const NodePair& pair) { return open(pair); });
  }

 private:
  /// Grids beyond their border, and functions, give only a lower bound on the distance.
  static constexpr bool kTrueDistances =
      !std::is_same_v<Sampler, GridSampler> && !std::is_same_v<Sampler, FunctionSampler>;

  /// The depth of a point in the shape, negative outside.
  double depth_at(const double (&centre)[3]) noexcept {
    return -shape_.nearest(mapped(map_, centre)).distance;
  }
  double gap(const double (&centre)[3], double radius) noexcept {
    return -depth_at(centre) - radius * map_.scale;
  }

  /// Adds children; true if a sphere below certainly overlaps the shape.
  bool open(const NodePair& pair) noexcept {
    const int level = pair.level_a;
    const std::uint32_t below = tree_.count(level - 1);
    waiting_.start(pair, true);
    for (std::uint32_t lane = 0; lane < kWidth && kWidth * pair.a + lane < below; ++lane) {
      const std::uint32_t child = kWidth * pair.a + lane;
      const NodeBall ball = level == 0 ? tree_.sphere(pair.a, lane) : tree_.ball(level - 1, child);
      const double cover = level == 0 ? static_cast<double>(tree_.sphere_cover[child])
                                      : tree_.cover(level - 1, child);
      const double depth = depth_at(ball.centre), radius = ball.r * map_.scale;
      // The whole ball is in the shape, or a sphere's centre or a part of it is.
      if (depth - radius > error_) return true;
      if (level == 0 && (depth > error_ || (kTrueDistances && depth + radius > error_)))
        return true;
      const bool touches = -depth - radius <= error_;
      const bool cover_touches = -depth - cover * map_.scale <= error_;
      if (level == 0) {
        covers_touch_ |= cover_touches;
      } else if (touches) {
        waiting_.add(lane, std::max(0.0, 1 - depth / radius), true);
      } else if (cover_touches && !covers_touch_) {
        waiting_.add(lane, -depth / radius, false);
      }
    }
    waiting_.finish();
    return false;
  }

  Sampler& shape_;
  const SphereTree& tree_;
  const Similarity& map_;
  double error_;  ///< of a gap: the shape's, and rounding
  OpenRuns waiting_;
  bool covers_touch_ = false;
};

/// `tree`: of B, which bins refer to.
Penetration penetrate(const PlacedShape& a, const SphereTree& tree,
                      const std::optional<RelativePose>& pose, const DescentLimits& limits,
                      Workspace& workspace, ContactBins* bins) noexcept {
  if (!pose || workspace.impl() == nullptr) return invalid_input<Penetration>();
  if (bins != nullptr) bins->start(tree, true);
  return with_shape(
      a.shape,
      [&](auto& shape) {
        ShapeDescent descent(shape, tree, *pose, limits, *workspace.impl(), bins);
        descent.run();
        return descent.penetration();
      },
      invalid_input<Penetration>);
}

}  // namespace

Penetration find_penetration(const PlacedShape& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept {
  if (settings.measure == Measure::exact || lack_spheres(a, b)) return missing_data<Penetration>();
  return penetrate(a, sphere_tree(b.asset, settings.measure), relative_pose(a.pose, a.scale, b),
                   limits_of(settings), workspace, nullptr);
}

Separation find_separation(const PlacedShape& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return missing_data<Separation>();
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<Separation>();
  const SphereTree tree = sphere_tree(b.asset, Measure::inner);
  const auto search = [&](auto& shape) {
    const Separation gap = GapSearch(shape, tree, *pose, settings, *workspace.impl()).run();
    const bool farther = settings.max_distance > 0 && gap.distance_min > settings.max_distance;
    return farther ? farther_than(settings.max_distance) : gap;
  };
  return with_shape(a.shape, search, invalid_input<Separation>);
}

YesNoAnswer find_overlap(const PlacedShape& a, const PlacedAsset& b,
                         Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return {YesNo::unknown, QueryStatus::missing_data};
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  if (!pose || workspace.impl() == nullptr) return {YesNo::unknown, QueryStatus::invalid_input};
  const SphereTree tree = sphere_tree(b.asset, Measure::inner);
  const auto search = [&](auto& shape) {
    return YesNoAnswer{ShapeOverlapSearch(shape, tree, *pose, *workspace.impl()).run(),
                       QueryStatus::ok};
  };
  return with_shape(a.shape, search, [] {
    return YesNoAnswer{YesNo::unknown, QueryStatus::invalid_input};
  });
}

ContactPatches find_patches(const PlacedShape& a, const PlacedAsset& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept {
  if (settings.measure == Measure::exact || lack_spheres(a, b))
    return missing_data<ContactPatches>();
  if (workspace.impl() == nullptr) return invalid_input<ContactPatches>();
  ContactPatches result;
  ContactBins& bins = workspace.impl()->contact;
  const SphereTree tree = sphere_tree(b.asset, settings.measure);
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  result.penetration = penetrate(a, tree, pose, limits_of(settings), workspace, &bins);
  if (result.penetration.status == QueryStatus::invalid_input) return result;
  const double radius = tree.header->root[3] * pose->a_from_b.scale;
  result.count = write_patches({bins, bins.collect(Precision::float64), *pose, radius},
                               result.penetration, patches);
  finish_patches(patches.first(result.count), b.pose, 2 * pose->unit_a * radius);
  return result;
}

}  // namespace ist
