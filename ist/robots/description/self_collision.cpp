#include "robots/description/self_collision.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <random>

namespace ist {

/// A link's spheres, and a ball around them.
struct SphereBody {
  std::span<const CoverSphere> spheres;
  CoverSphere around;
};

namespace {

using Eigen::Vector3d;
using Body = SphereBody;

constexpr std::size_t kSamples = 2000;   ///< of all joints, at most; the same number again measures
constexpr std::size_t kMoreSamples = 5;  ///< multiple, for the joints between two links
constexpr double kTests = 1e9;           ///< of spheres, approximate maximum
constexpr double kLimitShare = 0.1;      ///< share of the drawn positions that are a limit
constexpr double kWorthIgnoring = 0.01;  ///< share of positions in which spheres overlap
constexpr std::size_t kFree = 200;       ///< positions without a collision that decide
constexpr std::size_t kDraws = 100'000;  ///< for them, at most
constexpr int kPosesACount = 40;         ///< searched for each number of moved joints

bool overlap(const Body& a, const Body& b, const Eigen::Isometry3d& b_in_a) {
  const auto meet = [](const CoverSphere& p, const CoverSphere& q, const Vector3d& q_centre) {
    const double reach = p.radius + q.radius;
    return (p.centre - q_centre).squaredNorm() < reach * reach;
  };
  if (!meet(a.around, b.around, b_in_a * b.around.centre)) return false;
  for (const CoverSphere& q : b.spheres) {
    const Vector3d centre = b_in_a * q.centre;
    if (!meet(a.around, q, centre)) continue;
    for (const CoverSphere& p : a.spheres)
      if (meet(p, q, centre)) return true;
  }
  return false;
}

std::vector<Body> bodies_of(std::span<const LinkSpheres> links) {
  std::vector<Body> bodies;
  for (const LinkSpheres& link : links) {
    Body& body = bodies.emplace_back(Body{link.spheres, {}});
    for (const CoverSphere& s : link.spheres) body.around.centre += s.centre;
    body.around.centre /= static_cast<double>(link.spheres.size());
    for (const CoverSphere& s : link.spheres)
      body.around.radius =
          std::max(body.around.radius, (s.centre - body.around.centre).norm() + s.radius);
  }
  return bodies;
}

double share(std::mt19937_64& random) { return 0x1p-53 * static_cast<double>(random() >> 11); }

double drawn(const RobotJoint& joint, std::mt19937_64& random) {
  return joint.lower + (joint.upper - joint.lower) * share(random);
}

Positions drawn(const RobotModel& robot, std::mt19937_64& random) {
  Positions positions;
  for (const RobotJoint& joint : robot.joints) positions.push_back(drawn(joint, random));
  return positions;
}

}  // namespace

/// Data for sampling a pair of links.
struct SelfCollisionStudy::Pair {
  enum class Truth : std::uint8_t { unknown, apart, overlapping };

  std::size_t a, b;                     ///< of the links compared
  const char* given = nullptr;          ///< reason to ignore it whatever the solids do
  std::vector<std::size_t> to_a, to_b;  ///< joints from where their paths diverge
  std::vector<std::size_t> free = {};   ///< joints that move one relative to the other
  std::vector<Truth> truth = {};        ///< by sample

