#pragma once

#include <ist/asset_layout.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/host_device.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/tree_ref.h"
#include "query/base/pair_place.h"
#include "query/exact/mesh_box.h"
#include "query/exact/mesh_tree.h"
#include "query/lod/level_pair.h"
#include "query/shape/plain_shapes.h"

namespace ist::gpu {

/// A block of a mesh in float, laid out for lanes that read consecutive numbers.
struct alignas(64) FloatBlock {
  float x[3][kWidth];  ///< vertices, unit frame
  std::uint32_t
      corner[kWidth];  ///< positions of a triangle's corners, a byte each; last byte 1 if it exists
};
static_assert(sizeof(FloatBlock) == 256);

inline std::vector<FloatBlock> float_blocks(const MeshTree& mesh) {
  std::vector<FloatBlock> out(mesh.count);
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& from = mesh.blocks[b];
    for (std::uint32_t l = 0; l < kWidth; ++l) {
      const exact::Point x = mesh.vertex(from.vertex[l]);
      for (int k = 0; k < 3; ++k) out[b].x[k][l] = static_cast<float>(x[k]);
      if (l < from.triangles)
        out[b].corner[l] = from.corner[0][l] | static_cast<std::uint32_t>(from.corner[1][l]) << 8 |
                           static_cast<std::uint32_t>(from.corner[2][l]) << 16 | 1u << 24;
    }
  }
  return out;
}

/// The cover radii of an inner tree, in place like TreeRef.
struct CoverRef {
  const NodeBlock* nodes[kMaxLevels];  ///< from level 1 on
  const float* spheres;
  double root;

  /// `tree`: the header of the inner tree.
  static CoverRef of(const TreeHeader& tree, const std::byte* bytes) {
    CoverRef ref = {};
    for (std::uint32_t i = 1; i < tree.level_count; ++i)
      ref.nodes[i] = reinterpret_cast<const NodeBlock*>(bytes + tree.level[i].nodes);
    ref.spheres = reinterpret_cast<const float*>(bytes + tree.sphere_cover);
    ref.root = tree.root_cover;
    return ref;
  }

  /// The cover radii of a node's children, unit frame.
  IST_HD const float* below(int level, std::uint32_t node) const {
    return level == 0 ? spheres + std::size_t{kWidth} * node : nodes[level][node].cover;
  }

  /// The cover radius of a node. `top`: the level of the tree's root.
  IST_HD double of_node(int level, std::uint32_t node, int top) const {
    return level == top ? root
                        : static_cast<double>(below(level + 1, node / kWidth)[node % kWidth]);
  }
};

/// A region of a tree, which TreeCuts (query/contact/tree_cuts.h) divides into the next node and
/// the rest.
struct CutNode {
  std::uint64_t id;          ///< of its patch
  std::uint32_t begin, end;  ///< bins, by rank
  std::uint32_t rest;        ///< node of the other side; 0: one bin, which is not divided
};

/// All regions of a tree, the root first.
struct CutsRef {
  const CutNode* node;
  const std::uint16_t* rank;  ///< of a bin; those of a region are consecutive
  std::uint32_t bins;
  int shift;  ///< a sphere's number >> shift is its bin
};

struct DetailRef {
  TreeRef tree;
  LevelCost level;
};

/// A ball evenly filled with the spheres of a node, for coarse estimates
/// (query/kernel/look_kernel.cpp).
struct FilledBall {
  double x[3], r;
  double fill;  ///< part of its volume
};

constexpr int kMostFilled = 64;

/// An asset's levels of detail. Lengths are in its unit frame.
struct AssetDetails {
  const DetailRef* level;    ///< [coarser + 1], the finest first
  const FilledBall* filled;  ///< of the coarsest level
  std::uint32_t filled_count;
  std::uint32_t coarser;
  std::uint32_t first_alike;  ///< the first asset of the batch that has the same bytes
  double mean_radius;         ///< of the finest level
  double reach;               ///< about the finest root's centre: all levels' spheres lie within
  double filled_reach;        ///< about the coarsest root's centre
};

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
  MeshBox box;                  ///< around it
  double volume;                ///< [u³] at most
  double radius;                ///< [u] of a ball around it

  IST_HD bool is_field() const { return field.kind != FieldKind::none; }
  IST_HD bool has_spheres() const { return tree[0].leaf_blocks > 0; }
};

}  // namespace ist::gpu
