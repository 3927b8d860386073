#include <gtest/gtest.h>
#include <ist/bake.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "query/asset/surface_tree.h"
#include "query/probe/sides.h"
#include "support/asset_bytes.h"
#include "support/test_meshes.h"

// Assets whose surface was damaged or made to harm, by a writer who knows the hash.

namespace ist {
namespace {

using testing::AlignedBytes;

Asset baked(TriangleMesh mesh) {
  PackingSettings settings;
  settings.max_spheres = 1;
  return bake(close_mesh(std::move(mesh), "mesh"), settings);
}

/// Reads all that a query may: the address sanitizer sees what lies outside.
void walk(const AlignedBytes& bytes) {
  TreeView view;
  ASSERT_EQ(TreeView::from_bytes(bytes.span(), view), AssetStatus::ok);
  if (!view.has_surface()) return;
  const SurfaceTree tree = surface_tree(view);
  const SurfaceHeader& surface = *tree.header;
  EXPECT_GE(view.surface_error(), 0);
  double sum = 0;
  for (int k = 1; k <= tree.top; ++k)
    for (std::uint32_t b = 0; b < tree.level[k].count; ++b)
      for (std::uint32_t l = 0; l < kWidth; ++l)
        if (tree.level[k].balls[b].r[l] != kEmptyRadius) {
          ASSERT_LT(kWidth * b + l, tree.level[k - 1].count);
          sum += tree.level[k].origins[b].x + double{tree.level[k].balls[b].x[l]};
        }
  std::uint32_t cells = 0;
  for (std::uint64_t i = 0;
       i < std::uint64_t{surface.bricks[0]} * surface.bricks[1] * surface.bricks[2]; ++i) {
    const std::uint32_t code = tree.brick_index[i];
    if (code == kOutsideBrick || code == kInsideBrick) continue;
    const CellBrick& brick = tree.bricks[code];
    for (std::uint64_t left = brick.surface; left != 0; left &= left - 1) {
      ++cells;
      const CellList list = cell_list(brick, static_cast<std::uint32_t>(std::countr_zero(left)),
                                      [&](std::uint32_t i) { return tree.cell_ends[i]; });
      for (std::uint32_t e = list.begin; e < list.end; ++e)
        for (int k = 0; k < 3; ++k) {
          float corner[3];
          tree.corner(tree.cell_triangles[e] / kWidth, tree.cell_triangles[e] % kWidth, k, corner);
          for (const float x : corner) sum += double{x};
        }
    }
  }
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(SurfaceBytes, EveryHostileWordIsRefusedOrHarmless) {
  const std::uint32_t values[] = {0u,          1u,          2u,          15u,         16u,
                                  0xffffffffu, 0xfffffffeu, 0x7fffffffu, 0x7fc00000u, 0x7f800000u,
                                  0xff800000u, 0xbf800000u, 0x7149f2cau, 0xf149f2cau, 0x00000001u};
  for (const Asset& asset :
       {baked(testing::cube_mesh()), baked(testing::torus_mesh(1, 0.4, 8, 5))}) {
    const AssetHeader& header = asset.view().header();
    ASSERT_NE(header.surface, 0u);
    AlignedBytes changed(asset.bytes());
    walk(changed);
    std::size_t accepted = 0;
    for (std::size_t at = header.surface; at < asset.bytes().size(); at += 4) {
      std::uint32_t before;
      std::memcpy(&before, &changed[at], sizeof(before));
      for (const std::uint32_t value : values) {
        std::memcpy(&changed[at], &value, sizeof(value));
        changed.seal();
        if (changed.status() != AssetStatus::ok) continue;
        ++accepted;
        SCOPED_TRACE("byte " + std::to_string(at) + " = " + std::to_string(value));
        walk(changed);
        if (HasFailure()) return;
      }
      for (std::size_t bit = at / 4 % 3; bit < 32; bit += 3) {
        const std::uint32_t value = before ^ 1u << bit;
        std::memcpy(&changed[at], &value, sizeof(value));
        changed.seal();
        if (changed.status() != AssetStatus::ok) continue;
        SCOPED_TRACE("byte " + std::to_string(at) + ", bit " + std::to_string(bit));
        walk(changed);
        if (HasFailure()) return;
      }
      std::memcpy(&changed[at], &before, sizeof(before));
    }
    EXPECT_GT(accepted, 0u);  // coordinates may be any
  }
}

TEST(SurfaceBytes, EveryOffsetCountAndRangeIsLookedAt) {
  const Asset asset = baked(testing::torus_mesh(1, 0.4, 12, 8));
  const AssetHeader& header = asset.view().header();
  const SurfaceHeader& surface = *at<SurfaceHeader>(header, header.surface);
  ASSERT_GE(surface.level_count, 2u);
  const auto refused = [&](std::uint64_t offset, auto value) {
    AlignedBytes changed(asset.bytes());
    std::memcpy(&changed[offset], &value, sizeof(value));
    changed.seal();
    EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout) << offset << " " << +value;
  };
  const auto of_surface = [&](std::size_t offset) { return header.surface + offset; };
  for (const int change : {-64, -16, -1, 1, 16, 64}) {
    const auto moved = [&](std::uint64_t offset, auto value) {
      refused(offset, static_cast<decltype(value)>(value + static_cast<decltype(value)>(change)));
    };
    moved(offsetof(AssetHeader, surface), header.surface);
    moved(of_surface(offsetof(SurfaceHeader, brick_count)), surface.brick_count);
    moved(of_surface(offsetof(SurfaceHeader, cell_count)), surface.cell_count);
    moved(of_surface(offsetof(SurfaceHeader, entry_count)), surface.entry_count);
    moved(of_surface(offsetof(SurfaceHeader, triangle_count)), surface.triangle_count);
    moved(of_surface(offsetof(SurfaceHeader, level_count)), surface.level_count);
    moved(of_surface(offsetof(SurfaceHeader, brick_index)), surface.brick_index);
    moved(of_surface(offsetof(SurfaceHeader, brick_data)), surface.brick_data);
    moved(of_surface(offsetof(SurfaceHeader, list_bytes)), surface.list_bytes);
    moved(of_surface(offsetof(SurfaceHeader, cell_ends)), surface.cell_ends);
    moved(of_surface(offsetof(SurfaceHeader, cell_triangles)), surface.cell_triangles);
    for (std::size_t k = 0; k < kMaxLevels; ++k) {
      const std::size_t level =
          of_surface(offsetof(SurfaceHeader, level) + k * sizeof(LevelHeader));
      moved(level + offsetof(LevelHeader, blocks), surface.level[k].blocks);
      moved(level + offsetof(LevelHeader, origins), surface.level[k].origins);
      moved(level + offsetof(LevelHeader, nodes), surface.level[k].nodes);
      moved(level + offsetof(LevelHeader, count), surface.level[k].count);
    }
  }
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kNanf = std::numeric_limits<float>::quiet_NaN();
  refused(of_surface(offsetof(SurfaceHeader, error)), -1.0);
  refused(of_surface(offsetof(SurfaceHeader, error)), kNan);
  refused(of_surface(offsetof(SurfaceHeader, low)), kNan);
  refused(of_surface(offsetof(SurfaceHeader, cell)), 0.0);
  refused(of_surface(offsetof(SurfaceHeader, cell)), kNan);
  for (std::size_t k = 0; k < 3; ++k)
    for (const std::uint32_t bricks : {0u, 0xffffffffu})
      refused(of_surface(offsetof(SurfaceHeader, bricks) + 4 * k), bricks);
  refused(surface.level[0].blocks, kNanf);
  refused(surface.level[0].blocks + offsetof(SurfaceBlock, corner), std::uint8_t{16});
  refused(surface.level[0].blocks + offsetof(SurfaceBlock, triangles), 17u);
  refused(surface.level[0].blocks + offsetof(SurfaceBlock, triangles), 0u);
  refused(surface.level[0].blocks + offsetof(SurfaceBlock, vertices), 17u);
  refused(surface.level[1].blocks, kNanf);
  refused(surface.level[1].blocks + offsetof(BallBlock, r), kEmptyRadius);
  refused(surface.level[1].origins, kNan);
  refused(surface.brick_index, surface.brick_count);
  refused(surface.brick_data + offsetof(CellBrick, first), 1u);
  refused(surface.brick_data + offsetof(CellBrick, surface), ~std::uint64_t{0});
  refused(surface.brick_data + offsetof(CellBrick, list), 1u);
  ASSERT_EQ(surface.list_bytes, 2u);
  refused(of_surface(offsetof(SurfaceHeader, list_bytes)), 4u);
  refused(surface.cell_ends, std::uint16_t{0xffff});
  refused(surface.cell_ends + 2 * (surface.cell_count - 1),
          static_cast<std::uint16_t>(surface.entry_count + 1));
  refused(surface.cell_triangles, static_cast<std::uint16_t>(kWidth * surface.level[0].count));
}

}  // namespace
}  // namespace ist
