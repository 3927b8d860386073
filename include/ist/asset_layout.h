#pragma once

// The .ist asset: one little-endian, offset-only, 64-byte-aligned block. The file, the mapped
// memory and the device buffer are the same bytes. Offsets count bytes from the start of the file
// and are multiples of 64; 0 means the array is absent. Unused bytes are zero.
//
//   AssetHeader                       1152 B
//   details                           DetailLevel[d]
//   inner spheres                     Sphere[n]   centre and radius, insertion (greedy) order
//   cover radii                       float[n]    the solid lies in ∪ B(inner centre, cover)
//   matched spheres                   Sphere[n]   centre and radius of the matched set, same order
//   inner tree                        as below
//   matched tree                      as below, without sphere covers
//   for each detail i = 1 … d, of m = ⌊n / 4^i⌋ spheres
//     matched spheres                 Sphere[m]   the matched set of the first m inner spheres
//     matched tree                    as below, without sphere covers
//   mesh, if there is one             as below
//
// An asset without spheres, n = d = 0, has no trees, but a mesh.
//
// The matched set of all n inner spheres is detail 0 and stands in AssetHeader. Under
// PenetrationSettings::pair_budget a query may answer from the coarser ones instead.
//
// A tree, with m(k) = ⌈n / 16^(k+1)⌉ blocks at level k, up to the first level of one block:
//
//   sphere index                      uint32[16 m(0)]   insertion index of a lane; 0 if unused
//   sphere covers                     float[16 m(0)]    cover radius of a lane (inner tree only)
//   level 0                           BallBlock[m(0)], Origin[m(0)]
//   level k ≥ 1                       BallBlock[m(k)], Origin[m(k)], NodeBlock[m(k)]
//
// A tree is implicit and kWidth wide. Level 0 holds the spheres, sixteen to a block; lane l of
// block b at level k + 1 is a ball around the spheres below block 16 b + l of level k. Every block
// but the last of each level is full. Sections follow each other in this order without a gap but
// the padding to 64 bytes, so that n and d alone give every offset (place_sections).
//
// The mesh, the solid's boundary, for Measure::exact:
//
//   MeshHeader
//   vertices                          double[3 · vertex_count]   x, y, z of each, unit frame
//   shells                            MeshShell[shell_count]
//   neighbours                        uint32[neighbour_count]   16 · block + local vertex
//   level 0                           MeshBlock[m(0)]
//   level k ≥ 1                       BoxBlock[m(k)], BoxSums[m(k)]   boxes around the blocks
//                                     below and integrals over their surfaces; at least one level
//
// Centres of spheres and balls are floats of the unit frame. A block's origin is chosen so that the
// difference of every centre in it and the origin is a float too: origin + offset is the centre
// exactly, and the leaf spheres are the spheres of the table bit for bit.

#include <cstddef>
#include <cstdint>

#include <ist/types.h>

