#include "bake/field/surface_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <span>

#include "bake/cluster/ball_blocks.h"
#include "bake/field/spatial_order.h"
#include "bake/field/surface_patches.h"

namespace ist {
namespace {

/// A patch as a block.
SurfaceBlock block_of(const FieldMesh& mesh, const BlockPatch& patch) {
  SurfaceBlock block = {};
  block.triangles = static_cast<std::uint32_t>(patch.triangles.size());
  block.vertices = static_cast<std::uint32_t>(patch.vertices.size());
  for (std::size_t v = 0; v < kWidth; ++v) {
    const FieldMesh::Vertex& x = mesh.vertices[patch.vertices[v < patch.vertices.size() ? v : 0]];
    block.x[v] = x[0];
    block.y[v] = x[1];
    block.z[v] = x[2];
  }
  for (std::size_t i = 0; i < patch.triangles.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t vertex = mesh.triangles[patch.triangles[i]][k];
      block.corner[k][i] = static_cast<std::uint8_t>(
          std::find(patch.vertices.begin(), patch.vertices.end(), vertex) - patch.vertices.begin());
    }
  return block;
}

std::vector<SurfaceBlock> blocks_of(const FieldMesh& mesh) {
  const std::vector<BlockPatch> patches = cut_into_patches(mesh);
  std::vector<SurfaceBlock> blocks(patches.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(),
                    [&](std::size_t b) { blocks[b] = block_of(mesh, patches[b]); });
  return blocks;
}

Ball vertex_of(const SurfaceBlock& block, std::uint32_t v) {
  return {block.x[v], block.y[v], block.z[v], 0};
}

std::vector<SurfaceBlock> in_order(const std::vector<SurfaceBlock>& blocks) {
  std::vector<std::array<float, 3>> middles(blocks.size());
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    std::array<Ball, kWidth> vertices;
    for (std::uint32_t v = 0; v < blocks[b].vertices; ++v) vertices[v] = vertex_of(blocks[b], v);
    const Ball ball = bounding_ball(std::span(vertices).first(blocks[b].vertices));
    middles[b] = {static_cast<float>(ball.x), static_cast<float>(ball.y),
                  static_cast<float>(ball.z)};
  });
  const std::vector<std::uint32_t> order = spatial_order(middles);
  std::vector<SurfaceBlock> sorted(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) sorted[b] = blocks[order[b]];
  return sorted;
}

/// A ball around the triangles of consecutive blocks.
Sphere ball_around(std::span<const SurfaceBlock> blocks) {
  std::vector<Ball> vertices;
  for (const SurfaceBlock& block : blocks)
    for (std::uint32_t v = 0; v < block.vertices; ++v) vertices.push_back(vertex_of(block, v));
  return ball_around(vertices);
}

}  // namespace

void cut_into_blocks(const FieldMesh& mesh, FieldArrays& arrays) {
  arrays.blocks = in_order(blocks_of(mesh));
  const std::span<const SurfaceBlock> all = arrays.blocks;
  for (std::size_t span = 1; span < all.size(); span *= kWidth) {
    std::vector<Sphere> balls((all.size() + span - 1) / span);
    tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
      balls[i] = ball_around(all.subspan(i * span, std::min(span, all.size() - i * span)));
    });
    TreeLevelArrays& level = arrays.levels.emplace_back();
    fill_blocks(balls, level.blocks, level.origins);
  }
}

}  // namespace ist
