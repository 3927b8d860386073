#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>
#include <span>
#include <vector>

#include "asset/asset_writer.h"
#include "build/tree_builder.h"
#include "query/content_hash.h"

// Bytes are refused as an asset, or answer queries with finite numbers. An input whose first byte
// is even is taken as it comes; an odd one is a list of changes to a sound asset, whose hash is
// then set right, so that the checks behind it are reached.

namespace {

using namespace ist;

std::vector<std::byte> sound_asset() {
  AssetArrays arrays;
  for (int i = 0; i < 40; ++i) {
    const float x = static_cast<float>(i % 4) / 4 - 0.5f;
    const float y = static_cast<float>(i / 4 % 4) / 4 - 0.5f;
    const float z = static_cast<float>(i / 16) / 4 - 0.5f;
    arrays.inner_spheres.push_back({x, y, z, 0.1f});
    arrays.effective_spheres.push_back({x, y, z, 0.12f});
    arrays.cover_radii.push_back(0.3f);
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.effective_spheres, {});
  DetailArrays& detail = arrays.details.emplace_back();
  detail.effective_spheres.assign(10, {0, 0, 0, 0.2f});
  detail.matched_tree = build_tree(detail.effective_spheres, {});
  arrays.header.volume = 1;
  return asset_bytes(arrays);
}

/// Aligned, and ending where the bytes end: the sanitizer sees a read behind them.
struct Block {
  explicit Block(std::span<const std::byte> bytes)
      : size(bytes.size()),
        data(static_cast<std::byte*>(
            ::operator new[](bytes.size(), std::align_val_t{kAssetAlignment}))) {
    std::copy(bytes.begin(), bytes.end(), data);
  }
  ~Block() { ::operator delete[](data, std::align_val_t{kAssetAlignment}); }
  Block(const Block&) = delete;
  Block& operator=(const Block&) = delete;
  std::span<const std::byte> bytes() const { return {data, size}; }

  std::size_t size;
  std::byte* data;
};

void use(const TreeView& view, const TreeView& sound) {
  static Workspace workspace(1u << 14);
  Pose pose;
  pose.t[0] = 0.2;
  for (const auto& [measure, pair_budget] :
       {std::pair(Measure::matched, 0u), {Measure::matched, 20u}, {Measure::inner, 0u}}) {
    QuerySettings settings;
    settings.measure = measure;
    settings.pair_budget = pair_budget;
    const auto [penetration, separation] =
        query({view, {}, 1}, {sound, pose, 1}, settings, workspace);
    if (!(penetration.volume >= 0) || !std::isfinite(penetration.volume_max)) std::abort();
    if (!penetration.translation_gradient.allFinite()) std::abort();
    // An asset that lies may lie about distances, too, but not without end.
    if (!(separation.distance_min >= 0) || !std::isfinite(separation.distance_max)) std::abort();
    if (!std::isfinite(separation.distance_min)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Block original(sound_asset());
  static const TreeView sound = [] {
    TreeView view;
    if (TreeView::from_bytes(original.bytes(), view) != AssetStatus::ok) std::abort();
    return view;
  }();
  if (size < 1) return 0;
  std::span<const std::byte> input(reinterpret_cast<const std::byte*>(data + 1), size - 1);
  if (data[0] % 2 == 0) {
    const Block block(input);
    TreeView view;
    if (TreeView::from_bytes(block.bytes(), view) == AssetStatus::ok) use(view, sound);
    return 0;
  }
  const Block block(original.bytes());
  for (; input.size() >= 6; input = input.subspan(6)) {  // where (2 bytes), what (4)
    std::uint16_t at = 0;
    std::memcpy(&at, input.data(), 2);
    std::memcpy(block.data + at % (block.size - 3), input.data() + 2, 4);
  }
  const std::uint64_t hash = content_hash(block.bytes());
  std::memcpy(block.data + offsetof(AssetHeader, content_hash), &hash, sizeof(hash));
  TreeView view;
  if (TreeView::from_bytes(block.bytes(), view) == AssetStatus::ok) use(view, sound);
  return 0;
}
