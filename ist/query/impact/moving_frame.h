#pragma once

#include <ist/time_of_impact.h>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

#include "query/base/budget.h"
#include "query/base/relative_pose.h"
#include "query/scratch/workspace.h"

namespace ist {

/// Sine and cosine of h in [−π/2, π/2]. Same bits on every processor, unlike the C library's.
struct SineCosine {
  double sine, cosine;
};
SineCosine sine_cosine(double h) noexcept;

/// A rotation at constant speed about a fixed axis, after one at time 0.
class Turning {
 public:
  Turning() = default;
  Turning(const Eigen::Quaterniond& start, const Eigen::Vector3d& angular_velocity) noexcept;
  Eigen::Quaterniond at(double time) const noexcept;

 private:
  Eigen::Quaterniond start_ = Eigen::Quaterniond::Identity();
  Eigen::Vector3d axis_ = Eigen::Vector3d::Zero();
  double turns_ = 0;  ///< a unit of time
};

/// One body of a pair. A point x of its unit frame is at R(t) · unit · (x − centre) from the point
/// of the body that moves straight.
struct MovingBody {
  Turning turning;
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();  ///< angular velocity, world
  double spin_speed = 0;                           ///< its length
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double unit = 1;
  double reach = 0;  ///< no point of the body is further from its centre
};

/// Two moving bodies in a frame that moves with A's straight point without rotation, so that their
/// common motion cancels first. The unit of length is that of A's unit frame.
struct MovingFrame {
  MovingBody a, b;
  Eigen::Vector3d between = Eigen::Vector3d::Zero();   ///< from A's straight point to B's at 0
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< of B's straight point
  double speed = 0;                                    ///< its length
  double unit = 1;                                     ///< [u]
  Eigen::Vector3d world = Eigen::Vector3d::Zero();     ///< [u] A's straight point at time 0
  Eigen::Vector3d drift = Eigen::Vector3d::Zero();     ///< [u/T] its velocity
  RelativePose start;                                  ///< at time 0

