#include "bake/predict/trial_poses.h"

#include <ist/query.h>
#include <algorithm>
#include <limits>

namespace ist {
namespace {

using Eigen::Vector3d;

// Retries per pose if no place or no true volume was found.
constexpr std::uint32_t kTriesPerPose = 4;
// Size of a contained B over A's, halved until it fits.
constexpr double kContainedSize = 0.15;
constexpr std::uint32_t kContainedTries = 400;  // for each pose
constexpr int kApproachSteps = 24;
constexpr int kBisections = 12;

Pose pose_of(const Eigen::Quaterniond& q, const Vector3d& t) {
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

class Trials {
 public:
  Trials(const TrialBody& a, const TrialBody& b, std::uint64_t seed,
         const std::function<bool(double)>& go_on)
      : a_(a),
        b_(b),
        centre_a_(a.mesh.header().ball_centre),
        centre_b_(b.mesh.header().ball_centre),
        radius_a_(a.mesh.header().ball_radius),
        radius_b_(b.mesh.header().ball_radius),
        smaller_(std::min(a.mesh.volume(), b.mesh.volume())),
        random_(seed),
        go_on_([this, go_on] { return !go_on || go_on(done_); }) {}

  /// Announces that the `i`-th of `count` poses is next; false: stop.
  bool next(std::size_t i, std::size_t count) {
    done_ = static_cast<double>(i) / static_cast<double>(count);
    return go_on_();
  }

  /// B approaches A along a random direction until it shares `fraction` of the smaller solid.
  bool approach(double fraction, TrialPose& out) {
    const Eigen::Quaterniond q = random_.rotation();
    const Vector3d direction = random_.direction();
    // The search goes from outside in, since solids may have holes in the middle.
    const double start = radius_a_ + radius_b_;
    double near = start, far = start;
    const auto shares = [&](double travel) {
      const Pose pose = pose_of(q, centre_a_ + travel * direction - q * centre_b_);
      const double volume = shared_volume(pose, 1);
      if (!(volume >= fraction * smaller_)) {
        far = travel;
        return false;
      }
      near = travel;
      out.b_in_a = pose;
      out.volume = volume;
      return true;
    };
    for (int i = kApproachSteps; i-- > 0 && near == start;) {
      if (!go_on_()) return false;
      shares(start * i / kApproachSteps);
    }
    if (near == start) return false;
    for (int i = 0; i < kBisections; ++i) {
      if (!go_on_()) return false;
      shares((near + far) / 2);
    }
    out.fraction = out.volume / smaller_;
    for (std::uint32_t k = 1; k < kOverlapClasses; ++k)
      if (out.fraction >= kOverlapClassFloor[k]) {
        out.overlap_class = k;
        return out.fraction <= 0.5;
      }
    return false;
  }

  /// Places a small B somewhere inside A.
  bool contain(double size, TrialPose& out) {
    constexpr double kAll = 1 - 1e-9;
    out.scale_b = size * radius_a_ / radius_b_;
    const Eigen::AlignedBox3d box = a_.solid.bounds();
    Vector3d place;
    for (int k = 0; k < 3; ++k)
      place[k] = box.min()[k] + random_.uniform() * (box.max()[k] - box.min()[k]);
    const Eigen::Quaterniond q = random_.rotation();
    if (a_.solid.signed_distance(place) >= 0) return false;
    out.b_in_a = pose_of(q, place - q * (out.scale_b * centre_b_));
    out.volume = out.scale_b * out.scale_b * out.scale_b * b_.mesh.volume();
    out.fraction = 1;
    out.overlap_class = 0;
    return shared_volume(out.b_in_a, out.scale_b) >= kAll * out.volume;
  }

  TrialRandom& random() { return random_; }

 private:
  /// NaN if it is not known.
  double shared_volume(const Pose& b_in_a, double scale_b) {
    const Penetration found = penetration({a_.mesh, {}, 1}, {b_.mesh, b_in_a, scale_b},
                                          {.measure = Measure::exact}, workspace_);
    return found.status == QueryStatus::ok ? found.volume
                                           : std::numeric_limits<double>::quiet_NaN();
  }

  const TrialBody& a_;
  const TrialBody& b_;
  const Vector3d centre_a_, centre_b_;  ///< of the balls around them
  const double radius_a_, radius_b_;
  const double smaller_;
  TrialRandom random_;
  double done_ = 0;
  const std::function<bool()> go_on_;
  Workspace workspace_;
};

}  // namespace

std::vector<TrialPose> trial_poses(const TrialBody& a, const TrialBody& b, std::uint32_t per_class,
                                   std::uint64_t seed, const std::function<bool(double)>& go_on) {
  Trials trials(a, b, seed, go_on);
  std::vector<TrialPose> poses;
  for (std::uint32_t k = 0; k < kOverlapClasses; ++k) {
    std::uint32_t found = 0;
    const auto next = [&] {
      return trials.next(std::size_t{k} * per_class + found,
                         std::size_t{kOverlapClasses} * per_class);
    };
    if (k == 0) {
      for (double size = kContainedSize; found == 0 && size > 0.01; size /= 2)
        for (std::uint32_t i = 0; i < kContainedTries * per_class && found < per_class; ++i) {
          if (!next()) return poses;
          TrialPose pose;
          if (!trials.contain(size, pose)) continue;
          poses.push_back(pose);
          ++found;
        }
      continue;
    }
    for (std::uint32_t i = 0; i < kTriesPerPose * per_class && found < per_class; ++i) {
      if (!next()) return poses;
      // From the class's lower limit up a decade, evenly on the logarithm; deep overlaps evenly up
      // to 0.5.
      const double fraction = k == 1 ? kOverlapClassFloor[k] + 0.4 * trials.random().uniform()
                                     : random_in_decade(kOverlapClassFloor[k], trials.random());
      TrialPose pose;
      if (!trials.approach(fraction, pose)) continue;
      poses.push_back(pose);
      ++found;
    }
  }
  return poses;
}

std::vector<TrialPose> trial_poses_near(double overlap, const TrialBody& a, const TrialBody& b,
                                        std::uint32_t count, std::uint64_t seed,
                                        const std::function<bool(double)>& go_on) {
  Trials trials(a, b, seed, go_on);
  std::vector<TrialPose> poses;
  for (std::uint32_t i = 0; i < kTriesPerPose * count && poses.size() < count; ++i) {
    if (!trials.next(poses.size(), count)) return poses;
    const double fraction = random_in_decade(overlap / kHalfDecade, trials.random());
    TrialPose pose;
    if (fraction <= 0.5 && trials.approach(fraction, pose) && is_near(pose, overlap))
      poses.push_back(pose);
  }
  return poses;
}

bool is_near(const TrialPose& pose, double overlap) {
  return pose.overlap_class != 0 && pose.fraction >= overlap / kHalfDecade &&
         pose.fraction <= overlap * kHalfDecade;
}

}  // namespace ist