  Eigen::Isometry3d b_in_a(const RobotModel& robot, const Positions& positions) const {
    Eigen::Isometry3d a_frame = Eigen::Isometry3d::Identity(), b_frame = a_frame;
    for (const std::size_t j : to_a) a_frame = a_frame * joint_frame(robot, j, positions);
    for (const std::size_t j : to_b) b_frame = b_frame * joint_frame(robot, j, positions);
    return a_frame.inverse() * b_frame;
  }
};

SelfCollisionStudy::~SelfCollisionStudy() = default;

SelfCollisionStudy::SelfCollisionStudy(const RobotModel& robot, std::vector<std::string> names,
                                       LinksOverlap overlap, WantedPose wanted,
                                       std::set<std::size_t> larger)
    : robot_(robot),
      names_(std::move(names)),
      overlap_(std::move(overlap)),
      wanted_(std::move(wanted)),
      larger_(std::move(larger)) {
  std::vector<std::size_t> links, compared(robot.links.size(), kNone);
  for (const std::string& name : names_) {
    links.push_back(index_named(robot.links, name));
    compared[links.back()] = links.size() - 1;
  }
  // For each link, the compared link that it moves with or hangs from: itself, or the nearest one
  // above.
  std::vector<std::size_t> holder = compared;
  for (const std::size_t link : robot.order)
    if (holder[link] == kNone && robot.joint_of[link] != kNone)
      holder[link] = holder[robot.joints[robot.joint_of[link]].parent];
  const auto hangs_from = [&](std::size_t b, std::size_t a) {
    const std::size_t joint = robot.joint_of[links[b]];
    return joint != kNone && holder[robot.joints[joint].parent] == a;
  };
  for (std::size_t b = 0; b < links.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      const auto excluded = [&](std::size_t p, std::size_t q) {
        return std::count(robot.excluded.begin(), robot.excluded.end(), std::pair(p, q)) != 0;
      };
      Pair& pair = pairs_.emplace_back(
          Pair{a, b, nullptr, path_to(robot, links[a]), path_to(robot, links[b])});
      if (hangs_from(a, b) || hangs_from(b, a))
        pair.given = "Adjacent";
      else if (excluded(links[a], links[b]) || excluded(links[b], links[a]))
        pair.given = "Excluded";
      std::size_t common = 0;
      while (common < std::min(pair.to_a.size(), pair.to_b.size()) &&
             pair.to_a[common] == pair.to_b[common])
        ++common;
      for (auto* path : {&pair.to_a, &pair.to_b}) {
        path->erase(path->begin(), path->begin() + static_cast<std::ptrdiff_t>(common));
        for (const std::size_t j : *path)
          if (robot.joints[j].motion != RobotJoint::Motion::fixed)
            pair.free.push_back(robot.joints[j].is_free() ? j : robot.joints[j].mimics);
      }
      std::sort(pair.free.begin(), pair.free.end());
      pair.free.erase(std::unique(pair.free.begin(), pair.free.end()), pair.free.end());
    }
}

/// Draws the positions that decide, the notable poses first, then as many that measure.
void SelfCollisionStudy::draw_samples(std::span<const LinkSpheres> links) {
  open_grippers(bodies_of(links));
  double tests = 1;
  for (const Pair& pair : pairs_)
    if (pair.given == nullptr)
      tests += static_cast<double>(links[pair.a].spheres.size() * links[pair.b].spheres.size());
  half_ = std::clamp<std::size_t>(static_cast<std::size_t>(kTests / tests), 50, kSamples);
  const auto with_wanted = [&](Positions positions) {
    for (const auto& [joint, value] : locked_) positions[joint] = value;
    for (const auto& [joint, value] : wanted_.positions) positions[joint] = value;
    return positions;
  };
  for (const auto& [name, positions] : wanted_.states)
    notable_.emplace_back(name, with_wanted(positions));
  notable_.emplace_back(wanted_.positions.empty() ? "zero" : "given",
                        with_wanted(default_positions(robot_)));
  notable_.emplace_back("middle", with_wanted(middle_positions(robot_)));
  for (const auto& [name, positions] : notable_) samples_.push_back(positions);
  half_ = std::max(half_, samples_.size());
  std::mt19937_64 random(1);
  while (samples_.size() < 2 * half_) {
    samples_.push_back(drawn(robot_, random));
    if (samples_.size() <= half_) continue;
    for (const auto& [joint, position] : locked_) samples_.back()[joint] = position;
  }
  for (Pair& pair : pairs_) pair.truth.resize(samples_.size());
}

/// Locks each gripper where its fingers are farthest apart, or as requested.
void SelfCollisionStudy::open_grippers(const std::vector<SphereBody>& bodies) {
  Positions positions = default_positions(robot_);
  for (const std::size_t joint : gripper_joints(robot_)) {
    const auto apart = [&](double position) {
      positions[joint] = position;
      double sum = 0;
      for (const Pair& pair : pairs_)
        if (pair.free == std::vector<std::size_t>{joint})
          sum += (pair.b_in_a(robot_, positions) * bodies[pair.b].around.centre -
                  bodies[pair.a].around.centre)
                     .norm();
      return sum;
    };
    const RobotJoint& one = robot_.joints[joint];
    double best = positions[joint], most = apart(best) * (1 + 1e-9);
    for (const double limit : {one.lower, one.upper})
      if (const double now = apart(limit); now > most) {
        best = limit;
        most = now;
      }
    if (const auto given = wanted_.positions.find(joint); given != wanted_.positions.end())
      best = given->second;
    positions[joint] = locked_[joint] = best;
  }
}

/// Draws positions in which no solids overlap until there are kFree, including `free`. `compared`:
/// by pair.
void SelfCollisionStudy::draw_free(const std::vector<SphereBody>& bodies,
                                   const std::vector<std::uint8_t>& compared, std::size_t free) {
  std::vector<std::pair<std::size_t, const Pair*>> order;  // those that overlap most often first
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    if (compared[i] != 0)
      order.emplace_back(
          std::count(pairs_[i].truth.begin(), pairs_[i].truth.end(), Pair::Truth::apart),
          &pairs_[i]);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& x, const auto& y) { return x.first < y.first; });
  constexpr std::size_t kBlock = 500;
  std::mt19937_64 random(2);
  for (std::size_t draws = 0; draws < kDraws && free + free_.size() < kFree; draws += kBlock) {
    std::vector<Positions> block;
    std::vector<std::uint8_t> is_free(kBlock);
    for (std::size_t k = 0; k < kBlock; ++k) {
      block.push_back(drawn(robot_, random));
      for (const auto& [joint, position] : locked_) block.back()[joint] = position;
    }
    tbb::parallel_for(std::size_t{0}, kBlock, [&](std::size_t k) {
      is_free[k] = std::none_of(order.begin(), order.end(), [&](const auto& one) {
        const Pair& pair = *one.second;
        const Eigen::Isometry3d b_in_a = pair.b_in_a(robot_, block[k]);
        return overlap(bodies[pair.a], bodies[pair.b], b_in_a) && overlap_(pair.a, pair.b, b_in_a);
      });
    });
    for (std::size_t k = 0; k < kBlock && free + free_.size() < kFree; ++k)
      if (is_free[k] != 0) free_.push_back(std::move(block[k]));
  }
}

