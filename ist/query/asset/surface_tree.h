#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/tree_view.h>

#include <ist/asset_layout.h>

namespace ist {

/// Numbers of two or four bytes.
class NarrowArray {
 public:
  NarrowArray(const AssetHeader& asset, std::uint64_t offset, std::uint32_t width) noexcept
      : two_(width == 2 ? at<std::uint16_t>(asset, offset) : nullptr),
        four_(width == 2 ? nullptr : at<std::uint32_t>(asset, offset)) {}

  std::uint32_t operator[](std::size_t i) const noexcept {
    return two_ != nullptr ? two_[i] : four_[i];
  }

 private:
  const std::uint16_t* two_;
  const std::uint32_t* four_;
};

/// The surface of an asset with its offsets resolved: a tree of balls over blocks of
/// triangles, and the grid that tells inside from outside. All in the unit frame.
///
/// Lane l of block b at level k + 1 is a ball around the triangles below block 16 b + l of level k.
/// The top level is one block; where it is level 0, there are no balls.
///
/// The `inside` bit of a cell is the parity of its reference point's winding number about these
/// triangles: as many steps through them from there to a point, so often it changes.
struct SurfaceTree {
  /// Balls around the blocks of the level below; level 0 has none.
  struct Level {
    const BallBlock* balls = nullptr;
    const Origin* origins = nullptr;
    std::uint32_t count = 0;  ///< blocks at this level, level 0 included
  };

  SurfaceTree(const AssetHeader& asset, const SurfaceHeader& surface) noexcept
      : header(&surface),
        top(static_cast<int>(surface.level_count) - 1),
        blocks(at<SurfaceBlock>(asset, surface.level[0].blocks)),
        brick_index(at<std::uint32_t>(asset, surface.brick_index)),
        bricks(at<CellBrick>(asset, surface.brick_data)),
        cell_ends(asset, surface.cell_ends, surface.list_bytes),
        cell_triangles(asset, surface.cell_triangles, surface.list_bytes) {
    level[0].count = surface.level[0].count;
    for (int i = 1; i <= top; ++i) {
      const LevelHeader& from = surface.level[i];
      level[i] = {at<BallBlock>(asset, from.blocks), at<Origin>(asset, from.origins), from.count};
    }
  }

  /// Corner k of the triangle in a lane of a block.
  void corner(std::uint32_t block, std::uint32_t lane, int k, float out[3]) const noexcept {
    const SurfaceBlock& b = blocks[block];
    const std::uint32_t vertex = b.corner[k][lane];
    out[0] = b.x[vertex];
    out[1] = b.y[vertex];
    out[2] = b.z[vertex];
  }

  const SurfaceHeader* header;
  int top;  ///< the level of one block
  const SurfaceBlock* blocks;
  Level level[kMaxLevels];
  const std::uint32_t* brick_index;  ///< [bricks[0] · bricks[1] · bricks[2]], x runs fastest
  const CellBrick* bricks;           ///< [brick_count]
  NarrowArray cell_ends;             ///< [cell_count] from CellBrick::list
  NarrowArray cell_triangles;        ///< [entry_count] 16 · block + lane
};

/// The surface of a view that has one (TreeView::has_surface).
inline SurfaceTree surface_tree(const TreeView& view) noexcept {
  const AssetHeader& asset = view.header();
  return SurfaceTree(asset, *at<SurfaceHeader>(asset, asset.surface));
}

}  // namespace ist
