#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "robots/description/kinematics.h"
#include "robots/description/robot_model.h"
#include "robots/description/sphere_files.h"

namespace ist {

/// True if the solids of two links overlap: indices of the compared links, and the pose of b's
/// frame in a's. Called from many threads at once.
using LinksOverlap =
    std::function<bool(std::size_t a, std::size_t b, const Eigen::Isometry3d& b_in_a)>;

/// Two links, and the results of their comparison.
struct LinkPair {
  std::string a, b;  ///< in the order of the file
  /// The reason why a planner should not compare their spheres; empty: it should compare them.
  ///
  /// Adjacent: a joint connects them, or only links without spheres are between them. Always: the
  /// solids overlapped in all positions tried, and are no larger than the links. Never: in none,
  /// though the spheres did in 1 % or more. Excluded: by the robot's file or SRDF.
  std::string ignored;
  std::size_t tried = 0;  ///< positions of the joints between them that decided it; 0: none did
  // In SelfCollision::samples other positions:
  std::size_t colliding = 0;  ///< the solids overlap
  std::size_t missed = 0;     ///< the solids overlap, and no compared spheres of this pair do
  std::size_t falsely = 0;    ///< compared spheres overlap, and the solids do not

  /// True if `colliding` was counted.
  bool is_counted() const { return ignored != "Adjacent" && ignored != "Always"; }
};

/// A pose that a planner may begin with.
struct DefaultPose {
  Positions positions;
  std::string from;         ///< "zero", "given", "middle", "search", or the name of a state
  bool solids_free = true;  ///< no solids of two links overlap, other than Adjacent and Always
  /// Pairs whose solids overlap; or, if none do, pairs whose compared spheres do.
  std::vector<std::pair<std::string, std::string>> overlapping;
};

/// Compared spheres of two links that overlap in a position in which no solids do.
struct FalseMeeting {
  std::size_t a, b;    ///< of the links compared
  std::size_t sample;  ///< of the positions that decide
  Eigen::Isometry3d b_in_a;
};

struct SelfCollision {
  std::vector<LinkPair> pairs;
  std::vector<FalseMeeting> meetings;  ///< in the positions that decide, not in `samples`
  std::size_t free = 0;                ///< of the positions that decide: no solids overlap
  DefaultPose pose;
  std::map<std::size_t, double> locked;  ///< joints of grippers: open, in the pose and the samples
  /// Positions of all joints, drawn within their limits after all decisions; how many of them are
  /// truly colliding (of pairs that are not Adjacent, Always or Excluded), how many of these the
  /// spheres call free, and how many free ones they call colliding.
  std::size_t samples = 0, colliding = 0, missed = 0, falsely = 0;

  /// True if a compared pair's solids overlap in more than half of the samples.
  bool is_mostly_colliding(const LinkPair& pair) const {
    return pair.ignored.empty() && 2 * pair.colliding > samples;
  }

  double false_share() const {
    return samples == colliding
               ? 0
               : static_cast<double>(falsely) / static_cast<double>(samples - colliding);
  }
};

/// The requested default pose.
struct WantedPose {
  std::map<std::size_t, double> positions;                     ///< by joint; these are not searched
  std::vector<std::pair<std::string, Positions>> states = {};  ///< tried first, by name
};

/// Determines which links a planner must compare, by solids in sampled positions.
///
/// The default pose is the first of these in which neither solids nor spheres overlap: the given
/// states, joints at 0 (or the middle of limits that exclude it), the middle of all limits, poses
/// that differ from the first in few joints. Else it is the first in which no solids overlap; else
/// the first. Deterministic.
class SelfCollisionStudy {
 public:
  /// `names`: of the links to compare. `larger`: those whose overlaps are of more than the link.
  /// Keeps a reference to the robot.
  SelfCollisionStudy(const RobotModel& robot, std::vector<std::string> names, LinksOverlap overlap,
                     WantedPose wanted, std::set<std::size_t> larger = {});
  ~SelfCollisionStudy();

  /// `links`: spheres of each link, in order. `cover`: each set contains its link. Results about
  /// solids are kept from call to call.
  SelfCollision of(std::span<const LinkSpheres> links, bool cover);

 private:
  struct Pair;
  using Apart = std::function<bool(const Eigen::Isometry3d& b_in_a)>;

  void open_grippers(const std::vector<struct SphereBody>& bodies);
  void draw_samples(std::span<const LinkSpheres> links);
  void draw_free(const std::vector<struct SphereBody>& bodies,
                 const std::vector<std::uint8_t>& compared, std::size_t free);
  bool solids_overlap(Pair& pair, std::size_t sample, const Eigen::Isometry3d& b_in_a) const;
  bool holds(const Pair& pair, bool always, const Apart& apart, std::size_t& tried) const;
  void choose_pose(std::span<const struct SphereBody> bodies, bool cover, SelfCollision& out) const;

  const RobotModel& robot_;
  const std::vector<std::string> names_;
  const LinksOverlap overlap_;
  const WantedPose wanted_;
  const std::set<std::size_t> larger_;  ///< of names_
  std::vector<Pair> pairs_;
  std::map<std::size_t, double> locked_;                    ///< locked positions of gripper joints
  std::vector<std::pair<std::string, Positions>> notable_;  ///< poses to try first, in order
  std::size_t half_ = 0;                                    ///< of samples_: those that decide
  std::vector<Positions> samples_;
  std::vector<Positions> free_;  ///< additional positions without overlapping solids
};

}  // namespace ist
