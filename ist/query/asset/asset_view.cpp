#include <ist/asset.h>

#include <cmath>
#include <cstring>

#include <ist/asset_layout.h>
#include "query/asset/content_hash.h"
#include "query/asset/valid_values.h"

namespace ist {
namespace {

bool is_finite_sum(double value) noexcept { return in_range(value, 0, 1e18); }

bool sound_nodes(const NodeBlock& nodes, std::uint64_t used, bool covers) noexcept {
  bool sound = true;
  for (std::uint32_t l = 0; l < kWidth; ++l) {
    if (l < used)
      sound &= is_finite_sum(nodes.volume[l]) && is_radius(nodes.cover[l]) &&
               in_range(nodes.overlap[l], 1, kMaxSpheres);
    else
      sound &= nodes.volume[l] == 0 && nodes.cover[l] == (covers ? kEmptyRadius : 0.0f) &&
               nodes.overlap[l] == 0;
  }
  return sound;
}

bool sound_spheres(const AssetHeader& header, std::uint64_t offset, std::uint64_t count) noexcept {
  const Sphere* spheres = at<Sphere>(header, offset);
  bool sound = true;
  for (std::uint64_t i = 0; i < count; ++i)
    sound &= is_offset(spheres[i].x) && is_offset(spheres[i].y) && is_offset(spheres[i].z) &&
             is_radius(spheres[i].r);
  return sound;
}

bool sound_tree(const AssetHeader& header, const TreeHeader& tree) noexcept {
  const bool covers = tree.sphere_cover != 0;
  bool sound = is_offset(tree.root[0]) && is_offset(tree.root[1]) && is_offset(tree.root[2]) &&
               is_radius(tree.root[3]) && is_radius(tree.root_cover) &&
               is_finite_sum(tree.volume_sum) && is_radius(tree.mean_radius) &&
               in_range(tree.overlap, 1, kMaxSpheres);

  const std::uint32_t* index = at<std::uint32_t>(header, tree.sphere_index);
  const std::uint64_t lanes = std::uint64_t{kWidth} * tree.level[0].count;
  for (std::uint64_t i = 0; i < lanes; ++i)
    sound &= i < tree.sphere_count ? index[i] < tree.sphere_count : index[i] == 0;
  if (covers) {
    const float* cover = at<float>(header, tree.sphere_cover);
    for (std::uint64_t i = 0; i < lanes; ++i)
      sound &= i < tree.sphere_count ? is_radius(cover[i]) : cover[i] == kEmptyRadius;
  }

  std::uint64_t below = tree.sphere_count;  // the number of balls in the lanes of this level
  for (std::uint32_t k = 0; k < tree.level_count && sound; ++k) {
    const LevelHeader& level = tree.level[k];
    const BallBlock* blocks = at<BallBlock>(header, level.blocks);
    const Origin* origins = at<Origin>(header, level.origins);
    for (std::uint32_t b = 0; b < level.count; ++b) {
      const std::uint64_t used = below - std::uint64_t{kWidth} * b;
      sound &= sound_block(blocks[b], used);
      sound &= sound_origin(origins[b]);
      if (k > 0) sound &= sound_nodes(at<NodeBlock>(header, level.nodes)[b], used, covers);
    }
    below = level.count;
  }
  return sound;
}

bool same_levels(const LevelHeader (&a)[kMaxLevels], const LevelHeader (&b)[kMaxLevels]) noexcept {
  return std::memcmp(a, b, sizeof(a)) == 0;
}

/// True if the mesh's sections are where place_sections() puts them. Adds them to `expected`.
bool sound_mesh_sections(const AssetHeader& header, AssetHeader& expected,
                         DetailLevel* details) noexcept {
  if (header.mesh != expected.file_bytes ||
      header.file_bytes < expected.file_bytes + sizeof(MeshHeader))
    return false;
  const MeshHeader& found = *at<MeshHeader>(header, header.mesh);
  if (!sound_mesh_counts(found)) return false;
  MeshHeader mesh;
  mesh.vertex_count = found.vertex_count;
  mesh.shell_count = found.shell_count;
  mesh.neighbour_count = found.neighbour_count;
  mesh.level[0].count = found.level[0].count;
  place_sections(expected, details, &mesh);
  return mesh.level_count == found.level_count && same_levels(mesh.level, found.level) &&
         mesh.vertices == found.vertices && mesh.shells == found.shells &&
         mesh.neighbours == found.neighbours;
}

/// True if the counts are those of an asset with spheres, or of a mesh alone.
bool sound_counts(const AssetHeader& header) noexcept {
  if (header.sphere_count == 0) return header.mesh != 0 && header.detail_count == 0;
  return header.sphere_count <= kMaxSpheres && header.detail_count <= kMaxDetails &&
         detail_spheres(header.sphere_count, header.detail_count) >= 1;
}

/// True if offsets and counts follow from the counts of spheres, levels of detail and the mesh.
bool sound_sections(const AssetHeader& header, std::size_t bytes) noexcept {
  if (!sound_counts(header)) return false;
  AssetHeader expected;
  DetailLevel details[kMaxDetails];
  expected.sphere_count = header.sphere_count;
  expected.detail_count = header.detail_count;
  place_sections(expected, details);
  const auto same_tree = [](const TreeHeader& a, const TreeHeader& b) {
    return a.sphere_index == b.sphere_index && a.sphere_cover == b.sphere_cover &&
           a.sphere_count == b.sphere_count && a.level_count == b.level_count &&
           same_levels(a.level, b.level);
  };
  if (header.mesh != 0 && !sound_mesh_sections(header, expected, details)) return false;
  if (expected.file_bytes != bytes || expected.details != header.details) return false;
  const DetailLevel* const found = at<DetailLevel>(header, header.details);
  for (std::uint32_t i = 0; i < header.detail_count; ++i)
    if (details[i].matched_spheres != found[i].matched_spheres ||
        !same_tree(details[i].matched_tree, found[i].matched_tree))
      return false;
  return expected.inner_spheres == header.inner_spheres &&
         expected.cover_radii == header.cover_radii &&
         expected.matched_spheres == header.matched_spheres &&
         same_tree(expected.inner_tree, header.inner_tree) &&
         same_tree(expected.matched_tree, header.matched_tree);
}

bool sound_state(const AssetHeader& header) noexcept {
  const auto state = static_cast<MeshState>(header.mesh_state);
  if (header.mesh == 0) return state == MeshState::none || state == MeshState::unresolved;
  return state == MeshState::own || state == MeshState::resolved || state == MeshState::polygonised;
}

bool sound_values(const AssetHeader& header) noexcept {
  for (const double c : header.centre)
    if (!std::isfinite(c)) return false;
  if (!in_range(header.exponent, -kMaxExponent, kMaxExponent)) return false;
  if (!is_finite_sum(header.volume) || !is_finite_sum(header.volume_error) ||
      !in_range(header.coverage, 0, 1) || !is_radius(header.protrusion))
    return false;
  if (!sound_mass(header)) return false;
  const float* covers = at<float>(header, header.cover_radii);
  for (std::uint64_t i = 0; i < header.sphere_count; ++i)
    if (!is_radius(covers[i])) return false;
  for (const double error : header.predicted_error)
    if (!is_finite_sum(error)) return false;
  if (!is_finite_sum(header.measured_error) || header.worst_partner >= kTrialPartners) return false;
  if (!is_finite_sum(header.self_overlap_volume) || !sound_state(header)) return false;
  if (header.mesh != 0 && !sound_mesh(header, *at<MeshHeader>(header, header.mesh))) return false;
  const DetailLevel* const details = at<DetailLevel>(header, header.details);
  for (std::uint32_t i = 0; i < header.detail_count; ++i) {
    const TreeHeader& tree = details[i].matched_tree;
    if (!is_radius(details[i].protrusion) || !sound_tree(header, tree) ||
        !sound_spheres(header, details[i].matched_spheres, tree.sphere_count))
      return false;
  }
  if (header.sphere_count == 0) return true;
  return sound_spheres(header, header.inner_spheres, header.sphere_count) &&
         sound_spheres(header, header.matched_spheres, header.sphere_count) &&
         sound_tree(header, header.inner_tree) && sound_tree(header, header.matched_tree);
}

}  // namespace

constinit const AssetHeader detail::kEmptyAsset;

AssetStatus AssetView::from_bytes(std::span<const std::byte> bytes, AssetView& out) noexcept {
  out = AssetView();
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % kAssetAlignment != 0)
    return AssetStatus::misaligned;
  if (bytes.size() < sizeof(kAssetMagic)) return AssetStatus::too_short;
  if (std::memcmp(bytes.data(), kAssetMagic, sizeof(kAssetMagic)) != 0)
    return AssetStatus::not_an_asset;
  if (bytes.size() < sizeof(AssetHeader)) return AssetStatus::too_short;
  const auto* header = reinterpret_cast<const AssetHeader*>(bytes.data());
  if (header->format_major != kFormatMajor || header->format_minor != kFormatMinor)
    return AssetStatus::other_version;
  if (bytes.size() < header->file_bytes) return AssetStatus::too_short;
  if (bytes.size() > header->file_bytes) return AssetStatus::corrupt_layout;
  if (content_hash(bytes) != header->content_hash) return AssetStatus::corrupt_hash;
  if (!sound_sections(*header, bytes.size()) || !sound_values(*header))
    return AssetStatus::corrupt_layout;
  out.header_ = header;
  return AssetStatus::ok;
}