namespace IST_API ist {

inline constexpr std::uint32_t kFormatMajor = 0;
inline constexpr std::uint32_t kFormatMinor = 6;
inline constexpr char kAssetMagic[8] = {'I', 'S', 'T', 'R', 'E', 'E', '\r', '\n'};
inline constexpr std::size_t kAssetAlignment = 64;
inline constexpr std::uint32_t kWidth = 16;       ///< balls in a block
inline constexpr std::uint32_t kMaxLevels = 7;    ///< 16^7 spheres
inline constexpr std::uint32_t kMaxDetails = 10;  ///< coarser matched sets of an asset
/// Classes of overlap of predicted errors.
inline constexpr std::uint32_t kOverlapClasses = 5;
/// Lowest overlap of a class, as a share of the smaller solid's volume: 1 = contained, then from ½
/// down.
inline constexpr double kOverlapClassFloor[kOverlapClasses] = {1, 1e-1, 1e-2, 1e-3, 1e-4};
/// Radius and cover radius of an unused lane: it overlaps nothing at any distance.
inline constexpr float kEmptyRadius = -1e30f;
/// No coordinate, offset or radius of a checked asset is larger than this, unit frame.
inline constexpr double kMaxExtent = 16;
/// Volumes [u³] stay finite: |exponent of the frame| is at most this.
inline constexpr std::int32_t kMaxExponent = 300;

static_assert(sizeof(Sphere) == 16);

/// Sixteen balls, structure of arrays. Centres are relative to the block's Origin, so that a small
/// block keeps all digits of its floats.
struct alignas(64) BallBlock {
  float x[kWidth], y[kWidth], z[kWidth];  ///< unit frame, relative to the block's origin
  float r[kWidth];  ///< radius; rounded up above level 0; kEmptyRadius if unused
};
static_assert(sizeof(BallBlock) == 256);

struct Origin {
  double x = 0, y = 0, z = 0;  ///< unit frame
};
static_assert(sizeof(Origin) == 24);

/// Sums of the spheres below a node; one NodeBlock per BallBlock of level ≥ 1.
struct alignas(64) NodeBlock {
  float volume[kWidth];  ///< Σ of the tree's sphere volumes, unit frame, rounded up; 0 if unused
  /// Inner tree: radius about the ball's centre that contains every cover ball below; kEmptyRadius
  /// if unused. Matched tree: 0.
  float cover[kWidth];
  /// κ: no point lies inside more than this many of the tree's spheres below; 0 if unused.
  float overlap[kWidth];
};
static_assert(sizeof(NodeBlock) == 192);

struct LevelHeader {
  std::uint64_t blocks = 0;   ///< offset of BallBlock[count]
  std::uint64_t origins = 0;  ///< offset of Origin[count]
  std::uint64_t nodes = 0;    ///< offset of NodeBlock[count]; 0 at level 0
  std::uint32_t count = 0;    ///< blocks at this level
  std::uint32_t reserved = 0;
};
static_assert(sizeof(LevelHeader) == 32);

/// One set of spheres as a tree.
struct TreeHeader {
  std::uint64_t sphere_index =
      0;  ///< offset of uint32[16 · level[0].count]: insertion index of a lane
  std::uint64_t sphere_cover =
      0;  ///< offset of float[16 · level[0].count]: cover radii; 0 in the matched tree
  std::uint32_t sphere_count = 0;
  std::uint32_t level_count = 0;  ///< ≥ 1
  double root[4] = {};            ///< bounding ball of all spheres: centre, radius; unit frame
  double root_cover = 0;          ///< as NodeBlock::cover, about the root's centre
  double volume_sum = 0;          ///< Σ of sphere volumes in insertion order, unit frame
  double mean_radius = 0;         ///< of the ball of the mean sphere volume, unit frame
  float overlap = 1;              ///< κ of the whole tree
  std::uint32_t reserved = 0;
  LevelHeader level[kMaxLevels];
};
static_assert(sizeof(TreeHeader) == 312);

/// A matched set of fewer spheres: a prefix of the greedy order, calibrated by itself.
struct DetailLevel {
  std::uint64_t matched_spheres = 0;  ///< offset of Sphere[matched_tree.sphere_count]
  double protrusion = 0;              ///< as AssetHeader::protrusion
  TreeHeader matched_tree;
};
static_assert(sizeof(DetailLevel) == 328);

/// Up to sixteen triangles of the mesh over up to sixteen of its vertices.
///
/// A block's triangles are connected by shared vertices.
struct alignas(64) MeshBlock {
  std::uint32_t vertex[kWidth];    ///< index into the mesh's vertices; unused ones repeat the first
  std::uint8_t corner[3][kWidth];  ///< place in `vertex` of a triangle's corners, counter-clockwise
                                   ///< from outside; 0 if unused
  std::uint8_t triangles = 0;      ///< 1 … 16
  std::uint8_t vertices = 0;       ///< 3 … 16
  std::uint16_t reserved = 0;
  std::uint32_t first_neighbour = 0;  ///< index into `neighbours` of the first block that shares a
                                      ///< vertex
  std::uint32_t neighbours = 0;       ///< count: one entry per block, by number
  std::uint32_t shell = 0;
};
static_assert(sizeof(MeshBlock) == 128);

/// Boxes and slabs around sixteen blocks of the level below, rounded outward. An unused one is
/// empty: low = +kMaxExtent · 2, high = −kMaxExtent · 2, and its normal is zero.
struct alignas(64) BoxBlock {
  float low[3][kWidth], high[3][kWidth];      ///< unit frame
  float normal[3][kWidth];                    ///< about unit length, about the mean normal
  float slab_low[kWidth], slab_high[kWidth];  ///< slab_low ≤ normal · x ≤ slab_high below
};
static_assert(sizeof(BoxBlock) == 704);

/// Integrals over the triangles below each lane of a BoxBlock, n outward, y from the middle of the
/// lane's box, (low + high) / 2. Unused lanes are zero.
struct alignas(64) BoxSums {
  double normal[3][kWidth];   ///< ∫ n dA
  double flux[3][3][kWidth];  ///< [i][k]: ∫ yᵢ nₖ dA
  double cone[3][kWidth];     ///< ∫ y (y · n) dA
  double area[kWidth];        ///< ∫ dA, rounded up
};
static_assert(sizeof(BoxSums) == 2048);

/// Triangles that are connected by shared vertices.
struct MeshShell {
  std::uint32_t block = 0;  ///< its first block
};
static_assert(sizeof(MeshShell) == 4);

/// The solid's boundary: closed, oriented, with winding numbers of 0 and 1 only,
/// except for touching faces.
struct MeshHeader {
  /// Unit frame: bound on the distance of the mesh from the solid's boundary. 0 except for a mesh
  /// that was made from a signed distance (kFlagPolygonised).
  double error = 0;
  /// Unit frame: bound on the displacement of a vertex by rounding.
  double rounding = 0;
  std::uint32_t vertex_count = 0;
  std::uint32_t triangle_count = 0;
  std::uint32_t shell_count = 0;
  std::uint32_t neighbour_count = 0;
  std::uint32_t level_count = 0;  ///< ≥ 2; the last has one block
  std::uint32_t reserved = 0;
  std::uint64_t vertices = 0;     ///< offset of double[3 · vertex_count]
  std::uint64_t shells = 0;       ///< offset of MeshShell[shell_count]
  std::uint64_t neighbours = 0;   ///< offset of uint32[neighbour_count]: 16 · block + the place of
                                  ///< a shared vertex in this block
  LevelHeader level[kMaxLevels];  ///< level 0: MeshBlock; above: BoxBlock, `nodes`: BoxSums
};
static_assert(sizeof(MeshHeader) == 288);

struct alignas(64) AssetHeader {
  char magic[8] = {};
  std::uint32_t format_major = kFormatMajor;
  std::uint32_t format_minor = kFormatMinor;
  std::uint64_t file_bytes = 0;
  std::uint64_t content_hash = 0;  ///< XXH3-64 of all bytes of the file with this field zero
  std::uint64_t mesh_hash = 0;     ///< XXH3-64 of the solid's welded, oriented mesh
  std::uint64_t sphere_count = 0;

