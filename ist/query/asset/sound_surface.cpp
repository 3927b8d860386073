#include "query/asset/sound_surface.h"

#include <bit>

#include "query/asset/sound_values.h"
#include "query/asset/surface_tree.h"

namespace ist {
namespace {

constexpr std::uint32_t kMostBricks = 1u << 20;  // along an axis

bool sound_surface_block(const SurfaceBlock& block) noexcept {
  if (block.triangles < 1 || block.triangles > kWidth) return false;
  if (block.vertices < 3 || block.vertices > kWidth) return false;
  bool sound = true;
  for (std::uint32_t v = 0; v < kWidth; ++v) {
    sound &= is_offset(block.x[v]) && is_offset(block.y[v]) && is_offset(block.z[v]);
    if (v >= block.vertices)
      sound &= block.x[v] == block.x[0] && block.y[v] == block.y[0] && block.z[v] == block.z[0];
  }
  for (const auto& corners : block.corner)
    for (std::uint32_t l = 0; l < kWidth; ++l)
      sound &= l < block.triangles ? corners[l] < block.vertices : corners[l] == 0;
  return sound;
}

bool sound_triangles(const AssetHeader& header, const SurfaceHeader& surface) noexcept {
  const SurfaceBlock* blocks = at<SurfaceBlock>(header, surface.level[0].blocks);
  std::uint64_t triangles = 0;
  bool sound = true;
  for (std::uint32_t b = 0; b < surface.level[0].count; ++b) {
    sound &= sound_surface_block(blocks[b]);
    triangles += blocks[b].triangles;
  }
  return sound && triangles == surface.triangle_count;
}

bool sound_balls(const AssetHeader& header, const SurfaceHeader& surface) noexcept {
  bool sound = true;
  for (std::uint32_t k = 1; k < surface.level_count; ++k) {
    const LevelHeader& level = surface.level[k];
    const BallBlock* balls = at<BallBlock>(header, level.blocks);
    const Origin* origins = at<Origin>(header, level.origins);
    for (std::uint32_t b = 0; b < level.count; ++b)
      sound &= sound_block(balls[b], surface.level[k - 1].count - std::uint64_t{kWidth} * b) &&
               sound_origin(origins[b]);
  }
  return sound;
}

bool sound_bricks(const AssetHeader& header, const SurfaceHeader& surface) noexcept {
  const std::uint64_t places =
      std::uint64_t{surface.bricks[0]} * surface.bricks[1] * surface.bricks[2];
  const std::uint32_t* index = at<std::uint32_t>(header, surface.brick_index);
  bool sound = true;
  for (std::uint64_t i = 0; i < places; ++i)
    sound &=
        index[i] < surface.brick_count || index[i] == kOutsideBrick || index[i] == kInsideBrick;
  const CellBrick* bricks = at<CellBrick>(header, surface.brick_data);
  std::uint64_t cells = 0;
  for (std::uint32_t i = 0; i < surface.brick_count; ++i) {
    sound &= bricks[i].first == cells;
    cells += static_cast<std::uint64_t>(std::popcount(bricks[i].surface));
  }
  return sound && cells == surface.cell_count;
}

/// The lists of each brick's cells follow each other, and those of the bricks do.
bool sound_ends(const SurfaceTree& surface) noexcept {
  std::uint32_t end = 0;
  bool sound = true;
  for (std::uint32_t i = 0; i < surface.header->brick_count; ++i) {
    const CellBrick& brick = surface.bricks[i];
    sound &= brick.list == end;
    std::uint32_t in_brick = 0;
    const auto cells = static_cast<std::uint32_t>(std::popcount(brick.surface));
    for (std::uint32_t c = brick.first; c < brick.first + cells; ++c) {
      sound &= in_brick <= surface.cell_ends[c];
      in_brick = surface.cell_ends[c];
    }
    sound &= in_brick <= surface.header->entry_count - end;
    end += in_brick;
    if (!sound) return false;
  }
  return end == surface.header->entry_count;
}

bool sound_cells(const AssetHeader& header, const SurfaceHeader& surface) noexcept {
  const SurfaceTree tree(header, surface);
  if (!sound_ends(tree)) return false;
  bool sound = true;
  for (std::uint32_t i = 0; i < surface.entry_count && sound; ++i) {
    const std::uint32_t triangle = tree.cell_triangles[i], block = triangle / kWidth;
    sound = block < surface.level[0].count && triangle % kWidth < tree.blocks[block].triangles;
  }
  return sound;
}

}  // namespace

bool sound_surface_counts(const SurfaceHeader& surface) noexcept {
  for (const std::uint32_t along : surface.bricks)
    if (along < 1 || along > kMostBricks) return false;
  if (surface.list_bytes != 2 && surface.list_bytes != 4) return false;
  return surface.level[0].count >= 1 && surface.level[0].count <= kMostBlocks;
}

bool sound_surface(const AssetHeader& header, const SurfaceHeader& surface) noexcept {
  if (!is_radius(surface.error) || !in_range(surface.cell, 1e-9, kMaxExtent)) return false;
  for (int k = 0; k < 3; ++k) {
    const double high = surface.low[k] + surface.cell * kBrickWidth * surface.bricks[k];
    if (!is_offset(surface.low[k]) || !is_offset(high)) return false;
  }
  return sound_triangles(header, surface) && sound_balls(header, surface) &&
         sound_bricks(header, surface) && sound_cells(header, surface);
}

}  // namespace ist
