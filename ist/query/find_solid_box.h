#pragma once

#include <ist/asset.h>
#include <ist/mass_properties.h>
#include <ist/shapes.h>

#include <variant>

#include "query/base/relative_pose.h"
#include "query/base/solid_box.h"
#include "query/shape/shapes.h"

namespace ist {

inline SolidBox solid_box(const AssetView& asset) noexcept {
  const Bounds own = bounds(asset);
  return {plain((own.lower + own.upper) / 2),
          plain((own.upper - own.lower) / 2),
          asset.protrusion(),
          asset.mesh_error(),
          false,
          false,
          asset.empty()};
}

/// Empty for a shape with a number out of range.
inline SolidBox solid_box(const Shape& shape) noexcept {
  if (!std::visit([](const auto& any) { return is_sound(any); }, shape))
    return {.is_shape = true, .empty = true};
  const auto around = [](const Vec3& half, const Vec3& middle = {0, 0, 0}) {
    return SolidBox{.middle = middle, .half = half, .is_shape = true};
  };
  if (const auto* box = std::get_if<BoxShape>(&shape)) return around(plain(box->half_extents));
  if (const auto* ball = std::get_if<BallShape>(&shape))
    return around({ball->radius, ball->radius, ball->radius});
  if (const auto* capsule = std::get_if<CapsuleShape>(&shape))
    return around({capsule->radius, capsule->radius, capsule->radius + capsule->half_height});
  if (const auto* cylinder = std::get_if<CylinderShape>(&shape))
    return around({cylinder->radius, cylinder->radius, cylinder->half_height});
  if (const auto* grid = std::get_if<DistanceGridShape>(&shape)) {
    const Eigen::Vector3d half =
        grid->spacing / 2 *
        Eigen::Vector3d(grid->size[0] - 1.0, grid->size[1] - 1.0, grid->size[2] - 1.0);
    return around(plain(half), plain(grid->origin + half));
  }
  return {.endless = true, .is_shape = true};
}

}  // namespace ist
