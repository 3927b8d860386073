#pragma once

#include <algorithm>
#include <cstring>
#include <new>
#include <span>
#include <stdexcept>
#include <vector>

#include "bake/asset/asset_writer.h"
#include "bake/cluster/tree_builder.h"
#include "query/asset/content_hash.h"
#include "support/mass_of_spheres.h"

// Small assets without a mesh, and bytes to damage.

namespace ist::testing {

/// Spheres on a grid: an asset without a mesh.
inline std::vector<std::byte> small_asset(std::size_t n, std::uint32_t details = 0) {
  AssetArrays arrays;
  for (std::size_t i = 0; i < n; ++i) {
    const float x = static_cast<float>(i % 4) / 4 - 0.5f;
    const float y = static_cast<float>(i / 4 % 4) / 4 - 0.5f;
    const float z = static_cast<float>(i / 16) / 4 - 0.5f;
    arrays.inner_spheres.push_back({x, y, z, 0.1f});
    arrays.matched_spheres.push_back({x, y, z, 0.12f});
    arrays.cover_radii.push_back(0.3f);
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.matched_spheres, {});
  for (std::uint32_t i = 1; i <= details; ++i) {
    DetailArrays& detail = arrays.details.emplace_back();
    const auto count = static_cast<std::ptrdiff_t>(detail_spheres(n, i));
    detail.matched_spheres.assign(arrays.matched_spheres.begin(),
                                  arrays.matched_spheres.begin() + count);
    detail.matched_tree = build_tree(detail.matched_spheres, {});
  }
  arrays.header.volume = 1;
  describe_spheres(arrays);
  return asset_bytes(arrays);
}

/// Bytes on a 64-byte boundary, as a mapped file has them, that end where the span ends: reading
/// further is seen by the address sanitizer.
class AlignedBytes {
 public:
  explicit AlignedBytes(std::span<const std::byte> bytes)
      : size_(bytes.size()),
        data_(static_cast<std::byte*>(
            ::operator new[](bytes.size(), std::align_val_t{kAssetAlignment}))) {
    std::copy(bytes.begin(), bytes.end(), data_);
  }
  ~AlignedBytes() { ::operator delete[](data_, std::align_val_t{kAssetAlignment}); }
  AlignedBytes(const AlignedBytes&) = delete;
  AlignedBytes& operator=(const AlignedBytes&) = delete;

  std::byte& operator[](std::size_t i) { return data_[i]; }
  std::span<const std::byte> span() const { return {data_, size_}; }
  AssetStatus status() const {
    AssetView view;
    const AssetStatus status = AssetView::from_bytes(span(), view);
    if (view.empty() != (status != AssetStatus::ok))
      throw std::logic_error("a view that does not fit its status");
    return status;
  }
  void seal() {
    const std::uint64_t hash = content_hash(span());
    std::memcpy(data_ + offsetof(AssetHeader, content_hash), &hash, sizeof(hash));
  }

 private:
  std::size_t size_;
  std::byte* data_;
};

}  // namespace ist::testing
