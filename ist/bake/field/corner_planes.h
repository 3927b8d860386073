#pragma once

#include <array>
#include <span>

namespace ist {

/// Of a triangle.
struct AreaVector {
  double n[3];    ///< twice the area times the normal
  double length;  ///< of n
};

/// A corner of a triangle and its plane.
struct CornerPlane {
  AreaVector triangle;
  double x[3];
};

/// Where a cluster of corners goes: as near as can be to their planes, weighted by area, and held
/// to their mean.
std::array<double, 3> placed(std::span<const CornerPlane> planes);

/// Distance of p from the plane that passes farthest from it.
double farthest_plane(std::span<const CornerPlane> planes, const std::array<double, 3>& p);

/// A distance that no point within `size` of the corners comes nearer to all planes than. Looks at
/// four planes in a row at a time.
double nearest_of_any(std::span<const CornerPlane> planes, double size);

}  // namespace ist