bool SelfCollisionStudy::solids_overlap(Pair& pair, std::size_t sample,
                                        const Eigen::Isometry3d& b_in_a) const {
  Pair::Truth& truth = pair.truth[sample];
  if (truth == Pair::Truth::unknown)
    truth = overlap_(pair.a, pair.b, b_in_a) ? Pair::Truth::overlapping : Pair::Truth::apart;
  return truth == Pair::Truth::overlapping;
}

/// Tests whether all (`always`) or none of the sampled positions of the joints between two links
/// let their solids overlap, including positions at limits. Adds to `tried`.
bool SelfCollisionStudy::holds(const Pair& pair, bool always, const Apart& apart,
                               std::size_t& tried) const {
  const std::size_t count = kMoreSamples * half_;
  Positions positions = notable_.front().second;
  std::mt19937_64 random(pair.a * names_.size() + pair.b + 2);
  std::vector<Positions> tries;
  for (std::size_t k = 0; k < count; ++k) {
    for (const std::size_t j : pair.free) {
      const RobotJoint& joint = robot_.joints[j];
      const double limit = share(random), position = drawn(joint, random);
      positions[j] = limit < kLimitShare / 2 ? joint.lower
                     : limit < kLimitShare   ? joint.upper
                                             : position;
    }
    tries.push_back(positions);
  }
  std::atomic<bool> so = true;
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t k) {
    if (!so.load(std::memory_order_relaxed)) return;
    const Eigen::Isometry3d b_in_a = pair.b_in_a(robot_, tries[k]);
    if ((!apart(b_in_a) && overlap_(pair.a, pair.b, b_in_a)) != always) so = false;
  });
  if (so) tried += count;
  return so;
}

