#include "bake/field/surface_blocks.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <span>

#include "bake/cluster/ball_blocks.h"
#include "bake/field/spatial_order.h"

namespace ist {
namespace {

std::array<float, 3> middle(const FieldMesh& mesh, const FieldMesh::Triangle& t) {
  std::array<float, 3> sum = {};
  for (const std::uint32_t v : t)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += mesh.vertices[v][k];
  return sum;
}

/// A block that takes triangles as long as there is room for them and their vertices.
class OpenBlock {
 public:
  explicit OpenBlock(const FieldMesh& mesh) : mesh_(&mesh) {}

  /// False: there is no room.
  bool take(const FieldMesh::Triangle& t) {
    if (block_.triangles == kWidth) return false;
    std::uint32_t vertices = block_.vertices;
    std::array<std::uint8_t, 3> corner = {};
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t at = 0;
      while (at < vertices && vertex_[at] != t[k]) ++at;
      if (at == kWidth) return false;
      if (at == vertices) vertex_[vertices++] = t[k];
      corner[k] = static_cast<std::uint8_t>(at);
    }
    for (std::size_t k = 0; k < 3; ++k) block_.corner[k][block_.triangles] = corner[k];
    ++block_.triangles;
    block_.vertices = vertices;
    return true;
  }

  SurfaceBlock closed() {
    for (std::uint32_t v = 0; v < kWidth; ++v) {
      const FieldMesh::Vertex& x = mesh_->vertices[vertex_[v < block_.vertices ? v : 0]];
      block_.x[v] = x[0];
      block_.y[v] = x[1];
      block_.z[v] = x[2];
    }
    return block_;
  }

 private:
  const FieldMesh* mesh_;
  SurfaceBlock block_ = {};
  std::array<std::uint32_t, kWidth> vertex_ = {};
};

/// Sixteen neighbours are a block, or more where they have too many vertices.
std::vector<SurfaceBlock> blocks_of(const FieldMesh& mesh) {
  std::vector<std::array<float, 3>> middles(mesh.triangles.size());
  tbb::parallel_for(std::size_t{0}, middles.size(),
                    [&](std::size_t i) { middles[i] = middle(mesh, mesh.triangles[i]); });
  const std::vector<std::uint32_t> order = spatial_order(middles);
  std::vector<SurfaceBlock> blocks;
  for (std::size_t begin = 0; begin < order.size(); begin += kWidth) {
    OpenBlock block(mesh);
    for (std::size_t i = begin; i < std::min<std::size_t>(begin + kWidth, order.size()); ++i) {
      const FieldMesh::Triangle& t = mesh.triangles[order[i]];
      if (block.take(t)) continue;
      blocks.push_back(block.closed());
      block = OpenBlock(mesh);
      block.take(t);
    }
    blocks.push_back(block.closed());
  }
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
