#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "cuda/query/part_sums.h"
#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// A matched tree at a level of detail.
struct DetailRef {
  TreeRef tree;
  double mean_radius, volume_sum, sphere_count;

  static DetailRef of(const TreeHeader& tree, const std::byte* bytes) {
    return {TreeRef::of(tree, bytes), tree.mean_radius, tree.volume_sum,
            static_cast<double>(tree.sphere_count)};
  }
};

/// A ball evenly filled with the spheres of a node, as a quick look sees it
/// (query/kernel/look_kernel.h).
struct FilledBall {
  double x[3], r;
  double fill;  ///< part of its volume
};

constexpr int kMostFilled = 64;

/// What a batch knows of an asset's levels of detail; lengths in its unit frame.
struct AssetDetails {
  const DetailRef* level;    ///< [coarser + 1], the finest first
  const FilledBall* filled;  ///< of the coarsest
  std::uint32_t filled_count;
  std::uint32_t coarser;
  std::uint32_t first_alike;  ///< the first asset of the batch that has the same bytes
  double mean_radius;         ///< of the finest
  double reach;               ///< about the finest root's centre: all levels' spheres lie within
  double filled_reach;        ///< about the coarsest root's centre
};

inline std::vector<DetailRef> detail_refs(const AssetHeader& header, const std::byte* bytes) {
  std::vector<DetailRef> refs;
  for (std::uint32_t i = 0; i <= header.detail_count; ++i)
    refs.push_back(DetailRef::of(matched_tree(header, i), bytes));
  return refs;
}

/// The nodes of the lowest level of the coarsest tree that has no more than kMostFilled.
inline std::vector<FilledBall> filled_balls(const AssetHeader& header) {
  const TreeHeader& tree = matched_tree(header, header.detail_count);
  const std::uint32_t top = tree.level_count - 1;
  std::uint32_t at_level = 0;
  while (at_level < top && tree.level[at_level].count > kMostFilled) ++at_level;
  const auto sphere = [](double r) { return 4 * kPi / 3 * ((r * r) * r); };
  if (at_level == top) {
    const double* const root = tree.root;
    return {{{root[0], root[1], root[2]}, root[3], tree.volume_sum / sphere(root[3])}};
  }
  std::vector<FilledBall> balls;
  const LevelHeader& level = tree.level[at_level + 1];
  for (std::uint32_t i = 0; i < tree.level[at_level].count; ++i) {
    const BallBlock& block = at<BallBlock>(header, level.blocks)[i / kWidth];
    const Origin& origin = at<Origin>(header, level.origins)[i / kWidth];
    const NodeBlock& node = at<NodeBlock>(header, level.nodes)[i / kWidth];
    const std::uint32_t lane = i % kWidth;
    const auto r = static_cast<double>(block.r[lane]);
    balls.push_back({{origin.x + static_cast<double>(block.x[lane]),
                      origin.y + static_cast<double>(block.y[lane]),
                      origin.z + static_cast<double>(block.z[lane])},
                     r,
                     static_cast<double>(node.volume[lane]) / sphere(r)});
  }
  return balls;
}

/// How far balls reach from a centre.
inline double reach_of(const std::vector<FilledBall>& balls, const double* centre) {
  double reach = 0;
  for (const FilledBall& ball : balls)
    reach = std::max(
        reach,
        std::hypot(ball.x[0] - centre[0], ball.x[1] - centre[1], ball.x[2] - centre[2]) + ball.r);
  return reach * (1 + 1e-9);
}

/// All but places and likeness of AssetDetails.
inline AssetDetails asset_details(const AssetHeader& header, const std::vector<FilledBall>& balls) {
  AssetDetails details = {};
  details.coarser = header.detail_count;
  details.mean_radius = header.matched_tree.mean_radius;
  details.filled_count = static_cast<std::uint32_t>(balls.size());
  std::vector<FilledBall> roots;
  for (std::uint32_t i = 0; i <= header.detail_count; ++i) {
    const double* const root = matched_tree(header, i).root;
    roots.push_back({{root[0], root[1], root[2]}, root[3], 1});
  }
  details.reach = reach_of(roots, roots.front().x);
  details.filled_reach = reach_of(balls, roots.back().x);
  return details;
}

}  // namespace ist::gpu
