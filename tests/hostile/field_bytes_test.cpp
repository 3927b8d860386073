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

// Assets whose field was damaged or made to harm, by a writer who knows the hash.

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
  if (!view.has_field()) return;
  const SurfaceTree tree = surface_tree(view);
  const FieldHeader& field = *tree.header;
  EXPECT_GE(view.field_error(), 0);
  double sum = 0;
  for (int k = 1; k <= tree.top; ++k)
    for (std::uint32_t b = 0; b < tree.level[k].count; ++b)
      for (std::uint32_t l = 0; l < kWidth; ++l)
        if (tree.level[k].balls[b].r[l] != kEmptyRadius) {
          ASSERT_LT(kWidth * b + l, tree.level[k - 1].count);
          sum += tree.level[k].origins[b].x + double{tree.level[k].balls[b].x[l]};
        }
  std::uint32_t cells = 0;
  for (std::uint64_t i = 0; i < std::uint64_t{field.bricks[0]} * field.bricks[1] * field.bricks[2];
       ++i) {
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

TEST(FieldBytes, EveryHostileWordIsRefusedOrHarmless) {
  const std::uint32_t values[] = {0u,          1u,          2u,          15u,         16u,
                                  0xffffffffu, 0xfffffffeu, 0x7fffffffu, 0x7fc00000u, 0x7f800000u,
                                  0xff800000u, 0xbf800000u, 0x7149f2cau, 0xf149f2cau, 0x00000001u};
  for (const Asset& asset :
       {baked(testing::cube_mesh()), baked(testing::torus_mesh(1, 0.4, 8, 5))}) {
    const AssetHeader& header = asset.view().header();
    ASSERT_NE(header.field, 0u);
    AlignedBytes changed(asset.bytes());
    walk(changed);
    std::size_t accepted = 0;
    for (std::size_t at = header.field; at < asset.bytes().size(); at += 4) {
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

TEST(FieldBytes, EveryOffsetCountAndRangeIsLookedAt) {
  const Asset asset = baked(testing::torus_mesh(1, 0.4, 12, 8));
  const AssetHeader& header = asset.view().header();
  const FieldHeader& field = *at<FieldHeader>(header, header.field);
  ASSERT_GE(field.level_count, 2u);
  const auto refused = [&](std::uint64_t offset, auto value) {
    AlignedBytes changed(asset.bytes());
    std::memcpy(&changed[offset], &value, sizeof(value));
    changed.seal();
    EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout) << offset << " " << +value;
  };
  const auto of_field = [&](std::size_t offset) { return header.field + offset; };
  for (const int change : {-64, -16, -1, 1, 16, 64}) {
    const auto moved = [&](std::uint64_t offset, auto value) {
      refused(offset, static_cast<decltype(value)>(value + static_cast<decltype(value)>(change)));
    };
    moved(offsetof(AssetHeader, field), header.field);
    moved(of_field(offsetof(FieldHeader, brick_count)), field.brick_count);
    moved(of_field(offsetof(FieldHeader, cell_count)), field.cell_count);
    moved(of_field(offsetof(FieldHeader, entry_count)), field.entry_count);
    moved(of_field(offsetof(FieldHeader, triangle_count)), field.triangle_count);
    moved(of_field(offsetof(FieldHeader, level_count)), field.level_count);
    moved(of_field(offsetof(FieldHeader, brick_index)), field.brick_index);
    moved(of_field(offsetof(FieldHeader, brick_data)), field.brick_data);
    moved(of_field(offsetof(FieldHeader, list_bytes)), field.list_bytes);
    moved(of_field(offsetof(FieldHeader, cell_ends)), field.cell_ends);
    moved(of_field(offsetof(FieldHeader, cell_triangles)), field.cell_triangles);
    for (std::size_t k = 0; k < kMaxLevels; ++k) {
      const std::size_t level = of_field(offsetof(FieldHeader, level) + k * sizeof(LevelHeader));
      moved(level + offsetof(LevelHeader, blocks), field.level[k].blocks);
      moved(level + offsetof(LevelHeader, origins), field.level[k].origins);
      moved(level + offsetof(LevelHeader, nodes), field.level[k].nodes);
      moved(level + offsetof(LevelHeader, count), field.level[k].count);
    }
  }
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr float kNanf = std::numeric_limits<float>::quiet_NaN();
  refused(of_field(offsetof(FieldHeader, error)), -1.0);
  refused(of_field(offsetof(FieldHeader, error)), kNan);
  refused(of_field(offsetof(FieldHeader, low)), kNan);
  refused(of_field(offsetof(FieldHeader, cell)), 0.0);
  refused(of_field(offsetof(FieldHeader, cell)), kNan);
  for (std::size_t k = 0; k < 3; ++k)
    for (const std::uint32_t bricks : {0u, 0xffffffffu})
      refused(of_field(offsetof(FieldHeader, bricks) + 4 * k), bricks);
  refused(field.level[0].blocks, kNanf);
  refused(field.level[0].blocks + offsetof(SurfaceBlock, corner), std::uint8_t{16});
  refused(field.level[0].blocks + offsetof(SurfaceBlock, triangles), 17u);
  refused(field.level[0].blocks + offsetof(SurfaceBlock, triangles), 0u);
  refused(field.level[0].blocks + offsetof(SurfaceBlock, vertices), 17u);
  refused(field.level[1].blocks, kNanf);
  refused(field.level[1].blocks + offsetof(BallBlock, r), kEmptyRadius);
  refused(field.level[1].origins, kNan);
  refused(field.brick_index, field.brick_count);
  refused(field.brick_data + offsetof(CellBrick, first), 1u);
  refused(field.brick_data + offsetof(CellBrick, surface), ~std::uint64_t{0});
  refused(field.brick_data + offsetof(CellBrick, list), 1u);
  ASSERT_EQ(field.list_bytes, 2u);
  refused(of_field(offsetof(FieldHeader, list_bytes)), 4u);
  refused(field.cell_ends, std::uint16_t{0xffff});
  refused(field.cell_ends + 2 * (field.cell_count - 1),
          static_cast<std::uint16_t>(field.entry_count + 1));
  refused(field.cell_triangles, static_cast<std::uint16_t>(kWidth * field.level[0].count));
}

}  // namespace
}  // namespace ist
