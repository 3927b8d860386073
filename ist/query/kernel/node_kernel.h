#pragma once

#include <cstddef>
#include <cstdint>

#include "query/asset/sphere_tree.h"
#include "query/base/precision.h"
#include "query/base/relative_pose.h"

namespace ist {

/// A coarse estimate of the overlap of two trees, each approximated by a few balls that are evenly
/// filled with the volume of the spheres below. Smooth in the pose. A's unit frame.
struct QuickLook {
  double volume = 0;
  PoseSlope slope;
};

/// Uses the lowest levels of no more than 64 nodes. `slopes`: computes the derivatives, else 0.
QuickLook quick_look(const SphereTree& a, const SphereTree& b, const Similarity& a_from_b,
                     bool slopes) noexcept;

/// Running sums over spheres, in their tree's unit frame, by lanes. Without factors of π.
struct alignas(64) SubtreeSums {
  double cubes[kWidth] = {};      ///< Σ r³
  double moment[3][kWidth] = {};  ///< Σ r³ · centre
  std::uint32_t spheres = 0;
};

/// Adds the spheres below n nodes of a level, in order. Same bits on every instruction set.
void add_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) noexcept;

/// The largest number of pairs that are opened together.
inline constexpr std::size_t kNodePairs = 64;

/// One stage of the traversal: nodes of tree x are opened, those of y are not.
struct NodeStage {
  const SphereTree* x;
  const SphereTree* y;
  int level_x;  ///< of the blocks that are opened, ≥ 0
  int level_y;  ///< ≥ kSphereLevel
  const Similarity* x_from_y;
  Precision precision;
};

/// Nodes of x that lie in a sphere of y.
struct ContainedNodes {
  std::uint32_t* x;
  std::uint32_t* y;
  std::size_t size = 0;
};

/// Opens node x[i] of each of n ≤ kNodePairs pairs and keeps its children that reach node y[i],
/// within rounding. Writes at most 16 n pairs and up to 16 entries of scratch beyond them; returns
/// the number of pairs. Same output on every instruction set.
///
/// `contained`, for single spheres y: gets the children that lie wholly in sphere y[i] instead,
/// with the same limits.
std::size_t open_nodes(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                       std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y,
                       ContainedNodes* contained) noexcept;

}  // namespace ist
