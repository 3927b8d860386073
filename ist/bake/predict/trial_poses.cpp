#include "bake/predict/trial_poses.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include <ist/query.h>

#include "bake/predict/shared_volume.h"
#include "bake/predict/trial_random.h"

namespace ist {
namespace {

using Eigen::Vector3d;

// Of a class's poses, as many are tried again where no place or no truth was found.
constexpr std::uint32_t kTriesPerPose = 4;
// Size of a contained B over A's, if it finds room; half of it if not, and so on.
constexpr double kContainedSize = 0.15;
constexpr std::uint32_t kContainedTries = 400;  // for each pose
constexpr int kApproachSteps = 24;
constexpr int kBisections = 40;

/// Ball around a solid's spheres in the mesh's frame.
struct Ball {
  Vector3d centre;
  double radius;
};

Ball root_ball(const TreeView& tree) {
  const AssetHeader& h = tree.header();
  const double scale = std::ldexp(1.0, h.exponent);
  const double* root = h.matched_tree.root;
  return {
      scale * Vector3d(root[0], root[1], root[2]) + Vector3d(h.centre[0], h.centre[1], h.centre[2]),
      scale * root[3]};
}

Pose pose_of(const Eigen::Quaterniond& q, const Vector3d& t) {
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

class Trials {
 public:
  Trials(const TrialBody& a, const TrialBody& b, double relative_error, std::uint64_t seed,
         const std::function<bool(double)>& go_on)
      : a_(a),
        b_(b),
        ball_a_(root_ball(a.tree)),
        ball_b_(root_ball(b.tree)),
        smaller_(std::min(a.solid.volume(), b.solid.volume())),
        relative_error_(relative_error),
        random_(seed),
        go_on_([this, go_on] { return !go_on || go_on(done_); }) {}

  /// Tells that the `i`-th of `count` poses is next; false: it is not to go on.
  bool next(std::size_t i, std::size_t count) {
    done_ = static_cast<double>(i) / static_cast<double>(count);
    return go_on_();
  }

  /// B approaches A along a random direction until it shares `fraction` of the smaller solid.
  bool approach(double fraction, TrialPose& out) {
    const Eigen::Quaterniond q = random_.rotation();
    const Vector3d direction = random_.direction();
    const auto at = [&](double way) {
      return pose_of(q, ball_a_.centre + way * direction - q * ball_b_.centre);
    };
    const auto ask = [&](const Pose& pose) {
      return penetration({a_.tree, {}, 1}, {b_.tree, pose, 1}, {}, workspace_);
    };
    // From outside in, since solids may have holes in the middle.
    const double start = ball_a_.radius + ball_b_.radius;
    double near = start, far = start;
    for (int i = kApproachSteps; i-- > 0 && near == start;) {
      const double way = start * i / kApproachSteps;
      if (ask(at(way)).volume >= fraction * smaller_) {
        near = way;
      } else {
        far = way;
      }
    }
    if (near == start) return false;
    for (int i = 0; i < kBisections; ++i) {
      const double middle = (near + far) / 2;
      (ask(at(middle)).volume < fraction * smaller_ ? far : near) = middle;
    }
    out.b_in_a = at(near);
    const Vector3d push = ask(out.b_in_a).translation_gradient;
    const Vector3d along = push.norm() > 0 ? push : direction;
    const SharedVolume truth =
        shared_volume(a_.solid, b_.solid, out.b_in_a, 1, along, relative_error_, go_on_);
    if (!(truth.volume > 0) || truth.error > relative_error_ * truth.volume) return false;
    out.volume = truth.volume;
    out.fraction = truth.volume / smaller_;
    for (std::uint32_t k = 1; k < kOverlapClasses; ++k)
      if (out.fraction >= kOverlapClassFloor[k]) {
        out.overlap_class = k;
        return out.fraction <= 0.5;
      }
    return false;
  }

  /// A small B somewhere inside A: the truth is its own volume.
  bool contain(double size, TrialPose& out) {
    out.scale_b = size * ball_a_.radius / ball_b_.radius;
    const Eigen::AlignedBox3d box = a_.solid.bounds();
    Vector3d place;
    for (int k = 0; k < 3; ++k)
      place[k] = box.min()[k] + random_.uniform() * (box.max()[k] - box.min()[k]);
    const Eigen::Quaterniond q = random_.rotation();
    if (a_.solid.signed_distance(place) <= 0) return false;
    out.b_in_a = pose_of(q, place - q * (out.scale_b * ball_b_.centre));
    if (!holds_vertices(out)) return false;
    out.volume = out.scale_b * out.scale_b * out.scale_b * b_.solid.volume();
    out.fraction = 1;
    out.overlap_class = 0;
    // Vertices inside are not all of it.
    const SharedVolume shared =
        shared_volume(a_.solid, b_.solid, out.b_in_a, out.scale_b, Vector3d::UnitX(), 1e-2, go_on_);
    return std::abs(shared.volume - out.volume) <= 3 * shared.error;
  }

  TrialRandom& random() { return random_; }

 private:
  /// Whether all vertices of B lie in A. What is nearer to a place inside than the surface is
  /// inside too, so that few of them need be asked about.
  bool holds_vertices(const TrialPose& pose) {
    constexpr double kSure = 1 - 1e-9;
    constexpr std::size_t kRemembered = 32;
    const Eigen::Matrix3d rotation =
        Eigen::Quaterniond(pose.b_in_a.q[0], pose.b_in_a.q[1], pose.b_in_a.q[2], pose.b_in_a.q[3])
            .toRotationMatrix();
    const Vector3d shift(pose.b_in_a.t[0], pose.b_in_a.t[1], pose.b_in_a.t[2]);
    const MeshView& mesh = b_.solid.arrays();
    std::vector<Ball> inside;
    std::size_t asked = 0;
    for (std::size_t v = 0; v < mesh.vertex_count; ++v) {
      const Vector3d x = b_.solid.frame().from_unit(Vector3d(mesh.vertices + 3 * v));
      const Vector3d at = rotation * (pose.scale_b * x) + shift;
      const auto holds = [&](const Ball& ball) {
        return (at - ball.centre).squaredNorm() < ball.radius * ball.radius;
      };
      if (std::any_of(inside.begin(), inside.end(), holds)) continue;
      const double depth = a_.solid.signed_distance(at);
      if (depth <= 0) return false;
      const Ball ball = {at, kSure * depth};
      if (inside.size() < kRemembered)
        inside.push_back(ball);
      else
        inside[asked % kRemembered] = ball;
      constexpr std::size_t kBetweenWords = 1024;
      if (++asked % kBetweenWords == 0 && !go_on_()) return false;
    }
    return true;
  }

  const TrialBody& a_;
  const TrialBody& b_;
  const Ball ball_a_, ball_b_;
  const double smaller_, relative_error_;
  TrialRandom random_;
  double done_ = 0;
  const std::function<bool()> go_on_;
  Workspace workspace_;
};

}  // namespace

std::vector<TrialPose> trial_poses(const TrialBody& a, const TrialBody& b, std::uint32_t per_class,
                                   double relative_error, std::uint64_t seed,
                                   const std::function<bool(double)>& go_on) {
  Trials trials(a, b, relative_error, seed, go_on);
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
      // From the class's floor up a decade, evenly on the logarithm; deep ones evenly up to 0.5.
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
                                        std::uint32_t count, double relative_error,
                                        std::uint64_t seed,
                                        const std::function<bool(double)>& go_on) {
  Trials trials(a, b, relative_error, seed, go_on);
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
