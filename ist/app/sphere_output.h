#pragma once

#include <ist/cover_spheres.h>
#include <algorithm>

#include "library/link_solids.h"
#include "robots/description/self_collision.h"

namespace ist::app {

/// A link, or the whole of a mesh, and its spheres.
struct SphereLink {
  std::string name;
  std::vector<CoverSphere> given;  ///< spheres of the description itself
  bool has_mesh = false;
  double slack = 0;               ///< [u] by which the mesh may be wider than the shapes
  TriangleMesh read = {};         ///< as read, if it was not closed; the cover contains it too
  MeshReport closing = {};        ///< how it was closed, if it was open
  bool bounding_capsule = false;  ///< the capsule replaces a mesh that could not be closed
  SphereCover cover;
  std::vector<CoverCapsule> capsules = {};  ///< if any, `cover` has spheres that contain them
  SphereCoverProof proof;
};

/// Two links whose solids come so close that separating them takes many spheres.
struct ClosePair {
  std::string a, b;
  double gap;           ///< [u] in which both protrude, if a tenth of the free poses is given up
  std::size_t spheres;  ///< approximate number of both together
};

struct SphereRobot {
  std::string name, input, output;  ///< of the robot or the mesh; paths
  std::vector<SphereLink> links;    ///< those with shapes
  std::vector<ClosedMesh> meshes;   ///< of the links that have one, in their order
  RobotModel robot;                 ///< of a mesh: one link; its file is empty
  SelfCollision self;
  std::vector<ClosePair> too_close;         ///< if too many free poses are called colliding
  std::vector<std::string> left_out;        ///< links with visual shapes alone
  std::vector<std::string> taken_as_fixed;  ///< joints that move in the file

  bool has_capsules() const {
    return std::any_of(links.begin(), links.end(),
                       [](const auto& link) { return !link.capsules.empty(); });
  }
  bool is_robot() const { return !robot.file.bytes.empty(); }
  std::vector<LinkSpheres> spheres() const;  ///< as in files
  std::vector<LinkSpheres> covers() const;   ///< the same, with spheres that contain capsules
};

/// The file's text, by its ending. Throws Error.
using SphereWriter = std::string (*)(const SphereRobot&);
SphereWriter sphere_writer(const std::string& output);

std::string spheres_table(const SphereRobot& robot, const std::string& output, double seconds);
std::string spheres_report_json(const SphereRobot& robot, const std::string& output,
                                double seconds);

/// Adds to a link's cover the spheres of its description and, for a repaired link, spheres that
/// contain the mesh as it was read (`read`).
void complete_cover(SphereLink& link, bool read);

/// Covers links again whose spheres overlap others' although the solids do not, with as many
/// spheres as needed to protrude only into the gaps between the solids. The tightest gaps are given
/// up until 60 spheres a link on average are enough. Nothing changes if at most a tenth of the free
/// poses are called colliding, or if that would not improve.
///
/// `robot.self` belongs to its covers, and stays consistent. `fixed`: counts of links by name,
/// which are kept. `is_open`: whether counts may change; if not, only the obstacles are reported.
void refine_covers(SphereRobot& robot, SelfCollisionStudy& study, const LinkSolids& solids,
                   const SphereCoverSettings& cover,
                   const std::map<std::string, std::size_t>& fixed, bool is_open,
                   const ProgressCallback& progress);

}  // namespace ist::app