SelfCollision SelfCollisionStudy::of(std::span<const LinkSpheres> links, bool cover) {
  if (samples_.empty()) draw_samples(links);
  const std::vector<Body> bodies = bodies_of(links);
  const auto look = [&](Pair& pair, std::size_t sample, bool& spheres, bool& solids) {
    const Eigen::Isometry3d b_in_a = pair.b_in_a(robot_, samples_[sample]);
    spheres = overlap(bodies[pair.a], bodies[pair.b], b_in_a);
    solids = (spheres || !cover) && solids_overlap(pair, sample, b_in_a);
  };
  SelfCollision out;
  out.samples = half_;
  out.locked = locked_;
  out.pairs.resize(pairs_.size());
  std::vector<std::vector<FalseMeeting>> meetings(pairs_.size());
  const auto opens = [&](const Pair& pair) {  // opens or closes: irrelevant for a planner
    return std::all_of(pair.free.begin(), pair.free.end(),
                       [&](std::size_t j) { return locked_.contains(j); });
  };
  std::vector<std::uint8_t> deciding(half_);
  tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t i) {
    Pair& pair = pairs_[i];
    LinkPair& told = out.pairs[i];
    told.a = names_[pair.a];
    told.b = names_[pair.b];
    if (pair.given != nullptr) {
      told.ignored = pair.given;
      return;
    }
    std::size_t solids = 0, spheres = 0;
    told.tried = pair.free.empty() ? 1 : half_;  // without free joints one position decides
    for (std::size_t k = 0; k < told.tried; ++k) {
      bool by_spheres = false, by_solids = false;
      look(pair, k, by_spheres, by_solids);
      solids += by_solids ? 1 : 0;
      spheres += by_spheres ? 1 : 0;
      if (by_spheres && !by_solids && !opens(pair))
        meetings[i].push_back({pair.a, pair.b, k, pair.b_in_a(robot_, samples_[k])});
    }
    const bool always =
        solids == told.tried &&
        (pair.free.empty() || (!larger_.contains(pair.a) && !larger_.contains(pair.b)));
    // A pair whose spheres rarely overlap costs little: it is compared rather than trusted.
    const bool never = solids == 0 && static_cast<double>(spheres) >=
                                          kWorthIgnoring * static_cast<double>(told.tried);
    const auto apart = [&](const Eigen::Isometry3d& b_in_a) {
      return cover && !overlap(bodies[pair.a], bodies[pair.b], b_in_a);
    };
    if ((never || always) && (pair.free.empty() || holds(pair, always, apart, told.tried)))
      told.ignored = always ? "Always" : "Never";
    if (!told.ignored.empty()) meetings[i].clear();
    if (told.ignored == "Always" || pair.free.empty()) return;
    for (std::size_t k = 0; k < half_; ++k)
      if (pair.truth[k] == Pair::Truth::overlapping)
        std::atomic_ref(deciding[k]).store(1, std::memory_order_relaxed);
  });
  out.free = static_cast<std::size_t>(std::count(deciding.begin(), deciding.end(), 0));
  std::vector<std::uint8_t> compared;
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    compared.push_back(pairs_[i].given == nullptr && !pairs_[i].free.empty() &&
                       out.pairs[i].ignored != "Always");
  if (cover && free_.empty()) draw_free(bodies, compared, out.free);
  out.free += free_.size();
  tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t i) {
    const Pair& pair = pairs_[i];
    if (compared[i] == 0 || !out.pairs[i].ignored.empty() || opens(pair)) return;
    for (std::size_t k = 0; k < free_.size(); ++k)
      if (const Eigen::Isometry3d b_in_a = pair.b_in_a(robot_, free_[k]);
          overlap(bodies[pair.a], bodies[pair.b], b_in_a))
        meetings[i].push_back({pair.a, pair.b, samples_.size() + k, b_in_a});
  });
  for (const auto& some : meetings)
    for (const FalseMeeting& one : some)
      if (one.sample >= half_ || deciding[one.sample] == 0) out.meetings.push_back(one);
  choose_pose(bodies, cover, out);
  std::vector<std::uint8_t> calls(half_), truths(half_);
  tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t i) {
    LinkPair& told = out.pairs[i];
    if (!told.is_counted() || pairs_[i].free.empty()) return;
    for (std::size_t k = 0; k < half_; ++k) {
      bool by_spheres = false, by_solids = false;
      look(pairs_[i], half_ + k, by_spheres, by_solids);
      by_spheres = by_spheres && told.ignored.empty();
      told.colliding += by_solids ? 1 : 0;
      if (pairs_[i].given != nullptr) continue;  // Excluded: not counted as a collision
      told.missed += by_solids && !by_spheres ? 1 : 0;
      told.falsely += by_spheres && !by_solids ? 1 : 0;
      if (by_spheres) std::atomic_ref(calls[k]).store(1, std::memory_order_relaxed);
      if (by_solids) std::atomic_ref(truths[k]).store(1, std::memory_order_relaxed);
    }
  });
  for (std::size_t k = 0; k < half_; ++k) {
    out.colliding += truths[k];
    out.missed += truths[k] > calls[k] ? 1 : 0;
    out.falsely += calls[k] > truths[k] ? 1 : 0;
  }
  return out;
}

