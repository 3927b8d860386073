#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>

#include <limits>

#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

Asset cube(bool with_mesh) {
  PackingSettings settings;
  settings.max_spheres = 200;
  settings.keep_mesh = with_mesh;
  return bake(close_mesh(testing::cube_mesh(), "cube"), settings);
}

/// The reported match is the method that queries use.
TEST(SizeMatch, TellsWhatIsAskedOfAPair) {
  Workspace workspace;
  const Asset bare = cube(false), whole = cube(true);
  for (const Asset* large : {&bare, &whole})
    for (const double ratio : {1.0, 1.2, 3.9, 4.1, 30.0})
      for (const bool turned : {false, true}) {
        const Pose near = {{0.6, 0, 0.8, 0}, {0.5, 0.1, 0.4 / ratio}};
        const PlacedAsset a{large->view(), {}, 3}, b{whole.view(), near, 3 / ratio};
        const PlacedAsset &first = turned ? b : a, &second = turned ? a : b;
        const SizeMatch fit = size_match(first, second);
        EXPECT_NEAR(fit.ratio, ratio, 1e-12 * ratio);
        EXPECT_GT(fit.feature_size_a, 0);
        EXPECT_EQ(fit.needs_mesh, ratio > 4);
        EXPECT_EQ(fit.has_mesh, large == &whole);
        if (ratio > 1) {
          EXPECT_EQ(fit.a_is_coarser, !turned);
        }
        const auto volume = [&](const PenetrationSettings& settings) {
          return penetration(first, second, settings, workspace).volume;
        };
        const double by_spheres = volume({.spheres_only = true});
        ASSERT_GT(by_spheres, 0);
        if (fit.needs_mesh && fit.has_mesh) {
          EXPECT_EQ(volume({}), volume({.measure = Measure::exact}));
        } else if (!fit.fits()) {
          EXPECT_EQ(volume({}), by_spheres);
        }
      }
}

TEST(SizeMatch, SaysNothingOfNothing) {
  const testing::NoFloatTraps with_nan;
  const Asset asset = testing::make_random_asset({40, 0.2, {}, 0}, 1);
  const PlacedAsset sound{asset.view(), {}, 1};
  PlacedAsset wrong = sound;
  for (const double scale : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    wrong.scale = scale;
    EXPECT_TRUE(size_match(sound, wrong).fits());
  }
  EXPECT_TRUE(size_match(sound, PlacedAsset()).fits());
  wrong.scale = 10;
  EXPECT_FALSE(size_match(sound, wrong).fits());
}

}  // namespace
}  // namespace ist
