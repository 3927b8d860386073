#include <gtest/gtest.h>
#include <ist/bake.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "support/asset_bytes.h"
#include "support/test_meshes.h"

// Assets whose mesh was damaged or made to harm, by a writer who knows the hash.

namespace ist {
namespace {

using testing::AlignedBytes;

Asset alone(TriangleMesh mesh) { return bake_mesh_only(close_mesh(std::move(mesh), "mesh")); }

/// Reads everything that a query may read: the address sanitizer detects reads outside.
void walk_mesh(const AlignedBytes& bytes) {
  AssetView view;
  ASSERT_EQ(AssetView::from_bytes(bytes.span(), view), AssetStatus::ok);
  ASSERT_TRUE(view.has_mesh());
  const AssetHeader& asset = view.header();
  const MeshHeader& mesh = *at<MeshHeader>(asset, asset.mesh);
  const auto* const vertices = at<double>(asset, mesh.vertices);
  const auto* const blocks = at<MeshBlock>(asset, mesh.level[0].blocks);
  const auto* const neighbours = at<std::uint32_t>(asset, mesh.neighbours);
  double sum = view.mesh_error() + view.self_overlap_volume();
  std::uint64_t triangles = 0;
  for (std::uint32_t b = 0; b < mesh.level[0].count; ++b) {
    const MeshBlock& block = blocks[b];
    for (const auto& corners : block.corner)
      for (const std::uint8_t corner : corners)
        for (std::size_t k = 0; k < 3; ++k)
          sum += vertices[3 * std::size_t{block.vertex[corner]} + k];
    for (const std::uint32_t v : block.vertex) sum += vertices[3 * std::size_t{v}];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t entry = neighbours[block.first_neighbour + k];
      sum += blocks[entry / kWidth].vertex[0] + block.vertex[entry % kWidth];
    }
    sum += at<MeshShell>(asset, mesh.shells)[block.shell].block;
    triangles += block.triangles;
  }
  EXPECT_EQ(triangles, view.mesh_triangles());
  for (std::uint32_t k = 1; k < mesh.level_count; ++k)
    for (std::uint32_t i = 0; i < mesh.level[k - 1].count; ++i)
      sum += double{at<BoxBlock>(asset, mesh.level[k].blocks)[i / kWidth].low[2][i % kWidth]};
  for (std::uint32_t s = 0; s < mesh.shell_count; ++s)
    ASSERT_LT(at<MeshShell>(asset, mesh.shells)[s].block, mesh.level[0].count);
  EXPECT_TRUE(std::isfinite(sum));
}

TEST(MeshBytes, EveryHostileWordIsRefusedOrHarmless) {
  const std::uint32_t values[] = {0u,          1u,          2u,          15u,         16u,
                                  0xffffffffu, 0xfffffffeu, 0x7fffffffu, 0x7fc00000u, 0x7f800000u,
                                  0xff800000u, 0xbf800000u, 0x7149f2cau, 0xf149f2cau, 0x7ff00000u};
  for (const Asset& asset : {alone(testing::cube_mesh()),
                             alone(testing::joined(testing::torus_mesh(1, 0.4, 8, 5),
                                                   testing::box_mesh({3, 3, 3}, {4, 4, 4})))}) {
    std::size_t refused = 0, accepted = 0;
    for (std::size_t at = offsetof(AssetHeader, mesh_hash); at < asset.bytes().size(); at += 4)
      for (const std::uint32_t value : values) {
        AlignedBytes changed(asset.bytes());
        std::memcpy(&changed[at], &value, sizeof(value));
        changed.seal();
        if (changed.status() != AssetStatus::ok) {
          ++refused;
          continue;
        }
        ++accepted;
        SCOPED_TRACE("byte " + std::to_string(at) + " = " + std::to_string(value));
        walk_mesh(changed);
        if (HasFailure()) return;
      }
    EXPECT_GT(refused, 1000u);
    EXPECT_GT(accepted, 1000u);  // coordinates, boxes, and what the query does not read
  }
}

TEST(MeshBytes, EveryOffsetCountAndIndexIsLookedAt) {
  const Asset asset = alone(testing::torus_mesh(1, 0.4, 40, 20));
  const AssetHeader& header = asset.view().header();
  const MeshHeader& mesh = *at<MeshHeader>(header, header.mesh);
  const auto refused = [&](std::uint64_t offset, auto value) {
    AlignedBytes changed(asset.bytes());
    std::memcpy(&changed[offset], &value, sizeof(value));
    changed.seal();
    EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout) << offset << " " << value;
  };
  const auto changed = [&](std::uint64_t offset) {
    std::uint32_t value;
    std::memcpy(&value, asset.bytes().data() + offset, sizeof(value));
    for (const std::uint32_t change : {~0u, 1u, 16u, ~0u - 15}) refused(offset, value + change);
  };
  changed(offsetof(AssetHeader, mesh));
  for (const std::size_t field :
       {offsetof(MeshHeader, vertex_count), offsetof(MeshHeader, triangle_count),
        offsetof(MeshHeader, shell_count), offsetof(MeshHeader, neighbour_count),
        offsetof(MeshHeader, level_count), offsetof(MeshHeader, vertices),
        offsetof(MeshHeader, shells), offsetof(MeshHeader, neighbours)})
    changed(header.mesh + field);
  for (std::uint32_t k = 0; k < mesh.level_count; ++k)
    for (const std::size_t field : {offsetof(LevelHeader, blocks), offsetof(LevelHeader, count)})
      changed(header.mesh + offsetof(MeshHeader, level) + k * sizeof(LevelHeader) + field);
  const std::uint64_t block = mesh.level[0].blocks + sizeof(MeshBlock);
  for (const std::size_t field : {offsetof(MeshBlock, first_neighbour),
                                  offsetof(MeshBlock, neighbours), offsetof(MeshBlock, shell)})
    changed(block + field);
  for (const double value : {std::nan(""), 17.0, -1e300, double{HUGE_VAL}}) {
    refused(mesh.vertices + 8, value);
    refused(header.mesh + offsetof(MeshHeader, error), value);
    refused(header.mesh + offsetof(MeshHeader, rounding), value);
  }
  refused(offsetof(AssetHeader, self_overlap_volume), -1.0);
  for (const MeshState state : {MeshState::none, MeshState::unresolved, MeshState(5)})
    refused(offsetof(AssetHeader, mesh_state), static_cast<std::uint32_t>(state));
  refused(block, mesh.vertex_count);
  refused(block + offsetof(MeshBlock, corner), std::uint8_t{16});
  refused(block + offsetof(MeshBlock, triangles), std::uint8_t{0});
  refused(block + offsetof(MeshBlock, vertices), std::uint8_t{17});
  refused(mesh.neighbours, mesh.level[0].count * kWidth);  // no such block
  refused(mesh.neighbours, 0u);                            // itself
  refused(mesh.shells, 1u);                                // not its first block
  refused(mesh.level[1].blocks, 16.5f);
}

TEST(MeshBytes, AnAssetOfNothingIsNone) {
  const Asset asset = alone(testing::cube_mesh());
  AlignedBytes changed(asset.bytes());
  const std::uint64_t none = 0;
  std::memcpy(&changed[offsetof(AssetHeader, mesh)], &none, sizeof(none));
  changed.seal();
  EXPECT_EQ(changed.status(), AssetStatus::corrupt_layout);
}

}  // namespace
}  // namespace ist
