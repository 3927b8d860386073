#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

#include "cuda/query/surface_ref.h"

namespace ist::gpu {

/// Those of ist::Field that a batch knows; none, and one whose numbers are out of range.
enum class FieldKind : std::uint32_t {
  none,
  unusable,
  half_space,
  ball,
  capsule,
  cylinder,
  grid,
  box,
  height,
  mesh
};

struct HalfSpaceRef {
  double normal[3];  ///< unit
  double offset;
};

/// A ball, a capsule or a cylinder.
struct RoundRef {
  double radius, half;
};

struct BoxRef {
  double half[3];
};

struct HeightRef {
  const float* heights;
  std::uint32_t columns, rows;
  double spacing[2];
  double lowest, highest;
};

struct GridRef {
  const float* distances;
  std::uint32_t size[3];
  double origin[3];
  double spacing;
  double error;
};

/// A field of a batch in plain numbers (ist/field.h), what it points to being where the batch is
/// worked on.
struct FieldRef {
  FieldKind kind;
  union {
    HalfSpaceRef half_space;
    RoundRef round;
    BoxRef box;
    HeightRef height;
    GridRef grid;
    SurfaceRef mesh;
  };
};

/// Kinds that are summed in the same way.
enum FieldGroup { kSmooth, kFacets, kMesh, kFieldGroups };

IST_HD inline FieldGroup group_of(FieldKind kind) {
  return kind == FieldKind::mesh                               ? kMesh
         : kind == FieldKind::box || kind == FieldKind::height ? kFacets
                                                               : kSmooth;
}

}  // namespace ist::gpu
