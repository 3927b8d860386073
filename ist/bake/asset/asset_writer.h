#pragma once

#include <ist/asset_layout.h>
#include <memory>
#include <vector>

namespace ist {

/// One level of a tree as stored in the file.
struct TreeLevelArrays {
  std::vector<BallBlock> blocks;
  std::vector<Origin> origins;
  std::vector<NodeBlock> nodes;  ///< empty at level 0
};

/// One tree as stored in the file (see asset_layout.h).
struct TreeArrays {
  std::vector<std::uint32_t> sphere_index;  ///< [16 · blocks of level 0]
  std::vector<float> sphere_cover;          ///< the same length; empty in the matched tree
  std::vector<TreeLevelArrays> levels;
  double root[4] = {};     ///< centre, radius; unit frame
  double root_cover = 0;   ///< unit frame
  double volume_sum = 0;   ///< unit frame
  double mean_radius = 0;  ///< unit frame
  float overlap = 1;       ///< κ
};

/// A coarser matched set.
struct DetailArrays {
  std::vector<Sphere> matched_spheres;
  double protrusion = 0;  ///< unit frame
  TreeArrays matched_tree;
};

/// The solid's mesh as stored in the file.
struct MeshArrays {
  MeshHeader header;             ///< error and rounding; the writer sets offsets and counts
  std::vector<double> vertices;  ///< [3 · vertices] unit frame
  std::vector<MeshShell> shells;
  std::vector<std::uint32_t> neighbours;
  std::vector<MeshBlock> blocks;
  std::vector<std::vector<BoxBlock>> boxes;  ///< from level 1 up
  std::vector<std::vector<BoxSums>> sums;    ///< of each level of boxes
};

struct AssetArrays {
  AssetHeader header;  ///< scalar fields; the writer sets offsets, counts, magic and hash
  std::vector<Sphere> inner_spheres;
  std::vector<float> cover_radii;       ///< the same length
  std::vector<Sphere> matched_spheres;  ///< the same length
  TreeArrays inner_tree;
  TreeArrays matched_tree;
  std::vector<DetailArrays> details;       ///< detail i (from 1) has ⌊n / 4^i⌋ spheres
  std::shared_ptr<const MeshArrays> mesh;  ///< null: none
};

/// The bytes of the asset. Throws Error unless the arrays' lengths are consistent.
std::vector<std::byte> asset_bytes(const AssetArrays& arrays);

/// Sets the content hash of bytes that contain at least a header.
void seal(std::vector<std::byte>& bytes);

}  // namespace ist
