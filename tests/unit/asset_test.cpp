#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/error.h>

#include "asset/asset_writer.h"
#include "build/tree_builder.h"

namespace ist {
namespace {

std::vector<std::byte> small_asset(std::size_t n) {
  AssetArrays arrays;
  for (std::size_t i = 0; i < n; ++i) {
    const float x = static_cast<float>(i % 4) / 4 - 0.5f;
    const float y = static_cast<float>(i / 4 % 4) / 4 - 0.5f;
    const float z = static_cast<float>(i / 16) / 4 - 0.5f;
    arrays.inner_spheres.push_back({x, y, z, 0.1f});
    arrays.effective_spheres.push_back({x, y, z, 0.12f});
    arrays.cover_radii.push_back(0.3f);
  }
  arrays.inner_tree = build_tree(arrays.inner_spheres, arrays.cover_radii);
  arrays.matched_tree = build_tree(arrays.effective_spheres, {});
  arrays.header.volume = 1;
  return asset_bytes(arrays);
}

TEST(Asset, RoundTrip) {
  for (const std::size_t n : {1u, 16u, 17u, 40u}) {
    const auto bytes = small_asset(n);
    const Asset asset(bytes, "memory");
    EXPECT_EQ(asset.view().sphere_count(), n);
    const auto path = std::filesystem::path(::testing::TempDir()) / "round_trip.ist";
    asset.save(path);
    const Asset again = Asset::load(path);
    EXPECT_TRUE(std::equal(bytes.begin(), bytes.end(), again.bytes().begin(), again.bytes().end()));
    std::filesystem::remove(path);
  }
}

}  // namespace
}  // namespace ist
