#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/float_traps.h"
#include "support/surface_queries.h"

// Fields whose numbers are none.

namespace ist {
namespace {

using namespace testing;

struct Garbage {
  double distance;
  Vector3d gradient;
  std::uint64_t after;  ///< looks that are answered well
  mutable std::uint64_t looks = 0;
};

ShapeSample answer_garbage(const void* context, const Vector3d& x) noexcept {
  const Garbage& garbage = *static_cast<const Garbage*>(context);
  if (garbage.looks++ < garbage.after) return {x.z() - 0.1, Vector3d(0, 0, 1)};
  return {garbage.distance, garbage.gradient};
}

TEST(FieldHostile, FunctionsThatAnswerGarbage) {
  const NoFloatTraps with_nan;
  Workspace workspace;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const Vector3d up = Vector3d::UnitZ();
  ContactPatch patches[4];
  for (const std::uint64_t after : {0ull, 5ull, 40ull}) {
    for (const Garbage& kind :
         {Garbage{nan, up, after}, Garbage{inf, up, after}, Garbage{-inf, up, after},
          Garbage{1e300, up, after}, Garbage{0, nan * up, after}, Garbage{0, inf * up, after},
          Garbage{0, Vector3d::Constant(1e300), after}, Garbage{-1e-3, 500 * up, after},
          Garbage{1e100, up, after}, Garbage{0, Vector3d::Zero(), after}}) {
      const PlacedShape a{FunctionShape{answer_garbage, &kind, 0}, {}, 1};
      const PlacedAsset b{cube().view(), {}, 1};
      const bool sound = std::abs(kind.distance) <= 1e150 && kind.gradient.norm() <= 1e3;
      const Penetration p = penetration(a, b, {}, workspace);
      if (!sound) {
        EXPECT_EQ(p.status, QueryStatus::invalid_input) << kind.distance;
        EXPECT_TRUE(std::isnan(p.volume) && std::isnan(p.volume_max));
      }
      EXPECT_EQ(std::isfinite(p.volume) && p.torque.allFinite(), sound);
      kind.looks = 0;
      const Separation s = separation(a, b, {}, workspace);
      EXPECT_EQ(std::isnan(s.distance) || std::isnan(s.distance_max),
                s.status == QueryStatus::invalid_input)
          << kind.distance;
      kind.looks = 0;
      const ContactPatches c = contact_patches(a, b, {}, workspace, patches);
      if (!sound) {
        EXPECT_EQ(c.count, 0u);
      }
      EXPECT_LE(c.count, 4u);
      kind.looks = 0;
    }
  }
}

TEST(FieldHostile, NumbersOutOfRange) {
  const NoFloatTraps with_nan;
  Workspace workspace;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const float four[4] = {};
  HeightFieldShape terrain;
  terrain.heights = four, terrain.columns = terrain.rows = 2;
  DistanceGridShape grid;
  const float eight[8] = {};
  grid.distances = eight;
  for (std::uint32_t& n : grid.size) n = 2;
  std::vector<Shape> bad = {HalfSpaceShape{Vector3d::Zero(), 0},
                            HalfSpaceShape{Vector3d::Constant(nan), 0},
                            HalfSpaceShape{Vector3d(0, 0, 1e200), 0},
                            HalfSpaceShape{Vector3d::UnitZ(), nan},
                            HalfSpaceShape{Vector3d::UnitZ(), inf},
                            BoxShape{Vector3d(1, 0, 1)},
                            BoxShape{Vector3d(1, -1, 1)},
                            BoxShape{Vector3d(1, nan, 1)},
                            BoxShape{Vector3d(1, inf, 1)},
                            BallShape{0},
                            BallShape{-1},
                            BallShape{nan},
                            BallShape{inf},
                            CapsuleShape{-1, 1},
                            CapsuleShape{1, -1},
                            CapsuleShape{1, nan},
                            CapsuleShape{nan, 1},
                            CylinderShape{0, 1},
                            CylinderShape{1, 0},
                            CylinderShape{1, nan},
                            HeightFieldShape{},
                            DistanceGridShape{},
                            FunctionShape{}};
  const auto with = [&](auto base, auto change) {
    change(base);
    bad.push_back(base);
  };
  with(terrain, [](HeightFieldShape& f) { f.columns = 1; });
  with(terrain, [](HeightFieldShape& f) { f.rows = 0; });
  with(terrain, [](HeightFieldShape& f) { f.spacing[0] = 0; });
  with(terrain, [&](HeightFieldShape& f) { f.spacing[1] = nan; });
  with(terrain, [](HeightFieldShape& f) { f.lowest = 1, f.highest = 0; });
  with(terrain, [](HeightFieldShape& f) { f.heights = nullptr; });
  with(grid, [](DistanceGridShape& f) { f.size[1] = 1; });
  with(grid, [](DistanceGridShape& f) { f.spacing = -1; });
  with(grid, [&](DistanceGridShape& f) { f.origin.x() = nan; });
  with(grid, [&](DistanceGridShape& f) { f.error = nan; });
  with(grid, [](DistanceGridShape& f) { f.distances = nullptr; });
  ContactPatch patches[4];
  const PlacedAsset b{cube().view(), {}, 1};
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const PlacedShape a{bad[i], {}, 1};
    const PenetrationAndSeparation both = query(a, b, {}, workspace);
    EXPECT_EQ(both.penetration.status, QueryStatus::invalid_input) << i;
    EXPECT_EQ(both.separation.status, QueryStatus::invalid_input) << i;
    EXPECT_TRUE(std::isnan(both.penetration.volume_max)) << i;
    EXPECT_TRUE(std::isnan(both.separation.distance_max)) << i;
    EXPECT_EQ(contact_patches(a, b, {}, workspace, patches).count, 0u) << i;
  }
  const auto below = [&](double length) {
    const PlacedShape a{HalfSpaceShape{{0, 0, length}, 0.125 * length}, {}, 1};
    return penetration(a, b, {}, workspace).volume;
  };
  for (const double length : {1e-150, 2.0, 1e150})
    EXPECT_NEAR(below(length), below(1), 1e-12 * below(1)) << length;
  const PlacedShape good{BallShape{1}, {}, 1};
  for (const double scale : {0.0, -1.0, nan, inf}) {
    EXPECT_EQ(penetration(PlacedShape{BallShape{1}, {}, scale}, b, {}, workspace).status,
              QueryStatus::invalid_input);
    EXPECT_EQ(penetration(good, {cube().view(), {}, scale}, {}, workspace).status,
              QueryStatus::invalid_input);
  }
  EXPECT_EQ(penetration(good, {AssetView(), {}, 1}, {}, workspace).status,
            QueryStatus::invalid_input);
  EXPECT_EQ(penetration(PlacedShape{BallShape{1}, {{nan, 0, 0, 0}, {0, 0, 0}}, 1}, b, {}, workspace)
                .status,
            QueryStatus::invalid_input);
  Workspace gone = std::move(workspace);
  EXPECT_EQ(penetration(good, b, {}, workspace).status, QueryStatus::invalid_input);
}

TEST(FieldHostile, TablesOfNoNumbers) {
  const NoFloatTraps with_nan;
  Workspace workspace;
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
        -std::numeric_limits<float>::infinity(), 3e38f}) {
    for (const bool all : {true, false}) {
      std::vector<float> values(125, all ? value : 0.1f);
      values[62] = values[12] = value;
      std::vector<float> distances = values;
      for (float& distance : distances) distance = -distance;
      for (const Shape& field : {Shape(grid_of(distances, 5)), Shape(terrain_of(values, 5))}) {
        const PlacedShape a{field, {}, 1};
        for (const double z : {0.0, 0.5, -3.0}) {
          const PlacedAsset b{cube().view(), pose_of(Quaterniond::Identity(), {0.1, 0.2, z}), 0.5};
          const Penetration p = penetration(a, b, {}, workspace);
          // Never a NaN that says it is an answer, and never an answer by what is no number.
          const bool plain = std::isfinite(p.volume) && p.force.allFinite() &&
                             p.torque.allFinite() && p.centroid.allFinite();
          EXPECT_EQ(plain, p.status != QueryStatus::invalid_input)
              << field.index() << ' ' << value << ' ' << all << ' ' << z;
          const Separation s = separation(a, b, {}, workspace);
          EXPECT_EQ(std::isnan(s.distance), s.status == QueryStatus::invalid_input);
          if (all && !std::isfinite(value) && z == 0) {
            EXPECT_EQ(p.status, QueryStatus::invalid_input) << field.index() << ' ' << value;
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace ist