  // Frame: x_mesh = x_unit · 2^exponent + centre.
  double centre[3] = {};  ///< [u]
  std::int32_t exponent = 0;
  std::uint32_t flags = 0;  ///< kFlag…
  double volume = 0;        ///< unit frame, of the solid
  double volume_error = 0;  ///< unit frame, bound on the error of `volume`
  double coverage = 0;      ///< [0, 1] by inner spheres
  double protrusion = 0;    ///< unit frame: bound on how far matched spheres stick out

  // Requested settings, so that a cache can decide whether to bake again.
  std::uint64_t asked_spheres = 0;
  double asked_coverage = 0;
  double asked_min_radius = 0;  ///< [u]
  double asked_epsilon = 0;
  std::uint64_t asked_seed = 0;
  std::uint32_t asked_grid = 0;
  std::uint32_t asked_grid_start = 0;  ///< GridSettings, as are the next three
  std::uint32_t asked_grid_resolution = 0;
  std::int32_t asked_grid_refinements = 0;
  std::uint32_t asked_grid_rounds = 0;
  std::uint32_t stop_reason = 0;

  std::uint64_t inner_spheres = 0;    ///< offset of Sphere[sphere_count]
  std::uint64_t cover_radii = 0;      ///< offset of float[sphere_count]
  std::uint64_t matched_spheres = 0;  ///< offset of Sphere[sphere_count]
  std::uint64_t details = 0;          ///< offset of DetailLevel[detail_count]
  std::uint32_t detail_count = 0;     ///< coarser matched sets, ≤ kMaxDetails
  std::uint32_t predicted_poses = 0;  ///< of predicted_error; 0: no prediction
  /// Median relative error of the volume in each class of overlap, of two copies of the solid.
  double predicted_error[kOverlapClasses] = {};
  double asked_error = 0;       ///< requested relative error; 0: none
  double asked_at_overlap = 0;  ///< part of the solid's volume for which it was requested
  TreeHeader inner_tree;
  TreeHeader matched_tree;

