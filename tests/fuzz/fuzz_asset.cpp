#include <ist/bake.h>
#include <ist/query.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <span>

#include "support/asset_bytes.h"
#include "support/query_settings.h"
#include "support/test_meshes.h"

// Bytes are refused as an asset, or answer queries with finite numbers. An input whose first byte
// is even is taken as it comes; an odd one is a list of changes to a sound asset, one of spheres or
// (3 more than a multiple of 4) a mesh alone, whose hash is then set right, so that the checks
// behind it are reached.

namespace {

using namespace ist;
using testing::AlignedBytes;

/// All that a query may follow.
void walk(const AssetView& view) {
  const AssetHeader& asset = view.header();
  const MeshHeader& mesh = *at<MeshHeader>(asset, asset.mesh);
  double sum = 0;
  for (std::uint32_t b = 0; b < mesh.level[0].count; ++b) {
    const MeshBlock& block = at<MeshBlock>(asset, mesh.level[0].blocks)[b];
    for (const auto& corners : block.corner)
      for (const std::uint8_t corner : corners)
        sum += at<double>(asset, mesh.vertices)[3 * std::size_t{block.vertex[corner]} + 2];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t other =
          at<std::uint32_t>(asset, mesh.neighbours)[block.first_neighbour + k] / kWidth;
      sum += at<MeshBlock>(asset, mesh.level[0].blocks)[other].vertices;
    }
    sum += at<MeshShell>(asset, mesh.shells)[block.shell].block;
  }
  for (std::uint32_t k = 1; k < mesh.level_count; ++k)
    for (std::uint32_t i = 0; i < mesh.level[k].count; ++i)
      sum += double{at<BoxBlock>(asset, mesh.level[k].blocks)[i].low[2][0]};
  if (!std::isfinite(sum)) std::abort();
}

void use(const AssetView& view, const AssetView& sound) {
  if (view.has_mesh()) walk(view);
  static Workspace workspace(1u << 14);
  Pose pose;
  pose.t[0] = 0.2;
  for (const auto& [measure, pair_budget] :
       {std::pair(Measure::matched, 0u), {Measure::matched, 20u}, {Measure::inner, 0u}}) {
    PenetrationSettings settings;
    settings.measure = measure;
    settings.pair_budget = pair_budget;
    const auto [penetration, separation] =
        query({view, {}, 1}, {sound, pose, 1}, ist::testing::for_both(settings), workspace);
    if (view.sphere_count() == 0) {
      if (penetration.status != QueryStatus::missing_data) std::abort();
      continue;
    }
    if (!(penetration.volume >= 0) || !std::isfinite(penetration.volume_max)) std::abort();
    if (!penetration.force.allFinite()) std::abort();
    // An asset that lies may lie about distances, too, but not without end.
    if (!(separation.distance_min >= 0) || !std::isfinite(separation.distance_max)) std::abort();
    if (!std::isfinite(separation.distance_min)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const AlignedBytes original(testing::small_asset(40, 1));
  static const AssetView sound = [] {
    AssetView view;
    if (AssetView::from_bytes(original.span(), view) != AssetStatus::ok) std::abort();
    return view;
  }();
  if (size < 1) return 0;
  std::span<const std::byte> input(reinterpret_cast<const std::byte*>(data + 1), size - 1);
  if (data[0] % 2 == 0) {
    const AlignedBytes block(input);
    AssetView view;
    if (AssetView::from_bytes(block.span(), view) == AssetStatus::ok) use(view, sound);
    return 0;
  }
  static const Asset alone =
      bake_mesh_only(close_mesh(testing::torus_mesh(1, 0.4, 8, 5), "torus"), 1);
  AlignedBytes block(data[0] % 4 == 3 ? alone.bytes() : original.span());
  for (; input.size() >= 6; input = input.subspan(6)) {  // where (2 bytes), what (4)
    std::uint16_t at = 0;
    std::memcpy(&at, input.data(), 2);
    std::memcpy(&block[at % (block.span().size() - 3)], input.data() + 2, 4);
  }
  block.seal();
  AssetView view;
  if (AssetView::from_bytes(block.span(), view) == AssetStatus::ok) use(view, sound);
  return 0;
}
