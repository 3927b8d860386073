#include <gtest/gtest.h>

#include <memory>

#include "query/kernel/placed_blocks.h"

namespace ist {
namespace {

/// A cache whose blocks know their number, which replaces their position.
class Cache {
 public:
  Cache() { cache_->forget(); }

  const PlacedBlock<float>* find(std::uint32_t block,
                                 const PlacedBlock<float>* const* held = nullptr,
                                 std::size_t count = 0) {
    return cache_->find(block, held, count, [&](std::uint32_t number, PlacedBlock<float>& placed) {
      placed.radius = static_cast<float>(number);
      ++placings;
    });
  }

  int placings = 0;

 private:
  std::unique_ptr<BlockCache<float>> cache_ = std::make_unique<BlockCache<float>>();
};

TEST(PlacedBlocks, ArePlacedOnce) {
  Cache cache;
  for (int round = 0; round < 2; ++round)
    for (std::uint32_t block = 0; block < 100; ++block) {
      const PlacedBlock<float>* const placed = cache.find(block);
      ASSERT_NE(placed, nullptr);
      EXPECT_EQ(placed->radius, static_cast<float>(block));
    }
  EXPECT_EQ(cache.placings, 100);
}

TEST(PlacedBlocks, NeverPushOutAHeldOne) {
  Cache cache;
  const PlacedBlock<float>* const held = cache.find(7);
  // Whatever the number of slots, one of these falls on the held one.
  bool refused = false;
  for (std::uint32_t block = 8; block < 5000; ++block) {
    const PlacedBlock<float>* const placed = cache.find(block, &held, 1);
    EXPECT_NE(placed, held);
    refused |= placed == nullptr;
    ASSERT_EQ(held->radius, 7);
  }
  EXPECT_TRUE(refused);
}

TEST(PlacedBlocks, PushOutTheOthers) {
  Cache cache;
  for (std::uint32_t block = 0; block < 5000; ++block)
    ASSERT_EQ(cache.find(block)->radius, static_cast<float>(block));
  EXPECT_EQ(cache.find(0)->radius, 0);
  EXPECT_EQ(cache.placings, 5001);
}

TEST(PlacedBlocks, AreForgottenForAnotherPose) {
  auto cache = std::make_unique<BlockCache<double>>();
  int placings = 0;
  for (int pose = 0; pose < 3; ++pose) {
    cache->forget();
    cache->find(3, nullptr, 0, [&](std::uint32_t, PlacedBlock<double>&) { ++placings; });
  }
  EXPECT_EQ(placings, 3);
}

}  // namespace
}  // namespace ist
