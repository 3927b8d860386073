#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "mesh/import/source_file.h"

// Robots described by URDF files: links, and their shapes.

namespace ist {

struct LinkMesh {
  std::string file;  ///< as the URDF names it: a path, file://… or package://…
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();  ///< not 0; negative values mirror
  /// Bytes of the URDF: the name, first and past the last.
  std::size_t name_begin = 0, name_end = 0;
};
struct LinkBox {
  Eigen::Vector3d half_extents = Eigen::Vector3d::Ones();  ///< [u] > 0
};
struct LinkCylinder {
  double radius = 1, half_height = 1;  ///< [u] > 0, along z
};
struct LinkBall {
  double radius = 1;  ///< [u] > 0
};
struct LinkCapsule {
  double radius = 1, half_height = 1;  ///< [u] > 0, of the segment along z
};
struct LinkEllipsoid {
  Eigen::Vector3d radii = Eigen::Vector3d::Ones();  ///< [u] > 0
};
/// An invalid visual shape: an error if it is used.
struct LinkFault {
  std::string what;  ///< with file and line
};
using LinkShape =
    std::variant<LinkMesh, LinkBox, LinkCylinder, LinkBall, LinkCapsule, LinkEllipsoid, LinkFault>;

/// A shape of a link: x_link = rotation · x + translation.
struct PlacedLinkShape {
  LinkShape shape;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  ///< [u]
  std::size_t line = 0;                                   ///< of the file; 0: of an included one
};

/// One of a link's two sets of shapes.
enum class LinkShapes { collision, visual };

struct RobotLink {
  std::string name;
  std::vector<PlacedLinkShape> collision, visual;
  /// Bytes of the file: the link's element, and each <collision> in it, first and past the last.
  std::size_t begin = 0, end = 0;
  std::vector<std::pair<std::size_t, std::size_t>> collision_bytes;

  const std::vector<PlacedLinkShape>& shapes(LinkShapes which) const {
    return which == LinkShapes::collision ? collision : visual;
  }
};

inline constexpr std::size_t kNone = SIZE_MAX;  ///< no link or joint

/// The joint of a link and its parent. Joints of several axes and slides without limits are taken
/// as fixed.
struct RobotJoint {
  enum class Motion { fixed, turning, sliding };
  std::string name;
  std::size_t parent = 0, child = 0;                         ///< links
  Eigen::Isometry3d origin = Eigen::Isometry3d::Identity();  ///< of the child, at position 0
  Motion motion = Motion::fixed;
  bool taken_as_fixed = false;                      ///< although it moves in the file
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< of length 1, in the child's frame
  double lower = 0, upper = 0;                      ///< [rad] or [u]
  /// The joint that moves this one, whose position is multiplier · (its position) + offset; or
  /// kNone.
  std::size_t mimics = kNone;
  double multiplier = 1, offset = 0;

  /// True if a planner sets its position.
  bool is_free() const { return motion != Motion::fixed && mimics == kNone; }
};

/// Links and joints in the order of the file; its bytes are kept.
struct RobotModel {
  SourceFile file;
  bool is_urdf = true;  ///< else an MJCF or SDF
  std::string name;
  std::vector<RobotLink> links;
  std::vector<RobotJoint> joints;
  std::vector<std::size_t>
      joint_of;                    ///< of each link, the joint it is the child of; kNone: the root
  std::vector<std::size_t> order;  ///< links, parents before children
  std::vector<std::pair<std::size_t, std::size_t>> excluded;  ///< links that the file ignores
  std::vector<std::string> endless;  ///< planes, height fields and flexes, which no link has
};

/// The index of the link or joint of that name; the number of items if there is none.
template <class Item>
std::size_t index_named(const std::vector<Item>& items, std::string_view name) {
  const auto is_it = [&](const Item& one) { return one.name == name; };
  return static_cast<std::size_t>(std::find_if(items.begin(), items.end(), is_it) - items.begin());
}

/// Reads a URDF, or an MJCF or SDF like read_mjcf() and read_sdf(). Strict if a mistake would move
/// or lose a shape: numbers must be finite, lengths positive, and joints must form one tree of the
/// links. A faulty visual shape becomes a LinkFault. Other elements are ignored. Document types,
/// and with them entities, are refused. Throws Error (file, line, fault, advice).
RobotModel read_robot(const std::string& path);

/// The same for a file in memory.
RobotModel read_robot(SourceFile file);

/// The shortest rotation of the z axis onto a direction, which is not 0. Eigen's FromTwoVectors
/// uses a decomposition for opposite directions, which takes seconds to compile.
inline Eigen::Quaterniond turn_from_z(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d to = direction.normalized();
  if (to.z() < -1 + 1e-12) return {0, 1, 0, 0};
  const double s = std::sqrt(2 * (1 + to.z()));
  return {s / 2, -to.y() / s, to.x() / s, 0};
}

/// Reads the one model of an SDF: links, joints with limits and mimicry, and shapes of meshes,
/// boxes, cylinders, spheres and capsules.
///
/// A joint whose frame is not its child's gets a link without shapes there, JOINT_frame. A joint to
/// the world makes a link `world`. Balls, screws and joints of two axes are taken as fixed; planes
/// and height maps are passed over, and other shapes become a LinkFault. Nested and included
/// models, and poses relative to frames other than links, are errors. Throws Error.
RobotModel read_sdf(SourceFile file);

/// Reads a robot of MuJoCo (MJCF): bodies, joints, geoms of primitives and meshes, defaults,
/// includes, excluded pairs, and joint equalities of first order, which become mimicry.
///
/// The world is the first link. A body with several joints gets a link without shapes for each but
/// the last. Free joints and slides without a range are taken as fixed, balls as three hinges.
/// Geoms that collide with nothing (contype and conaffinity 0) are visual; planes, height fields
/// and flexes are passed over. Meshes are taken as they are, where MuJoCo collides their convex
/// hull. Geoms of other kinds become a LinkFault. Throws Error.
RobotModel read_mjcf(SourceFile file);

}  // namespace ist
