#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <ist/asset_layout.h>

#include "cuda/query/tree_ref.h"
#include "numerics/host_device.h"

namespace ist::gpu {

/// A node of a surface, its rank and its number, in one word. Of rank 0 it is a triangle, 16 times
/// its block and its lane; of rank k + 1 a block of level k: of triangles, and from rank 2 on of
/// balls.
using SurfaceNode = std::uint32_t;
constexpr int kSurfaceBits = 28;  ///< of a node's number
constexpr int kTriangle = 0, kTriangleBlock = 1;
static_assert(kMaxLevels < 1 << (32 - kSurfaceBits));

IST_HD inline int rank_of(SurfaceNode node) { return static_cast<int>(node >> kSurfaceBits); }
IST_HD inline std::uint32_t number_of(SurfaceNode node) {
  return node & ((1u << kSurfaceBits) - 1);
}
IST_HD inline SurfaceNode surface_node(int rank, std::uint32_t number) {
  return static_cast<std::uint32_t>(rank) << kSurfaceBits | number;
}

/// The surface of an asset with its offsets resolved (SurfaceTree, query/asset/surface_tree.h, in
/// plain numbers).
struct SurfaceRef {
  const SurfaceBlock* blocks;
  const BallBlock* balls[kMaxLevels];  ///< around the blocks of the level below; none at level 0
  const Origin* origins[kMaxLevels];
  /// Cube of the typical radius of a level's nodes, which tile an area.
  double cube[kMaxLevels];
  double root[4];  ///< ball around the grid
  double low[3], cell;
  std::uint32_t bricks[3];
  int top;  ///< the level of one block
  const std::uint32_t* brick_index;
  const CellBrick* brick_data;
  const std::byte* cell_ends;
  const std::byte* cell_triangles;
  std::uint32_t list_bytes;

  /// `asset`: a header that the host reads, of an asset with a surface; `bytes`: where it lies.
  static SurfaceRef of(const AssetHeader& asset, const std::byte* bytes) {
    const SurfaceHeader& surface = *at<SurfaceHeader>(asset, asset.surface);
    SurfaceRef ref = {};
    ref.top = static_cast<int>(surface.level_count) - 1;
    ref.blocks = reinterpret_cast<const SurfaceBlock*>(bytes + surface.level[0].blocks);
    double square = 0;
    for (int k = 0; k < 3; ++k) {
      const double half = 0.5 * surface.cell * static_cast<double>(kBrickWidth * surface.bricks[k]);
      ref.low[k] = surface.low[k];
      ref.bricks[k] = surface.bricks[k];
      ref.root[k] = surface.low[k] + half;
      square += half * half;
    }
    ref.root[3] = std::sqrt(square);
    for (int i = 0; i <= ref.top; ++i) {
      const double count = surface.level[i].count;
      ref.cube[i] = ref.root[3] * ref.root[3] * ref.root[3] / (count * std::sqrt(count));
      if (i == 0) continue;
      ref.balls[i] = reinterpret_cast<const BallBlock*>(bytes + surface.level[i].blocks);
      ref.origins[i] = reinterpret_cast<const Origin*>(bytes + surface.level[i].origins);
    }
    ref.cell = surface.cell;
    ref.brick_index = reinterpret_cast<const std::uint32_t*>(bytes + surface.brick_index);
    ref.brick_data = reinterpret_cast<const CellBrick*>(bytes + surface.brick_data);
    ref.cell_ends = bytes + surface.cell_ends;
    ref.cell_triangles = bytes + surface.cell_triangles;
    ref.list_bytes = surface.list_bytes;
    return ref;
  }

  IST_HD SurfaceNode root_node() const { return surface_node(top + 1, 0); }

  /// Of a node that is no triangle.
  IST_HD NodeBall ball(SurfaceNode node) const {
    const int above = rank_of(node);
    if (above > top) return {{root[0], root[1], root[2]}, root[3]};
    return lane_ball(above, number_of(node) / kWidth, number_of(node) % kWidth);
  }

  /// The ball in a lane of a block of a level above 0; a negative radius if there is none.
  IST_HD NodeBall lane_ball(int level, std::uint32_t block, std::uint32_t lane) const {
    return ist::lane_ball(in_global_memory(balls[level])[block],
                          in_global_memory(origins[level])[block], lane);
  }

  /// Corners of triangle 16 · block + lane.
  template <class Number>
  IST_HD void corners(std::uint32_t triangle, Number (&c)[3][3]) const {
    const SurfaceBlock& b = in_global_memory(blocks)[triangle / kWidth];
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t vertex = b.corner[k][triangle % kWidth];
      c[k][0] = static_cast<Number>(b.x[vertex]);
      c[k][1] = static_cast<Number>(b.y[vertex]);
      c[k][2] = static_cast<Number>(b.z[vertex]);
    }
  }

  IST_HD std::uint32_t listed(const std::byte* list, std::uint32_t i) const {
    return list_bytes == 2 ? reinterpret_cast<const std::uint16_t*>(list)[i]
                           : reinterpret_cast<const std::uint32_t*>(list)[i];
  }
};

}  // namespace ist::gpu