  double kept_ratio_worst = 0;   ///< SpherePacking's: inserted radius over the largest live bound
  double kept_ratio_median = 0;  ///< likewise

  double measured_error = 0;         ///< median near asked_at_overlap, of the worst partner
  std::uint32_t measured_poses = 0;  ///< of all partners; 0: nothing was measured
  std::uint32_t search_stop = 0;     ///< StopReason of the search for the target

  /// Unit frame, proven: the mesh in the solid's place and the solid lie within it
  /// (kFlagPolygonised).
  double polygonise_error = 0;
  std::uint32_t polygonise_cells = 0;  ///< along the longest side; 0: the solid is a mesh
  std::uint32_t worst_partner = 0;     ///< TrialPartner behind measured_error

  // The solid at density 1, and its bounds (<ist/mass_properties.h>).
  double centre_of_mass[3] = {};    ///< unit frame
  double centre_of_mass_error = 0;  ///< unit frame, bound on the error of each component
  /// Unit frame, about the centre of mass: entries xx, yy, zz, xy, xz, yz of ∫ (|y|² 1 − y yᵀ).
  double inertia[6] = {};
  double inertia_error = 0;    ///< unit frame, bound on the error of each entry
  double box_lower[3] = {};    ///< [u] no point of the solid lies outside the box
  double box_upper[3] = {};    ///< [u]
  double ball_centre[3] = {};  ///< [u] inside the box
  double ball_radius = 0;      ///< [u] no point of the solid is further from ball_centre

