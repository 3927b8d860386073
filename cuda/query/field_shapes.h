#pragma once

#include "base/host_device.h"
#include "cuda/query/field_ref.h"

// Dispatches to the kinds of fields (query/shape/plain_shapes.h).

namespace ist::gpu {

/// A lower bound of the distance to the surface, negative inside.
IST_HD inline double distance_in(const FieldRef& field, const double (&x)[3], bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return field.half_space.sample(x).distance;
    case FieldKind::ball:
      return field.ball.sample(x).distance;
    case FieldKind::capsule:
      return field.capsule.sample(x).distance;
    case FieldKind::cylinder:
      return field.cylinder.sample(x).distance;
    case FieldKind::grid:
      return field.grid.sample(x, sound).distance;
    case FieldKind::box:
      return field.box.sample(x).distance;
    case FieldKind::height:
      return field.height.sample(x).distance;
    default:
      return 0;
  }
}

/// The error of distances.
IST_HD inline double distance_error(const FieldRef& field) {
  return field.kind == FieldKind::grid ? field.grid.error : 0;
}

/// The part of a ball inside a smooth field (kSmooth).
IST_HD inline BallPart part_in(const FieldRef& field, const double (&x)[3], double r, bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return flat_part(field.half_space.sample(x), r);
    case FieldKind::ball:
      return field.ball.part(x, r);
    case FieldKind::capsule:
      return flat_part(field.capsule.sample(x), r);
    case FieldKind::cylinder:
      return field.cylinder.part(x, r);
    case FieldKind::grid:
      return flat_part(field.grid.sample(x, sound), r);
    default:
      return {};
  }
}

}  // namespace ist::gpu