void SelfCollisionStudy::choose_pose(std::span<const SphereBody> bodies, bool cover,
                                     SelfCollision& out) const {
  /// Finds the pairs that overlap in a pose.
  const auto look = [&](const Positions& positions, DefaultPose& pose) {
    pose.positions = positions;
    pose.solids_free = true;
    pose.overlapping.clear();
    std::vector<std::uint8_t> found(pairs_.size());  // 1: spheres, 2: solids
    tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t i) {
      const std::string& ignored = out.pairs[i].ignored;
      if (pairs_[i].given != nullptr || ignored == "Always" || pairs_[i].free.empty()) return;
      const Pair& pair = pairs_[i];
      const Eigen::Isometry3d b_in_a = pair.b_in_a(robot_, positions);
      const bool spheres = overlap(bodies[pair.a], bodies[pair.b], b_in_a);
      if ((spheres || !cover) && overlap_(pair.a, pair.b, b_in_a))
        found[i] = 2;
      else if (spheres && ignored.empty())
        found[i] = 1;
    });
    const std::uint8_t most = found.empty() ? 0 : *std::max_element(found.begin(), found.end());
    pose.solids_free = most < 2;
    for (std::size_t i = 0; i < found.size() && most > 0; ++i)
      if (found[i] == most) pose.overlapping.emplace_back(out.pairs[i].a, out.pairs[i].b);
    return most == 0;
  };
  DefaultPose best;  // the first whose solids are free, else the first
  const auto take = [&](const std::string& from, const Positions& positions) {
    DefaultPose pose;
    pose.from = from;
    const bool free = look(positions, pose);
    if (free || best.from.empty() || (pose.solids_free && !best.solids_free))
      best = std::move(pose);
    return free;
  };
  out.pose = [&] {
    for (const auto& [name, positions] : notable_)
      if (take(name, positions)) return best;
    std::vector<std::size_t> joints;
    for (std::size_t j = 0; j < robot_.joints.size(); ++j)
      if (robot_.joints[j].is_free() && !wanted_.positions.contains(j) && !locked_.contains(j))
        joints.push_back(j);
    std::mt19937_64 random(1);
    for (std::size_t moved = 1; moved <= joints.size(); ++moved)
      for (int k = 0; k < kPosesACount; ++k) {
        Positions positions = notable_.front().second;
        for (std::size_t i = 0; i < moved; ++i) {
          std::swap(joints[i], joints[i + random() % (joints.size() - i)]);
          positions[joints[i]] = drawn(robot_.joints[joints[i]], random);
        }
        if (take("search", positions)) return best;
      }
    return best;
  }();
}

}  // namespace ist