  std::uint64_t mesh = 0;        ///< offset of MeshHeader; 0: baked without one
  std::uint32_t mesh_state = 0;  ///< MeshState
  std::uint32_t reserved_mesh = 0;
  double self_overlap_volume = 0;  ///< unit frame: ∫ (w − 1)⁺ of the input mesh
};
static_assert(sizeof(AssetHeader) == 1152);

inline constexpr std::uint32_t kFlagRepaired = 1u << 0;    ///< the mesh was open and repaired
inline constexpr std::uint32_t kFlagBelowNoise = 1u << 1;  ///< greedy order ends under float noise
/// The solid is known by its signed distance, and the mesh was made from it with polygonise_cells.
/// Inner spheres and covers are the solid's, volumes and matched spheres the mesh's.
inline constexpr std::uint32_t kFlagPolygonised = 1u << 2;
inline constexpr std::uint32_t kFlagWrapped = 1u << 3;  ///< the mesh was made by wrap_mesh()

namespace detail {

/// Takes the next section of `count` values and returns its offset.
template <class T>
constexpr std::uint64_t take(std::uint64_t& end, std::uint64_t count) noexcept {
  const std::uint64_t offset = end;
  end += (count * sizeof(T) + kAssetAlignment - 1) / kAssetAlignment * kAssetAlignment;
  return offset;
}

constexpr void place_tree(TreeHeader& tree, bool with_covers, std::uint64_t& end) noexcept {
  std::uint32_t count = (tree.sphere_count + kWidth - 1) / kWidth;
  tree.sphere_index = take<std::uint32_t>(end, std::uint64_t{kWidth} * count);
  tree.sphere_cover = with_covers ? take<float>(end, std::uint64_t{kWidth} * count) : 0;
  tree.level_count = 0;
  for (;; count = (count + kWidth - 1) / kWidth) {
    LevelHeader& level = tree.level[tree.level_count];
    level.count = count;
    level.blocks = take<BallBlock>(end, count);
    level.origins = take<Origin>(end, count);
    level.nodes = tree.level_count > 0 ? take<NodeBlock>(end, count) : 0;
    ++tree.level_count;
    if (count == 1) return;
  }
}

constexpr void place_mesh(MeshHeader& mesh, std::uint64_t& end) noexcept {
  mesh.vertices = take<double>(end, std::uint64_t{3} * mesh.vertex_count);
  mesh.shells = take<MeshShell>(end, mesh.shell_count);
  mesh.neighbours = take<std::uint32_t>(end, mesh.neighbour_count);
  std::uint32_t count = mesh.level[0].count;
  mesh.level[0].blocks = take<MeshBlock>(end, count);
  mesh.level_count = 1;
  do {
    count = (count + kWidth - 1) / kWidth;
    LevelHeader& level = mesh.level[mesh.level_count++];
    level.count = count;
    level.blocks = take<BoxBlock>(end, count);
    level.nodes = take<BoxSums>(end, count);
  } while (count > 1);
}

}  // namespace detail

/// Largest number of spheres of an asset: kMaxLevels levels.
inline constexpr std::uint64_t kMaxSpheres = std::uint64_t{1} << (4 * kMaxLevels);

/// Spheres of detail i of an asset of n spheres.
constexpr std::uint64_t detail_spheres(std::uint64_t n, std::uint32_t i) noexcept {
  return n >> (2 * i);
}

/// Sets every offset, count and the file size from `sphere_count` in [0, kMaxSpheres] and
/// `detail_count`, whose sets must each have a sphere; `details` are those of the file. `mesh`, if
/// any, must have its counts: those of vertices, shells, neighbours and level[0].count.
constexpr void place_sections(AssetHeader& header, DetailLevel* details,
                              MeshHeader* mesh = nullptr) noexcept {
  const std::uint64_t n = header.sphere_count;
  std::uint64_t end = sizeof(AssetHeader);
  header.details =
      header.detail_count > 0 ? detail::take<DetailLevel>(end, header.detail_count) : 0;
  header.inner_spheres = detail::take<Sphere>(end, n);
  header.cover_radii = detail::take<float>(end, n);
  header.matched_spheres = detail::take<Sphere>(end, n);
  header.inner_tree.sphere_count = header.matched_tree.sphere_count = static_cast<std::uint32_t>(n);
  if (n > 0) detail::place_tree(header.inner_tree, true, end);
  if (n > 0) detail::place_tree(header.matched_tree, false, end);
  for (std::uint32_t i = 0; i < header.detail_count; ++i) {
    const std::uint64_t m = detail_spheres(n, i + 1);
    details[i].matched_spheres = detail::take<Sphere>(end, m);
    details[i].matched_tree.sphere_count = static_cast<std::uint32_t>(m);
    detail::place_tree(details[i].matched_tree, false, end);
  }
  header.mesh = mesh != nullptr ? detail::take<MeshHeader>(end, 1) : 0;
  if (mesh != nullptr) detail::place_mesh(*mesh, end);
  header.file_bytes = end;
}

template <class T>
const T* at(const AssetHeader& header, std::uint64_t offset) noexcept {
  return reinterpret_cast<const T*>(reinterpret_cast<const std::byte*>(&header) + offset);
}

/// The matched tree of a detail in [0, detail_count], 0 the finest.
inline const TreeHeader& matched_tree(const AssetHeader& asset, std::uint32_t detail) noexcept {
  return detail == 0 ? asset.matched_tree
                     : at<DetailLevel>(asset, asset.details)[detail - 1].matched_tree;
}

inline const Sphere* matched_spheres(const AssetHeader& asset, std::uint32_t detail) noexcept {
  return at<Sphere>(asset, detail == 0
                               ? asset.matched_spheres
                               : at<DetailLevel>(asset, asset.details)[detail - 1].matched_spheres);
}

}  // namespace ist
