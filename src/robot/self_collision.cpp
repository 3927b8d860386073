#include "robot/self_collision.h"

#include <algorithm>
#include <cstdint>
#include <random>

#include "robot/kinematics.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr double kAlways = 0.95;        ///< of the samples
constexpr std::size_t kSamples = 2000;  ///< at most
constexpr double kTests = 1e9;          ///< of spheres, about, at most
constexpr double kRounding = 1e-6;      ///< of the depth; planners work in float

/// A link's spheres, and a ball around them.
struct Body {
  std::size_t link = 0;
  const LinkSpheres* spheres = nullptr;
  CoverSphere around;
};

/// How deep the spheres of two links overlap; 0 or less: not. `enough`: a depth that ends it.
double depth_of(const Body& a, const Body& b, const Eigen::Isometry3d& b_in_a, double enough) {
  const auto depth = [](const CoverSphere& p, const CoverSphere& q, const Vector3d& q_centre) {
    return p.radius + q.radius - (p.centre - q_centre).norm();
  };
  double deepest = depth(a.around, b.around, b_in_a * b.around.centre);
  if (deepest <= 0) return deepest;
  deepest = -1;
  for (const CoverSphere& q : b.spheres->spheres) {
    const Vector3d centre = b_in_a * q.centre;
    if (depth(a.around, q, centre) <= deepest) continue;
    for (const CoverSphere& p : a.spheres->spheres) {
      deepest = std::max(deepest, depth(p, q, centre));
      if (deepest > enough) return deepest;
    }
  }
  return deepest;
}

std::vector<Body> bodies_of(const RobotModel& robot, std::span<const LinkSpheres> links) {
  std::vector<Body> bodies;
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const auto found = std::find_if(links.begin(), links.end(), [&](const LinkSpheres& one) {
      return one.link == robot.links[i].name && !one.spheres.empty();
    });
    if (found == links.end()) continue;
    Body& body = bodies.emplace_back(Body{i, &*found, {}});
    for (const CoverSphere& s : found->spheres) body.around.centre += s.centre;
    body.around.centre /= static_cast<double>(found->spheres.size());
    for (const CoverSphere& s : found->spheres)
      body.around.radius =
          std::max(body.around.radius, (s.centre - body.around.centre).norm() + s.radius);
  }
  return bodies;
}

/// Of each link, the body that it moves with or hangs from: its own, or the nearest above it.
std::vector<std::size_t> holders(const RobotModel& robot, const std::vector<Body>& bodies) {
  std::vector<std::size_t> body_of(robot.links.size(), kNone);
  for (std::size_t k = 0; k < bodies.size(); ++k) body_of[bodies[k].link] = k;
  for (const std::size_t link : robot.order)
    if (body_of[link] == kNone && robot.joint_of[link] != kNone)
      body_of[link] = body_of[robot.joints[robot.joint_of[link]].parent];
  return body_of;
}

struct Pair {
  std::size_t a, b;          ///< bodies
  std::size_t overlaps = 0;  ///< samples in which they do
};

Positions drawn(const RobotModel& robot, std::mt19937_64& random) {
  Positions positions;
  for (const RobotJoint& joint : robot.joints)
    positions.push_back(joint.lower + (joint.upper - joint.lower) * 0x1p-53 *
                                          static_cast<double>(random() >> 11));
  return positions;
}

}  // namespace

SelfCollision self_collision(const RobotModel& robot, std::span<const LinkSpheres> links) {
  const std::vector<Body> bodies = bodies_of(robot, links);
  const std::vector<std::size_t> holder = holders(robot, bodies);
  SelfCollision out;
  const auto ignore = [&](const Pair& pair, const char* reason) {
    out.ignored.push_back({bodies[pair.a].spheres->link, bodies[pair.b].spheres->link, reason});
  };
  const auto hangs_from = [&](std::size_t b, std::size_t a) {
    const std::size_t joint = robot.joint_of[bodies[b].link];
    return joint != kNone && holder[robot.joints[joint].parent] == a;
  };
  std::vector<Pair> pairs;
  double tests = 1;
  for (std::size_t b = 0; b < bodies.size(); ++b)
    for (std::size_t a = 0; a < b; ++a) {
      ++out.pairs;
      if (hangs_from(a, b) || hangs_from(b, a)) {
        ignore({a, b}, "Adjacent");
        continue;
      }
      pairs.push_back({a, b});
      tests += static_cast<double>(bodies[a].spheres->spheres.size() *
                                   bodies[b].spheres->spheres.size());
    }
  std::mt19937_64 random(1);
  out.samples = std::clamp<std::size_t>(static_cast<std::size_t>(kTests / tests), 50, kSamples);
  for (std::size_t k = 0; k < out.samples; ++k) {
    const std::vector<Eigen::Isometry3d> frames = link_frames(robot, drawn(robot, random));
    for (Pair& pair : pairs) {
      const Body &a = bodies[pair.a], &b = bodies[pair.b];
      if (depth_of(a, b, frames[a.link].inverse() * frames[b.link], 0) > 0) ++pair.overlaps;
    }
  }
  const std::vector<Eigen::Isometry3d> frames = link_frames(robot, default_positions(robot));
  for (const Pair& pair : pairs) {
    if (static_cast<double>(pair.overlaps) >= kAlways * static_cast<double>(out.samples)) {
      ignore(pair, "Always");
      continue;
    }
    const Body &a = bodies[pair.a], &b = bodies[pair.b];
    const double depth =
        depth_of(a, b, frames[a.link].inverse() * frames[b.link], HUGE_VAL) * (1 + kRounding);
    const double both = a.spheres->protrusion + b.spheres->protrusion;
    if (depth <= 0) continue;
    if (depth > both) {
      ignore(pair, "Default");
      continue;
    }
    for (const LinkSpheres* one : {a.spheres, b.spheres}) {
      double& buffer = out.buffers[one->link];
      buffer = std::min(buffer, -depth * one->protrusion / both);
    }
  }
  return out;
}

}  // namespace ist
