#pragma once

#include "query/asset/surface_tree.h"

namespace ist {

/// The point of a surface nearest to a point, in its unit frame.
struct NearestSurface {
  double distance;  ///< ≥ 0, no more than the limit
  double point[3];  ///< valid if distance < limit
};

/// Looks no further than `limit`.
NearestSurface nearest_surface(const SurfaceTree& surface, const double (&x)[3],
                               double limit) noexcept;

/// Squared distance of x from a triangle, and its nearest point.
double nearest_in_triangle(const double (&x)[3], const double (&a)[3], const double (&b)[3],
                           const double (&c)[3], double (&point)[3]) noexcept;

}  // namespace ist
