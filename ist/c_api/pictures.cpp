#include <ist/asset_layout.h>
#include <ist/lenses.h>
#include <cmath>

#include "c_api/structs.h"
#include "query/asset/mesh_parts.h"
#include "query/asset/sphere_tree.h"

// The contents of an asset, element by element, for callers that cannot read its layout; and
// lenses.

namespace ist::c_api {
namespace {

using c_api::write;

/// From an asset's unit frame to its own.
class OwnFrame {
 public:
  explicit OwnFrame(const AssetHeader& asset) noexcept
      : unit_(std::ldexp(1.0, asset.exponent)), centre_(vector(asset.centre)) {}

  void place(const Eigen::Vector3d& x, double (&out)[3]) const noexcept {
    write(x * unit_ + centre_, out);
  }
  double length(double r) const noexcept { return r * unit_; }

 private:
  double unit_;
  Eigen::Vector3d centre_;
};

/// Writes the first `capacity` of the balls ball(i), i < count.
template <class BallOf>
void write_balls(const OwnFrame& frame, std::size_t count, const BallOf& ball, ist_ball_t* out,
                 std::size_t capacity) noexcept {
  for (std::size_t i = 0; i < std::min(count, capacity); ++i) {
    const auto& [centre, r] = ball(i);
    frame.place(vector(centre), out[i].centre);
    out[i].radius = frame.length(r);
  }
}

NodeBall ball_of(const Sphere& s) noexcept { return {{s.x, s.y, s.z}, s.r}; }

ist_status_t get_balls(const AssetView& view, const ist_ball_set_t& set, ist_ball_t* balls,
                       std::size_t capacity, std::size_t& count) noexcept {
  const AssetHeader& asset = view.header();
  const bool inner = set.measure == IST_INNER;
  if (!inner && set.measure != IST_MATCHED) return IST_INVALID_INPUT;
  if (set.detail > (inner ? 0 : asset.detail_count)) return IST_INVALID_INPUT;
  if (view.sphere_count() == 0) return IST_MISSING_DATA;
  const SphereTree tree(asset, inner ? asset.inner_tree : matched_tree(asset, set.detail));
  if (set.level > static_cast<std::uint32_t>(tree.top)) return IST_INVALID_INPUT;
  const OwnFrame frame(asset);
  const int level = static_cast<int>(set.level) - 1;  // of the nodes whose balls are written
  count = tree.count(level);
  if (level == kSphereLevel) {
    const Sphere* const spheres =
        inner ? at<Sphere>(asset, asset.inner_spheres) : matched_spheres(asset, set.detail);
    write_balls(
        frame, count, [&](std::size_t i) { return ball_of(spheres[i]); }, balls, capacity);
  } else {
    const auto node = [&](std::size_t i) {
      return tree.ball(level, static_cast<std::uint32_t>(i));
    };
    write_balls(frame, count, node, balls, capacity);
  }
  return IST_OK;
}

void get_mesh(const AssetView& view, ist_mesh_t& out) noexcept {
  const MeshParts mesh(view.header(), *at<MeshHeader>(view.header(), view.header().mesh));
  const OwnFrame frame(view.header());
  out.vertex_count = mesh.header->vertex_count;
  for (std::size_t v = 0; v < std::min(out.vertex_count, out.vertex_capacity); ++v)
    frame.place(Eigen::Map<const Eigen::Vector3d>(mesh.vertices + 3 * v), out.vertices[v]);
  for (std::uint32_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& block = mesh.blocks[b];
    for (std::uint32_t t = 0; t < block.triangles; ++t, ++out.triangle_count)
      if (out.triangle_count < out.triangle_capacity)
        for (int k = 0; k < 3; ++k)
          out.triangles[out.triangle_count][k] = block.vertex[block.corner[k][t]];
  }
}

ist_status_t read(const ist_lens_settings_t* given, LensSettings& settings) noexcept {
  if (given == nullptr) return IST_OK;
  if (given->size != sizeof *given) return IST_WRONG_SIZE;
  if (given->measure < IST_MATCHED || given->measure > IST_INNER) return IST_INVALID_INPUT;
  settings = {static_cast<Measure>(given->measure), given->detail_a, given->detail_b};
  return IST_OK;
}

// Lenses are written directly to the caller's array.
static_assert(std::is_standard_layout_v<OverlapLens>);
static_assert(sizeof(ist_lens_t) == sizeof(OverlapLens));
static_assert(offsetof(ist_lens_t, centre) == offsetof(OverlapLens, centre));
static_assert(offsetof(ist_lens_t, axis) == offsetof(OverlapLens, axis));
static_assert(offsetof(ist_lens_t, radius) == offsetof(OverlapLens, radius));
static_assert(offsetof(ist_lens_t, thickness) == offsetof(OverlapLens, thickness));
static_assert(offsetof(ist_lens_t, sphere_a) == offsetof(OverlapLens, sphere_a));
static_assert(offsetof(ist_lens_t, sphere_b) == offsetof(OverlapLens, sphere_b));

}  // namespace
}  // namespace ist::c_api

using namespace ist::c_api;

ist_status_t ist_asset_get_balls(const ist_asset_t* asset, const ist_ball_set_t* set,
                                 ist_ball_t* balls, std::size_t capacity, std::size_t* count) {
  if (count == nullptr) return IST_NULL_POINTER;
  *count = 0;
  ist_status_t status = check_size(set);
  if (status == IST_OK && balls == nullptr && capacity > 0) status = IST_NULL_POINTER;
  ist::AssetView view;
  if (status == IST_OK) status = view_of(asset, view);
  return status == IST_OK ? get_balls(view, *set, balls, capacity, *count) : status;
}

ist_status_t ist_asset_get_mesh(const ist_asset_t* asset, ist_mesh_t* surface) {
  ist_status_t status = check_size(surface);
  if (status != IST_OK) return status;
  surface->vertex_count = surface->triangle_count = 0;
  if ((surface->vertices == nullptr && surface->vertex_capacity > 0) ||
      (surface->triangles == nullptr && surface->triangle_capacity > 0))
    return IST_NULL_POINTER;
  ist::AssetView view;
  status = view_of(asset, view);
  if (status == IST_OK && view.has_mesh()) get_mesh(view, *surface);
  return status;
}

ist_status_t ist_overlap_lenses(const ist_placed_t* a, const ist_placed_t* b,
                                const ist_lens_settings_t* settings, ist_lenses_t* lenses) {
  ist_status_t status = check_size(lenses);
  if (status != IST_OK) return status;
  lenses->total = lenses->count = 0;
  if (lenses->lens_size != sizeof(ist_lens_t)) return IST_WRONG_SIZE;
  if (lenses->lenses == nullptr && lenses->capacity > 0) return IST_NULL_POINTER;
  ist::LensSettings chosen;
  status = read(settings, chosen);
  ist::PlacedAsset first, second;
  if (status == IST_OK) status = read(a, first);
  if (status == IST_OK) status = read(b, second);
  if (status != IST_OK) return status;
  const ist::OverlapLenses found =
      ist::overlap_lenses(first, second, chosen,
                          {reinterpret_cast<ist::OverlapLens*>(lenses->lenses), lenses->capacity});
  lenses->total = found.total;
  lenses->count = found.count;
  return status_of(found.status);
}