std::size_t AssetView::sphere_count() const noexcept {
  return static_cast<std::size_t>(header().sphere_count);
}
double AssetView::volume() const noexcept {
  return std::ldexp(header().volume, 3 * header().exponent);
}
double AssetView::coverage() const noexcept { return header().coverage; }
double AssetView::protrusion() const noexcept {
  return std::ldexp(header().protrusion, header().exponent);
}
bool AssetView::has_mesh() const noexcept { return header().mesh != 0; }
std::uint32_t AssetView::mesh_triangles() const noexcept {
  return has_mesh() ? at<MeshHeader>(*header_, header_->mesh)->triangle_count : 0;
}
double AssetView::mesh_error() const noexcept {
  if (!has_mesh()) return 0;
  const MeshHeader& mesh = *at<MeshHeader>(*header_, header_->mesh);
  return std::ldexp(mesh.error + mesh.rounding, header_->exponent);
}
MeshState AssetView::mesh_state() const noexcept {
  return static_cast<MeshState>(header().mesh_state);
}
double AssetView::self_overlap_volume() const noexcept {
  return std::ldexp(header().self_overlap_volume, 3 * header().exponent);
}

PredictedErrors AssetView::predicted_errors() const noexcept {
  PredictedErrors result;
  if (header_ == nullptr) return result;
  static_assert(std::tuple_size_v<decltype(result.classes)> == kOverlapClasses);
  for (std::uint32_t k = 0; k < kOverlapClasses; ++k)
    result.classes[k] = {kOverlapClassFloor[k],
                         k <= 1 ? k == 0 ? 1 : 0.5 : kOverlapClassFloor[k - 1],
                         header_->predicted_error[k]};
  result.poses = header_->predicted_poses;
  result.target_error = header_->asked_error;
  result.target_overlap = header_->asked_at_overlap;
  result.measured_error = header_->measured_error;
  result.measured_poses = header_->measured_poses;
  result.worst_partner = static_cast<TrialPartner>(header_->worst_partner);
  return result;
}

}  // namespace ist
