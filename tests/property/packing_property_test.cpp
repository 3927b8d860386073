#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/types.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <random>

#include "mesh/mesh_solid.h"
#include "mesh/samples/samples.h"
#include "packing/base/packing_settings.h"
#include "support/float_traps.h"
#include "support/same_packing.h"
#include "support/shared_data.h"

namespace ist {
namespace {

/// A box as a closed mesh of twelve triangles.
ClosedMesh box_mesh(const Eigen::Vector3d& lo, const Eigen::Vector3d& hi) {
  ClosedMesh box;
  box.name = "box";
  for (int i = 0; i < 8; ++i)
    box.mesh.vertices.emplace_back((i & 1) != 0 ? hi.x() : lo.x(), (i & 2) != 0 ? hi.y() : lo.y(),
                                   (i & 4) != 0 ? hi.z() : lo.z());
  box.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                        {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

/// A torus about z with a wavy tube: curved, not convex, random.
ClosedMesh wavy_torus(std::mt19937& random, int around, int across) {
  std::uniform_real_distribution<double> unit(-1, 1);
  ClosedMesh torus;
  torus.name = "torus";
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      const double u = 2 * M_PI * i / around, v = 2 * M_PI * j / across;
      const double r = 0.3 + 0.08 * unit(random);
      torus.mesh.vertices.emplace_back((1 + r * std::cos(v)) * std::cos(u),
                                       (1 + r * std::cos(v)) * std::sin(u), r * std::sin(v));
    }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>((i % around) * across + j % across);
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < across; ++j) {
      torus.mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      torus.mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return torus;
}

/// Every pair and every sphere, in double, in the unit frame (docs/design.md 3.2). `rounding`: of
/// the solid's own signed distance when it is asked in the mesh's unit.
void expect_certified(const SpherePacking& packing, const Solid& solid, double rounding = 1e-13) {
  const double scale = packing.frame.scale();
  for (std::size_t i = 0; i < packing.spheres.size(); ++i) {
    const Sphere& a = packing.spheres[i];
    const Eigen::Vector3d centre(a.x, a.y, a.z);
    const double depth = -solid.signed_distance(packing.frame.from_unit(centre)) / scale;
    ASSERT_GT(a.r, 0);
    ASSERT_LE(double{a.r} + 1e-12, depth + rounding) << "sphere " << i;
    for (std::size_t j = 0; j < i; ++j) {
      const Sphere& b = packing.spheres[j];
      const double gap =
          (centre - Eigen::Vector3d(b.x, b.y, b.z)).norm() - double{a.r} - double{b.r};
      ASSERT_GE(gap, 1e-12) << "spheres " << j << " and " << i;
    }
  }
}

bool same_bytes(const SpherePacking& a, const SpherePacking& b) {
  return a.spheres.size() == b.spheres.size() &&
         std::memcmp(a.spheres.data(), b.spheres.data(), a.spheres.size() * sizeof(Sphere)) == 0;
}

PackingSettings count(std::size_t spheres, double epsilon = 0) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.epsilon = epsilon;
  return settings;
}

TEST(Packing, RandomSolidsAreCertifiedAndMeetTheCount) {
  std::mt19937 random(1);
  for (int round = 0; round < 4; ++round) {
    const auto solid = make_solid(wavy_torus(random, 12 + 4 * round, 8 + round));
    for (const std::size_t n : {1u, 2u, 17u, 300u}) {
      PackingSettings settings = count(n, round == 2 ? 0.3 : 0);
      settings.seed = random();
      const SpherePacking packing = pack(*solid, settings);
      EXPECT_EQ(packing.spheres.size(), n);
      EXPECT_EQ(packing.stop, StopReason::sphere_count);
      EXPECT_GT(packing.coverage, 0);
      expect_certified(packing, *solid);
    }
  }
}

TEST(Packing, ThreadCountDoesNotChangeABit) {
  std::mt19937 random(2);
  const oneapi::tbb::global_control allow_five(oneapi::tbb::global_control::max_allowed_parallelism,
                                               5);
  for (const auto& mesh : {box_mesh({0, 0, 0}, {1, 1, 1}), wavy_torus(random, 16, 8)}) {
    const auto solid = make_solid(mesh);
    PackingSettings settings = count(500);
    settings.threads = 1;
    const SpherePacking one = pack(*solid, settings);
    for (const unsigned threads : {1u, 2u, 5u}) {
      settings.threads = threads;
      EXPECT_TRUE(same_bytes(one, pack(*solid, settings))) << threads << " threads";
    }
  }
}

TEST(Packing, PowersOfTwoInScaleAndShiftDoNotChangeABit) {
  std::mt19937 random(3);
  const ClosedMesh mesh = wavy_torus(random, 14, 7);
  ClosedMesh moved = mesh;
  // Coordinates are multiples of 2⁻³⁰ first, so that the shift is exact.
  ClosedMesh rounded = mesh;
  for (std::size_t i = 0; i < mesh.mesh.vertices.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      const double x = std::round(std::ldexp(mesh.mesh.vertices[i][k], 30));
      rounded.mesh.vertices[i][k] = std::ldexp(x, -30);
      moved.mesh.vertices[i][k] = std::ldexp(std::ldexp(x, -30) + 64, -20);
    }
  const SpherePacking a = pack(*make_solid(rounded), count(200));
  const SpherePacking b = pack(*make_solid(moved), count(200));
  EXPECT_TRUE(same_bytes(a, b));
  EXPECT_EQ(a.frame.exponent, b.frame.exponent + 20);
}

TEST(Packing, EverySphereKeepsTheGreedyPromiseUnderAnExplicitEpsilon) {
  // No random point may have a clearance above r / (1 − ε) when r is inserted. Checked before each
  // sphere against all earlier ones, so the promise is read more strictly than it is made: a round
  // inserts disjoint spheres, so none takes another's place.
  std::mt19937 random(4);
  const double epsilon = 0.1;
  for (const auto& mesh : {box_mesh({0, 0, 0}, {1, 0.8, 0.6}), wavy_torus(random, 12, 8)}) {
    const MeshSolid solid(mesh);
    const SpherePacking packing = pack(solid, count(150, epsilon));
    EXPECT_GE(packing.kept_ratio_worst, 1 - epsilon - 1e-6);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Eigen::Vector3d> points;
    std::vector<double> clearance;
    for (int i = 0; i < 20000; ++i) {
      const Eigen::Vector3d x(unit(random), unit(random), unit(random));
      if (!solid.inside(x)) continue;
      points.push_back(x);
      clearance.push_back(solid.closest_point(x).distance);
    }
    for (std::size_t n = 0; n < packing.spheres.size(); ++n) {
      const Sphere& s = packing.spheres[n];
      // Only larger spheres of the same round may come later than this one's turn.
      for (std::size_t i = 0; i < points.size(); ++i)
        ASSERT_LE(clearance[i] * (1 - epsilon), double{s.r} * (1 + 1e-5)) << "sphere " << n;
      for (std::size_t i = 0; i < points.size(); ++i)
        clearance[i] = std::min(clearance[i],
                                (points[i] - Eigen::Vector3d(s.x, s.y, s.z)).norm() - double{s.r});
    }
  }
}

TEST(Packing, CancelledPackingIsCertifiedAndAPrefix) {
  std::mt19937 random(5);
  const auto solid = make_solid(wavy_torus(random, 40, 20));
  PackingSettings settings = count(4000);
  settings.threads = 1;
  const SpherePacking whole = pack(*solid, settings);
  int calls = 0;
  const SpherePacking cut = pack(*solid, settings, [&](const Progress& p) {
    EXPECT_LE(p.fraction, 1.0 + 1e-9);
    return ++calls < 2;
  });
  if (calls >= 2) {
    EXPECT_EQ(cut.stop, StopReason::cancelled);
  }
  testing::expect_prefix(cut, whole);
  expect_certified(cut, *solid);
}

TEST(Packing, OtherStopsAreMet) {
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  PackingSettings settings;
  settings.max_spheres = 0;
  settings.target_coverage = 0.7;
  SpherePacking packing = pack(*solid, settings);
  EXPECT_EQ(packing.stop, StopReason::coverage);
  EXPECT_GE(packing.coverage, 0.7);
  double volume = 0;
  for (const Sphere& s : packing.spheres) volume += 4.0 / 3 * M_PI * std::pow(double{s.r}, 3);
  const double scale = packing.frame.scale();
  EXPECT_NEAR(volume * scale * scale * scale, packing.coverage, 1e-9);

  settings.target_coverage = 1;
  settings.min_radius = 0.05;
  packing = pack(*solid, settings);
  EXPECT_EQ(packing.stop, StopReason::min_radius);
  for (const Sphere& s : packing.spheres) EXPECT_GE(double{s.r} * packing.frame.scale(), 0.05);
  EXPECT_GT(packing.spheres.size(), 33u);

  settings.min_radius = 0;
  settings.time_limit = 1e-3;
  packing = pack(*solid, settings);
  EXPECT_EQ(packing.stop, StopReason::time_limit);
  expect_certified(packing, *solid);
}

/// A legal setting means the same in every mode: a coverage of 0 is met by the first sphere, and
/// reported progress is a number in [0, 1].
TEST(Packing, ACoverageOfNothingIsMetByTheFirstSphere) {
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  for (const GridMode mode : {GridMode::banded, GridMode::uniform, GridMode::explicit_refinement,
                              GridMode::implicit_refinement, GridMode::hybrid}) {
    SCOPED_TRACE(static_cast<int>(mode));
    PackingSettings settings = count(100);
    settings.grid = mode;
    settings.target_coverage = 0;
    const SpherePacking packing = pack(*solid, settings);
    EXPECT_EQ(packing.spheres.size(), 1u);
    EXPECT_EQ(packing.stop, StopReason::coverage);
  }
}

TEST(Packing, ProgressIsAShareWhateverTheLimits) {
  for (const double coverage : {0.0, 0.5, 1.0})
    for (const std::size_t most : {0u, 100u})
      for (const std::size_t spheres : {0u, 1u, 99u, 100u}) {
        packing::PackingLimits limits;
        limits.target_coverage = coverage;
        limits.max_spheres = most;
        limits.length_unit = 4;
        Progress now;
        packing::set_progress(now, limits, spheres, spheres > 0 ? 0.6 : 0, 0.25);
        EXPECT_GE(now.fraction, 0);
        EXPECT_LE(now.fraction, 1);
        EXPECT_EQ(now.fraction == 1, spheres > 0 && (coverage < 0.6 || spheres == most));
        EXPECT_EQ(now.radius, 1);
      }
}

TEST(Packing, CubeFollowsTheExactGreedySequence) {
  IST_NEEDS_SHARED("oracle/packing/cube_apollonian_exact_120.csv");
  std::ifstream file(testing::shared_path("oracle/packing/cube_apollonian_exact_120.csv"));
  std::string line;
  std::getline(file, line);
  std::vector<double> exact;
  while (std::getline(file, line)) {
    std::size_t at = 0;
    for (int k = 0; k < 4; ++k) at = line.find(',', at) + 1;
    exact.push_back(std::stod(line.substr(at)));
  }
  ASSERT_GE(exact.size(), 33u);
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  const SpherePacking packing = pack(*solid, count(33, 0.02));
  ASSERT_EQ(packing.spheres.size(), 33u);
  for (std::size_t i = 0; i < 33; ++i)
    EXPECT_NEAR(double{packing.spheres[i].r} * packing.frame.scale(), exact[i], 0.005 * exact[i])
        << "sphere " << i + 1;
}

TEST(Packing, AnalyticSolidsArePackedThroughTheirDistanceAlone) {
  const auto ball = make_ball({1, 2, 3}, 0.7);
  SpherePacking packing = pack(*ball, count(1));
  ASSERT_EQ(packing.spheres.size(), 1u);
  EXPECT_NEAR(double{packing.spheres[0].r} * packing.frame.scale(), 0.7, 0.7e-3);

  // The largest sphere of a box has half its least edge; of a torus, its tube's radius.
  const auto box = make_box({0, 0, 0}, {0.5, 0.3, 0.2});
  packing = pack(*box, count(60));
  EXPECT_NEAR(double{packing.spheres[0].r} * packing.frame.scale(), 0.2, 0.2e-2);
  expect_certified(packing, *box, 1e-12);
  EXPECT_EQ(packing.spheres.size(), 60u);

  const auto torus = make_torus({0, 0, 0}, 1, 0.25);
  packing = pack(*torus, count(100));
  for (int i = 0; i < 8; ++i)
    EXPECT_NEAR(double{packing.spheres[static_cast<std::size_t>(i)].r} * packing.frame.scale(),
                0.25, 0.25 * 0.01);
  expect_certified(packing, *torus, 1e-12);

  const auto cut = make_difference(make_box({0, 0, 0}, {1, 1, 1}), make_ball({1, 1, 1}, 1.1));
  packing = pack(*cut, count(100));
  EXPECT_EQ(packing.spheres.size(), 100u);
  expect_certified(packing, *cut, 1e-12);
}

TEST(Packing, PlateausEnd) {
  // A slab, a plate of a millionth of its width, a needle of a millionth of its length: many equal
  // places, and bounds that do not distinguish them.
  for (const double thickness : {0.01, 1e-6}) {
    const auto slab = make_solid(box_mesh({0, 0, 0}, {1, 1, thickness}));
    const SpherePacking packing = pack(*slab, count(200));
    EXPECT_EQ(packing.spheres.size(), 200u);
    EXPECT_EQ(packing.below_float_noise, thickness < 1e-4);
    expect_certified(packing, *slab);
  }
  const auto needle = make_solid(box_mesh({0, 0, 0}, {1, 1e-6, 1e-6}));
  EXPECT_EQ(pack(*needle, count(100)).spheres.size(), 100u);
}

TEST(Packing, SettingsOutOfRangeAreRefused) {
  const testing::NoFloatTraps with_nan;
  const auto solid = make_solid(box_mesh({0, 0, 0}, {1, 1, 1}));
  PackingSettings bad;
  bad.target_coverage = 1.5;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.epsilon = 1;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.min_radius = -1;
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.time_limit = std::nan("");
  EXPECT_THROW(pack(*solid, bad), Error);
  bad = {};
  bad.max_spheres = 0;
  EXPECT_THROW(pack(*solid, bad), Error);
}

/// A thread fills slowly: rounds insert few spheres each for long. Bands that end before they are
/// empty lose the greedy order there.
TEST(Packing, AutomaticScheduleKeepsTheGreedyOrder) {
  const MeshSolid bolt(close_mesh(make_sample("bolt"), "bolt"));
  PackingSettings settings;
  settings.max_spheres = 600;
  const SpherePacking automatic = pack(bolt, settings);
  EXPECT_GE(automatic.kept_ratio_worst, 0.7);
  settings.epsilon = 0.1;
  const SpherePacking strict = pack(bolt, settings);
  EXPECT_GE(automatic.coverage, strict.coverage - 0.002);
}

}  // namespace
}  // namespace ist
