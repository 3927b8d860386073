#pragma once

#include <cstdint>

#include "cuda/query/part_sums.h"
#include "cuda/query/tree_ref.h"
#include "query/lod/level_pair.h"

namespace ist::gpu {

/// A matched tree at a level of detail.
struct DetailRef {
  TreeRef tree;
  LevelCost level;
};

/// A ball evenly filled with the spheres of a node, as a quick look sees it
/// (query/kernel/look_kernel.h).
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

}  // namespace ist::gpu
