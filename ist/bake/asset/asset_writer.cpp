#include "bake/asset/asset_writer.h"

#include <ist/types.h>
#include <cstring>

#include "query/asset/content_hash.h"

namespace ist {
namespace {

class SectionWriter {
 public:
  explicit SectionWriter(std::vector<std::byte>& bytes) : bytes_(bytes) {}

  template <class T>
  void write(std::uint64_t offset, const std::vector<T>& values, std::uint64_t count) {
    if (values.size() != count) throw Error("asset: an array's length differs from its count");
    if (count > 0) std::memcpy(bytes_.data() + offset, values.data(), count * sizeof(T));
  }

  void write(const TreeHeader& header, const TreeArrays& tree) {
    const std::uint64_t lanes = std::uint64_t{kWidth} * header.level[0].count;
    write(header.sphere_index, tree.sphere_index, lanes);
    write(header.sphere_cover, tree.sphere_cover, header.sphere_cover != 0 ? lanes : 0);
    if (tree.levels.size() != header.level_count) throw Error("asset: wrong number of levels");
    for (std::size_t k = 0; k < tree.levels.size(); ++k) {
      const LevelHeader& level = header.level[k];
      write(level.blocks, tree.levels[k].blocks, level.count);
      write(level.origins, tree.levels[k].origins, level.count);
      write(level.nodes, tree.levels[k].nodes, k > 0 ? level.count : 0);
    }
  }

  void write(const MeshHeader& header, const MeshArrays& mesh) {
    write(header.vertices, mesh.vertices, std::uint64_t{3} * header.vertex_count);
    write(header.shells, mesh.shells, header.shell_count);
    write(header.neighbours, mesh.neighbours, header.neighbour_count);
    write(header.level[0].blocks, mesh.blocks, header.level[0].count);
    if (mesh.boxes.size() + 1 != header.level_count || mesh.sums.size() != mesh.boxes.size())
      throw Error("asset: the mesh has a wrong number of levels");
    for (std::uint32_t k = 1; k < header.level_count; ++k) {
      write(header.level[k].blocks, mesh.boxes[k - 1], header.level[k].count);
      write(header.level[k].nodes, mesh.sums[k - 1], header.level[k].count);
    }
  }

 private:
  std::vector<std::byte>& bytes_;
};

void fill_scalars(TreeHeader& header, const TreeArrays& tree) {
  std::memcpy(header.root, tree.root, sizeof(header.root));
  header.root_cover = tree.root_cover;
  header.volume_sum = tree.volume_sum;
  header.mean_radius = tree.mean_radius;
  header.overlap = tree.overlap;
}

std::uint32_t count_of_blocks(std::size_t blocks) {
  constexpr std::size_t kMostBlocks = std::size_t{1} << 4 * (kMaxLevels - 1);
  if (blocks < 1 || blocks > kMostBlocks)
    throw Error("asset: a mesh must hold at least one triangle and at most 16^6 blocks of them");
  return static_cast<std::uint32_t>(blocks);
}

/// The header of a mesh with the counts that place_sections needs.
MeshHeader placeable(const MeshArrays& arrays) {
  MeshHeader header = arrays.header;
  header.level[0].count = count_of_blocks(arrays.blocks.size());
  header.vertex_count = static_cast<std::uint32_t>(arrays.vertices.size() / 3);
  header.shell_count = static_cast<std::uint32_t>(arrays.shells.size());
  header.neighbour_count = static_cast<std::uint32_t>(arrays.neighbours.size());
  return header;
}

/// False if a mesh-only asset has spheres or data derived from them.
bool holds_enough(const AssetArrays& arrays) {
  const std::uint64_t spheres = arrays.inner_spheres.size();
  return spheres == 0 ? arrays.mesh != nullptr : spheres <= kMaxSpheres;
}

}  // namespace

std::vector<std::byte> asset_bytes(const AssetArrays& arrays) {
  AssetHeader header = arrays.header;
  header.sphere_count = arrays.inner_spheres.size();
  if (!holds_enough(arrays))
    throw Error("asset: it must hold at least one sphere and at most 16^7, or a mesh alone");
  if (arrays.details.size() > kMaxDetails) throw Error("asset: too many levels of detail");
  header.detail_count = static_cast<std::uint32_t>(arrays.details.size());
  if (header.detail_count > 0 && detail_spheres(header.sphere_count, header.detail_count) < 1)
    throw Error("asset: the last level of detail has no spheres");
  std::vector<DetailLevel> details(arrays.details.size());
  std::memcpy(header.magic, kAssetMagic, sizeof(kAssetMagic));
  MeshHeader mesh;
  if (arrays.mesh) mesh = placeable(*arrays.mesh);
  place_sections(header, details.data(), arrays.mesh ? &mesh : nullptr);
  fill_scalars(header.inner_tree, arrays.inner_tree);
  fill_scalars(header.matched_tree, arrays.matched_tree);
  for (std::size_t i = 0; i < details.size(); ++i) {
    details[i].protrusion = arrays.details[i].protrusion;
    fill_scalars(details[i].matched_tree, arrays.details[i].matched_tree);
  }

  std::vector<std::byte> bytes(header.file_bytes, std::byte{0});
  std::memcpy(bytes.data(), &header, sizeof(header));
  SectionWriter writer(bytes);
  writer.write(header.inner_spheres, arrays.inner_spheres, header.sphere_count);
  writer.write(header.cover_radii, arrays.cover_radii, header.sphere_count);
  writer.write(header.matched_spheres, arrays.matched_spheres, header.sphere_count);
  if (header.sphere_count > 0) {
    writer.write(header.inner_tree, arrays.inner_tree);
    writer.write(header.matched_tree, arrays.matched_tree);
  }
  writer.write(header.details, details, header.detail_count);
  for (std::size_t i = 0; i < details.size(); ++i) {
    const TreeHeader& tree = details[i].matched_tree;
    writer.write(details[i].matched_spheres, arrays.details[i].matched_spheres, tree.sphere_count);
    writer.write(tree, arrays.details[i].matched_tree);
  }
  if (arrays.mesh) {
    writer.write(header.mesh, std::vector<MeshHeader>{mesh}, 1);
    writer.write(mesh, *arrays.mesh);
  }
  seal(bytes);
  return bytes;
}

void seal(std::vector<std::byte>& bytes) {
  const std::uint64_t hash = content_hash(bytes);
  std::memcpy(bytes.data() + offsetof(AssetHeader, content_hash), &hash, sizeof(hash));
}

}  // namespace ist
