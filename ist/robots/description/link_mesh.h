#pragma once

#include <span>
#include <string>
#include <vector>

#include <ist/cover_spheres.h>
#include <ist/mesh.h>

#include "robots/description/package_paths.h"
#include "robots/description/robot_model.h"

namespace ist {

/// The mesh of a shape in its link's frame; mirrored meshes are flipped, so that they keep their
/// outside. A box is exact. A cylinder, capsule or ellipsoid is a polyhedron that contains it, and
/// is at most `slack` [u] wider. `file`: for messages. Throws Error naming the URDF's line.
struct ShapeMesh {
  TriangleMesh mesh;
  double slack = 0;
};
ShapeMesh mesh_of(const PlacedLinkShape& shape, const PackagePaths& paths, const std::string& file);

/// A polyhedron around a capsule, or a sphere whose axis is a point, at most 0.5 % wider.
ShapeMesh capsule_mesh(const CoverCapsule& capsule);

/// Adds the vertices and triangles of another mesh.
void append_mesh(TriangleMesh& mesh, const TriangleMesh& more);

/// Shapes of a link as one mesh; spheres stay spheres.
struct LinkGeometry {
  TriangleMesh mesh;                 ///< empty if the link has only spheres
  std::vector<CoverSphere> spheres;  ///< [u], link frame
  double slack = 0;                  ///< [u] bound on the excess of the mesh over the shapes
};
LinkGeometry geometry_of(std::span<const PlacedLinkShape> shapes, const PackagePaths& paths,
                         const std::string& file);

}  // namespace ist
