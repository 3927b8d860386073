#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

#include "query/asset/sphere_tree.h"
#include "query/base/relative_pose.h"

namespace ist {

/// Up to sixteen triangles, prepared for balls. Positions are in the surface's frame; (x, y) are
/// coordinates in a triangle's plane from its first corner, with its first edge along x.
struct alignas(64) SurfacePatch {
  double corner[3][3][kWidth];                  ///< [corner][axis]
  double u[3][kWidth], v[3][kWidth];            ///< unit axes of x and y
  double n[3][kWidth];                          ///< unit normal, outward
  double edge_x[3][kWidth], edge_y[3][kWidth];  ///< unit directions of the edges
  double length[3][kWidth];                     ///< of the edges
  /// Extent: x from left to right, y from 0 to top. Negative for degenerate triangles.
  double left[kWidth], right[kWidth], top[kWidth];
};

/// Corners of sixteen triangles, counter-clockwise from outside; three equal ones for no triangle.
struct alignas(64) TriangleCorners {
  double x[3][kWidth], y[3][kWidth], z[3][kWidth];
};

void make_patch(const TriangleCorners& corners, SurfacePatch& patch) noexcept;

/// A bit for each triangle that comes near a ball: all that reach it, and perhaps others.
std::uint32_t triangles_near(const SurfacePatch& patch, const double (&centre)[3],
                             double radius) noexcept;

/// Sixteen balls relative to an origin near them all. A radius of 0 stands for no ball.
struct alignas(64) ProbeBalls {
  double x[kWidth], y[kWidth], z[kWidth], r[kWidth];
  double origin[3];  ///< in the surface's frame
  double reach = 0;  ///< all of them lie within this of the origin

  Eigen::Vector3d centre(std::size_t i) const noexcept {
    return {origin[0] + x[i], origin[1] + y[i], origin[2] + z[i]};
  }
};

/// The mapped balls of a block, relative to its node's centre. Unused lanes get a radius of 0.
void place_probes(const SphereTree& probes, int level, std::uint32_t block, const Similarity& map,
                  ProbeBalls& balls) noexcept;

}  // namespace ist