  Eigen::Vector3d to_world(const Eigen::Vector3d& x, double time) const {
    return world + drift * time + unit * x;
  }
};

struct Placement {
  double time = -1;
  Eigen::Matrix3d a, b;     ///< unit · R
  Eigen::Vector3d between;  ///< from A's straight point to B's
  /// Bound on the error of distances computed from these, and on the motion within the rounding of
  /// `time`.
  double error = std::numeric_limits<double>::infinity();
};

Placement place(const MovingFrame& frame, double time) noexcept;

/// Empty if a pose or motion is not usable.
std::optional<MovingFrame> moving_frame(const PlacedAsset& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept;
/// A shape's unit frame is its own frame.
std::optional<MovingFrame> moving_frame(const PlacedShape& a, const PlacedAsset& b,
                                        const Motions& motions, double duration) noexcept;

/// The time for which a gap lasts if it shrinks at `rate`, a speed that grows by at most `bend`.
double safe_step(double gap, double rate, double bend) noexcept;

// Pairs of balls further apart than this fraction of the larger radius are advanced, others opened.
inline constexpr double kFarApart = 0.05;

// An impact is reported once the gap is this fraction of the tolerance. Steps end at half the
// tolerance, so that none is too short to advance.
inline constexpr double kReported = 0.75;

/// What a step leaves of a pair's gap: half of the tolerance, or of a gap that may be reported.
inline double gap_left(double gap, double tolerance) noexcept {
  return (gap > kReported * tolerance ? tolerance : gap) / 2;
}

/// The outcome of a pair, in the frame's unit of length.
struct ImpactFound {
  ImpactKind kind = ImpactKind::no_impact;
  double time = 0;
  double gap = 0;       ///< lower bound on the distance at this pair
  double distance = 0;  ///< upper bound
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero(), point_b = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
};

/// Conservative advancement of pairs of nodes. Each is known to be clear up to its own time. The
/// earliest is visited next, so all are clear up to that time. A pair that stays clear to the end
/// is dropped.
class ImpactLoop {
 public:
  ImpactLoop(const MovingFrame& frame, double tolerance, const ImpactSettings& settings,
             Workspace::Impl& scratch) noexcept
      : end(settings.duration),
        tolerance(tolerance),
        frame_(frame),
        waiting_(scratch.ranked.get()),
        capacity_(scratch.capacity),
        budget_(visit_limit(settings.max_visits)),
        floor_(tolerance / 2) {}

  const double end;
  const double tolerance;

  /// Calls `visit(a, b, at)`, which decides on a pair by one of the functions that follow.
  template <class Visit>
  TimeOfImpact run(const Visit& visit) noexcept {
    Placement at;
    while (size_ > 0 && !full_) {
      const RankedPair pair = waiting_[0];
      // At time 0 all pairs are visited, since an overlap takes precedence over an impact.
      if (found_.kind != ImpactKind::no_impact && pair.bound > 0) break;
      if (found_.kind == ImpactKind::overlapping) break;
      if (budget_.grant(1) == 0) {
        full_ = true;
        break;
      }
      std::pop_heap(waiting_, waiting_ + size_--, Later());
      now_ = pair.bound;
      if (at.time != now_) at = place(frame_, now_);
      visit(pair.a, pair.b, at);
    }
    if (size_ > 0 && full_) now_ = waiting_[0].bound;
    return answer();
  }

  /// The pair keeps a gap of at least `left` for another `step`.
  void clear_for(double step, std::uint32_t a, std::uint32_t b,
                 double left = std::numeric_limits<double>::infinity()) noexcept {
    floor_ = std::min(floor_, left);
    if (now_ + step < end) push(now_ + step, a, b);
  }

  /// Visits the pair again at the same time.
  void visit_again(std::uint32_t a, std::uint32_t b) noexcept { push(now_, a, b); }

  /// True if the step changes the time, which is rounded.
  bool advances(double step) const noexcept { return now_ + step > now_; }

  void found(const ImpactFound& what) noexcept {
    if (found_.kind != ImpactKind::overlapping &&
        (what.kind != ImpactKind::impact || found_.kind == ImpactKind::no_impact))
      found_ = what;
    found_.time = now_;
  }

  void count_surface_pair() noexcept { ++surface_pairs_; }

 private:
  /// A total order, so that visits do not depend on the heap's implementation.
  struct Later {
    bool operator()(const RankedPair& x, const RankedPair& y) const noexcept {
      if (x.bound != y.bound) return x.bound > y.bound;
      return x.a != y.a ? x.a > y.a : x.b > y.b;
    }
  };

  void push(double time, std::uint32_t a, std::uint32_t b) noexcept {
    if (size_ == capacity_) {
      full_ = true;
      lost_ = std::min(lost_, time);
      return;
    }
    waiting_[size_++] = {time, a, b};
    std::push_heap(waiting_, waiting_ + size_, Later());
  }

  TimeOfImpact answer() const noexcept {
    TimeOfImpact result;
    result.node_visits = budget_.visits();
    result.surface_pairs = surface_pairs_;
    result.kind = found_.kind;
    const bool decided = found_.kind != ImpactKind::no_impact;
    if (decided) {
      result.time = found_.time;
      if (found_.kind == ImpactKind::overlapping) return result;
      result.distance_min = frame_.unit * std::clamp(found_.gap, 0.0, floor_);
      result.distance_max = frame_.unit * std::max(0.0, found_.distance);
      result.point_a = frame_.to_world(found_.point_a, result.time);
      result.point_b = frame_.to_world(found_.point_b, result.time);
      result.normal = found_.normal;
      return result;
    }
    result.time = end;
    if (full_) {
      result.status = QueryStatus::budget_exhausted;
      result.time = std::min(now_, lost_);
    }
    // At time 0 perhaps no pair has been visited.
    result.distance_min = full_ && result.time == 0 ? 0 : frame_.unit * floor_;
    result.distance_max = std::numeric_limits<double>::infinity();
    return result;
  }

  const MovingFrame& frame_;
  RankedPair* const waiting_;  ///< a heap with the earliest pair on top
  const std::size_t capacity_;
  std::size_t size_ = 0;
  Budget budget_;
  double now_ = 0;
  double floor_;  ///< lower bound on all gaps so far, except for those that were found
  double lost_ = std::numeric_limits<double>::infinity();
  bool full_ = false;
  std::uint32_t surface_pairs_ = 0;
  ImpactFound found_;
};

}  // namespace ist
