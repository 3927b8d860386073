#include <ist/query.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <span>

#include "support/asset_bytes.h"
#include "support/query_settings.h"

// Bytes are refused as an asset, or answer queries with finite numbers. An input whose first byte
// is even is taken as it comes; an odd one is a list of changes to a sound asset, whose hash is
// then set right, so that the checks behind it are reached.

namespace {

using namespace ist;
using testing::AlignedBytes;

void use(const TreeView& view, const TreeView& sound) {
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
    if (!(penetration.volume >= 0) || !std::isfinite(penetration.volume_max)) std::abort();
    if (!penetration.translation_gradient.allFinite()) std::abort();
    // An asset that lies may lie about distances, too, but not without end.
    if (!(separation.distance_min >= 0) || !std::isfinite(separation.distance_max)) std::abort();
    if (!std::isfinite(separation.distance_min)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const AlignedBytes original(testing::small_asset(40, 1));
  static const TreeView sound = [] {
    TreeView view;
    if (TreeView::from_bytes(original.span(), view) != AssetStatus::ok) std::abort();
    return view;
  }();
  if (size < 1) return 0;
  std::span<const std::byte> input(reinterpret_cast<const std::byte*>(data + 1), size - 1);
  if (data[0] % 2 == 0) {
    const AlignedBytes block(input);
    TreeView view;
    if (TreeView::from_bytes(block.span(), view) == AssetStatus::ok) use(view, sound);
    return 0;
  }
  AlignedBytes block(original.span());
  for (; input.size() >= 6; input = input.subspan(6)) {  // where (2 bytes), what (4)
    std::uint16_t at = 0;
    std::memcpy(&at, input.data(), 2);
    std::memcpy(&block[at % (block.span().size() - 3)], input.data() + 2, 4);
  }
  block.seal();
  TreeView view;
  if (TreeView::from_bytes(block.span(), view) == AssetStatus::ok) use(view, sound);
  return 0;
}
