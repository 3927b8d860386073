#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <variant>

#include <ist/types.h>

// Solids that need no asset: half-spaces, primitives, terrains, distance grids and functions. They
// are plain views: nothing is copied or
// allocated, and memory they point to must outlive them. Distances are negative inside the solid
// and positive outside, as those of Solid. Lengths are [u] in the shape's own frame.

namespace IST_API ist {

/// The solid normal · x ≤ offset. Exact.
struct HalfSpaceShape {
  /// Outward; its length (1e-150 to 1e150) divides the offset too.
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;  ///< [u] for a unit normal
};

/// A box around the origin. Exact, also at edges and corners, and for balls thicker than the box.
struct BoxShape {
  Eigen::Vector3d half_extents = Eigen::Vector3d::Ones();  ///< [u] > 0
};

/// A ball around the origin. Exact.
struct BallShape {
  double radius = 1;  ///< [u] > 0
};

/// All points within `radius` of the segment from −half_height to +half_height on the z axis.
///
/// Approximate: a ball is intersected with the tangent plane at the closest point. The relative
/// error is about the ball's radius over the capsule's.
struct CapsuleShape {
  double radius = 1;       ///< [u] > 0
  double half_height = 1;  ///< [u] ≥ 0, of the segment
};

/// A cylinder about the z axis. Its lateral surface is approximated as the capsule's. At the rim,
/// the share of a ball inside is the product of its shares inside the lateral surface and between
/// the ends.
struct CylinderShape {
  double radius = 1;       ///< [u] > 0
  double half_height = 1;  ///< [u] > 0
};

/// Terrain: the solid under a grid of heights along z, two triangles per cell, cut from (i, j) to
/// (i + 1, j + 1). Exact. Beyond its border it continues level. A height that is not finite gives
/// QueryStatus::invalid_input where a query samples it; on a GPU it invalidates every query of the
/// terrain.
struct HeightFieldShape {
  const float* heights = nullptr;  ///< [u] [rows · columns], columns (x) run fastest
  std::uint32_t columns = 0;       ///< ≥ 2, along x
  std::uint32_t rows = 0;          ///< ≥ 2, along y
  double spacing[2] = {1, 1};      ///< [u] > 0, along x and y; heights[0] is at the origin
  /// [u] Bounds of all heights; tight ones skip far objects at once. The defaults are always valid.
  double lowest = -1e300, highest = 1e300;
};

/// Distances at the points of a grid, interpolated linearly in each cell: the gradient jumps from
/// cell to cell. Points outside the grid are outside the solid. A distance that is not finite gives
/// QueryStatus::invalid_input where a query samples it.
struct DistanceGridShape {
  const float* distances = nullptr;  ///< [u] [size[0] · size[1] · size[2]], x runs fastest
  std::uint32_t size[3] = {};        ///< points along x, y, z, each ≥ 2
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [u] of the first point
  double spacing = 1;                                ///< [u] > 0
  double error = 0;  ///< [u] bound on the error of the interpolated distance
};

/// A sample of a shape.
struct ShapeSample {
  double distance = 0;                                 ///< [u] to the surface, negative inside
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< of the distance: outward
};

/// A shape by a function of the caller's. It is called once for every node and ball that is
/// visited, on the thread of the query. It must be 1-Lipschitz, and its magnitude must never exceed
/// the true distance by more than `error`. A sample that is not finite gives
/// QueryStatus::invalid_input.
struct FunctionShape {
  ShapeSample (*sample)(const void* context, const Eigen::Vector3d& x) noexcept = nullptr;
  const void* context = nullptr;  ///< passed to `sample`
  double error = 0;               ///< [u] bound on the error of distances
};

using Shape = std::variant<HalfSpaceShape, BoxShape, BallShape, CapsuleShape, CylinderShape,
                           HeightFieldShape, DistanceGridShape, FunctionShape>;

}  // namespace ist
