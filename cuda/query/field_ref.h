#pragma once

#include <cstdint>

#include "query/shape/plain_shapes.h"

namespace ist::gpu {

/// The kinds of ist::Shape that a batch supports, `none`, and a shape whose numbers are out of
/// range.
enum class FieldKind : std::uint32_t {
  none,
  unusable,
  half_space,
  ball,
  capsule,
  cylinder,
  grid,
  box,
  height
};

/// A field of a batch in plain numbers (ist/shapes.h). Its pointers are valid where the batch runs.
struct FieldRef {
  FieldKind kind;
  union {
    PlainHalfSpace half_space;
    PlainBall ball;
    PlainCapsule capsule;
    PlainCylinder cylinder;
    PlainGrid grid;
    PlainBox box;
    PlainTerrain height;
  };
};

/// Groups of kinds that are summed in the same way.
enum FieldGroup { kSmooth, kFacets, kFieldGroups };

IST_HD inline FieldGroup group_of(FieldKind kind) {
  return kind == FieldKind::box || kind == FieldKind::height ? kFacets : kSmooth;
}

}  // namespace ist::gpu
