#pragma once

#include "cuda/query/cover_ref.h"
#include "cuda/query/cuts_ref.h"
#include "cuda/query/detail_ref.h"
#include "cuda/query/field_ref.h"
#include "cuda/query/float_block.h"
#include "cuda/query/node_sums.h"
#include "cuda/query/tree_ref.h"
#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"

namespace ist::gpu {

/// A solid of a batch: a field, or an asset's trees.
struct SolidRef {
  AssetFrame frame;  ///< of an asset; a field has its own
  FieldRef field;    ///< FieldKind::none: an asset, which has all that follows
  TreeRef tree[2];   ///< by Measure
  SumsRef sums[2];   ///< by Measure
  CutsRef cuts[2];   ///< by Measure
  CoverRef cover;    ///< of the inner tree
  AssetDetails details;
  MeshTree mesh;                ///< without a header: none is kept
  const FloatBlock* in_floats;  ///< its blocks
  double volume;                ///< [u³] at most
  double radius;                ///< [u] of a ball around it

  IST_HD bool is_field() const { return field.kind != FieldKind::none; }
  IST_HD bool has_spheres() const { return tree[0].leaf_blocks > 0; }
};

}  // namespace ist::gpu
