#include <algorithm>

#include "query/asset/mesh_parts.h"
#include "query/asset/valid_values.h"

namespace ist {
namespace {

constexpr float kEmptyLow = static_cast<float>(2 * kMaxExtent);

bool sound_block(const MeshBlock& block, std::uint32_t vertex_count) noexcept {
  if (block.triangles < 1 || block.triangles > kWidth) return false;
  if (block.vertices < 3 || block.vertices > kWidth) return false;
  bool sound = true;
  for (std::uint32_t v = 0; v < kWidth; ++v)
    sound &=
        v < block.vertices ? block.vertex[v] < vertex_count : block.vertex[v] == block.vertex[0];
  for (const auto& corners : block.corner)
    for (std::uint32_t l = 0; l < kWidth; ++l)
      sound &= l < block.triangles ? corners[l] < block.vertices : corners[l] == 0;
  return sound;
}

/// True if blocks are sound and in order: lists of neighbours are contiguous, shells ascend.
bool sound_blocks(const MeshParts& mesh) noexcept {
  std::uint64_t triangles = 0;
  std::uint32_t listed = 0, shells = 0;
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& block = mesh.blocks[b];
    if (!sound_block(block, mesh.header->vertex_count)) return false;
    if (block.first_neighbour != listed || block.neighbours > mesh.header->neighbour_count - listed)
      return false;
    if (block.shell == shells && shells < mesh.header->shell_count &&
        mesh.shells[shells].block == b)
      ++shells;
    if (block.shell >= shells) return false;
    listed += block.neighbours;
    triangles += block.triangles;
  }
  return triangles == mesh.header->triangle_count && listed == mesh.header->neighbour_count &&
         shells == mesh.header->shell_count;
}

bool has_vertex(const MeshBlock& block, std::uint32_t vertex) noexcept {
  return std::find(block.vertex, block.vertex + kWidth, vertex) != block.vertex + kWidth;
}

/// True if the sorted list of neighbours contains the block.
bool names(const MeshParts& mesh, const MeshBlock& from, std::uint32_t block) noexcept {
  const std::uint32_t* first = mesh.neighbours + from.first_neighbour;
  const std::uint32_t* end = first + from.neighbours;
  const std::uint32_t* found = std::lower_bound(first, end, block * kWidth);
  return found != end && *found / kWidth == block;
}

/// True if lists are sorted and name other blocks of the shell, once each, and shared vertices.
bool sound_lists(const MeshParts& mesh) noexcept {
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& block = mesh.blocks[b];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t* entry = mesh.neighbours + block.first_neighbour + k;
      const std::uint32_t other = *entry / kWidth, place = *entry % kWidth;
      if (other >= mesh.count || other == b || place >= block.vertices) return false;
      if (k > 0 && entry[-1] / kWidth >= other) return false;
      if (mesh.blocks[other].shell != block.shell ||
          !has_vertex(mesh.blocks[other], block.vertex[place]))
        return false;
    }
  }
  return true;
}

bool sound_neighbours(const MeshParts& mesh) noexcept {
  if (!sound_lists(mesh)) return false;
  for (std::uint32_t b = 0; b < mesh.count; ++b)
    for (std::uint32_t k = 0; k < mesh.blocks[b].neighbours; ++k) {
      const std::uint32_t other = mesh.neighbours[mesh.blocks[b].first_neighbour + k] / kWidth;
      if (!names(mesh, mesh.blocks[other], b)) return false;
    }
  return true;
}

/// True if boxes and sums are in range, and unused lanes are empty.
bool sound_nodes(const AssetHeader& asset, const MeshHeader& mesh) noexcept {
  constexpr double kFarthest = 4 * kMaxExtent;  // along a normal
  bool sound = true;
  for (std::uint32_t level = 1; level < mesh.level_count; ++level) {
    const std::uint32_t used = mesh.level[level - 1].count;
    for (std::uint64_t i = 0; i < std::uint64_t{kWidth} * mesh.level[level].count; ++i) {
      const BoxBlock& box = at<BoxBlock>(asset, mesh.level[level].blocks)[i / kWidth];
      const BoxSums& sums = at<BoxSums>(asset, mesh.level[level].nodes)[i / kWidth];
      const std::size_t lane = i % kWidth;
      const double most = i < used ? 1e18 : 0;  // the largest sum
      sound &= in_range(box.slab_low[lane], -kFarthest, kFarthest) &&
               in_range(box.slab_high[lane], -kFarthest, kFarthest) &&
               in_range(sums.area[lane], 0, most);
      for (int k = 0; k < 3; ++k) {
        const float low = box.low[k][lane], high = box.high[k][lane], normal = box.normal[k][lane];
        sound &= i < used
                     ? is_offset(low) && is_offset(high) && low <= high && in_range(normal, -2, 2)
                     : low == kEmptyLow && high == -kEmptyLow && normal == 0;
        sound &= in_range(sums.normal[k][lane], -most, most) &&
                 in_range(sums.cone[k][lane], -most, most);
        for (const auto& flux : sums.flux[k]) sound &= in_range(flux[lane], -most, most);
      }
    }
  }
  return sound;
}

bool sound_vertices(const MeshParts& mesh) noexcept {
  bool sound = true;
  for (std::uint64_t i = 0; i < std::uint64_t{3} * mesh.header->vertex_count; ++i)
    sound &= is_offset(mesh.vertices[i]);
  return sound;
}

}  // namespace

bool sound_mesh_counts(const MeshHeader& mesh) noexcept {
  return mesh.level[0].count >= 1 && mesh.level[0].count <= kMostBlocks;
}

bool sound_mesh(const AssetHeader& header, const MeshHeader& mesh) noexcept {
  const MeshParts parts(header, mesh);
  return is_radius(mesh.error) && is_radius(mesh.rounding) && sound_vertices(parts) &&
         sound_blocks(parts) && sound_neighbours(parts) && sound_nodes(header, mesh);
}

}  // namespace ist
