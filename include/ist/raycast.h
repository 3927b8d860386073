#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>

#include <ist/query.h>
#include <ist/types.h>

// Rays and points against one solid: an asset that keeps its mesh (AssetView::has_mesh), or a
// shape.
//
// An asset is queried by its stored mesh, with exact predicates. An asset without a mesh returns
// missing_data; an invalid pose, scale, ray or point returns invalid_input. All numbers of these
// answers are NaN.
//
// Half-space, box, ball, capsule and cylinder are exact. Terrains, distance grids and
// functions support points only, by the distances that queries of solids use; a ray returns
// missing_data.
//
// No allocation, lock or exception, and no workspace: threads may share everything. Lengths are
// [u], vectors in world coordinates.

namespace IST_API ist {

struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();           ///< of any length but 0
  double max_distance = std::numeric_limits<double>::infinity();  ///< [u] > 0, its length
};

/// A ray's first hit of a solid's surface. A ray that starts inside hits it as it leaves:
/// direction · normal > 0 there. One that starts on the surface may hit it at distance 0.
struct RayHit {
  double distance = std::numeric_limits<double>::infinity();  ///< [u] ≥ 0; infinite: no hit
  Eigen::Vector3d point = Eigen::Vector3d::Zero();            ///< zero without a hit
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();           ///< unit, outward; likewise
  /// In the stored mesh: 16 · MeshBlock + lane, the same in every answer. ~0: no hit, or a shape.
  std::uint32_t triangle = ~0u;
  QueryStatus status = QueryStatus::ok;

  bool hit() const noexcept { return distance < std::numeric_limits<double>::infinity(); }
};

/// The point of a solid's surface that is nearest to a point.
struct SurfacePoint {
  double distance = 0;  ///< [u] signed: < 0 inside
  double error = 0;     ///< [u] the solid's distance is within this of `distance`
  Eigen::Vector3d point = Eigen::Vector3d::Zero();     ///< on the surface
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();  ///< of the distance: unit, outward
  std::uint32_t triangle = ~0u;                        ///< as in RayHit
  QueryStatus status = QueryStatus::ok;
};

/// The first hit of a ray. No ray passes between two triangles.
RayHit raycast(const PlacedSolid& solid, const Ray& ray) noexcept;

/// Signed distance, nearest point and gradient. Returns one of several equally near points.
SurfacePoint closest_point(const PlacedSolid& solid, const Eigen::Vector3d& point) noexcept;

/// Yes if a point is inside. On the surface the answer is yes or no, always the same one.
YesNoAnswer contains(const PlacedSolid& solid, const Eigen::Vector3d& point) noexcept;

/// answers[i] is that of rays[i] or points[i], bit for bit, for i below both sizes; others stay.
void raycast(const PlacedSolid& solid, std::span<const Ray> rays,
             std::span<RayHit> answers) noexcept;
void closest_point(const PlacedSolid& solid, std::span<const Eigen::Vector3d> points,
                   std::span<SurfacePoint> answers) noexcept;
void contains(const PlacedSolid& solid, std::span<const Eigen::Vector3d> points,
              std::span<YesNoAnswer> answers) noexcept;

}  // namespace ist
