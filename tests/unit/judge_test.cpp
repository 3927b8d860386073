#include <gtest/gtest.h>
#include <hwy/highway.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <random>
#include <string>

#include <ist/mesh.h>
#include <ist/solid.h>
#include <ist/types.h>

#include "base/elementary.h"
#include "mesh/judge.h"
#include "mesh/mesh_solid.h"
#include "mesh/outward_winding.h"
#include "mesh/samples/samples.h"
#include "support/test_meshes.h"

// The measures of a repair, its quality, and wraps.

namespace ist {
namespace {

using namespace testing;

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

double volume_of(const ClosedMesh& mesh) { return make_solid(mesh)->volume(); }

/// Without the triangles whose middles lie above a part of the height.
TriangleMesh cut_above(TriangleMesh mesh, double z) {
  std::erase_if(mesh.triangles, [&](const auto& t) {
    return mesh.vertices[t[0]].z() + mesh.vertices[t[1]].z() + mesh.vertices[t[2]].z() > 3 * z;
  });
  return mesh;
}

void flip_some(TriangleMesh& mesh, std::mt19937_64& random) {
  for (auto& t : mesh.triangles)
    if (random() % 3 == 0) std::swap(t[0], t[1]);
}

TEST(Angle, IsTheArcTangent) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 20000; ++i) {
    const double x = std::ldexp(uniform(random) - 0.5, static_cast<int>(random() % 60) - 30);
    const double y = std::ldexp(uniform(random) - 0.5, static_cast<int>(random() % 60) - 30);
    EXPECT_NEAR(angle_of(y, x), std::atan2(y, x), 2e-15);
  }
  EXPECT_EQ(angle_of(0, 0), 0);
  EXPECT_NEAR(angle_of(0, -1), std::numbers::pi, 1e-15);
}

TEST(SoupWinding, IsTheWindingNumberOfClosedSurfaces) {
  std::mt19937_64 random(2);
  for (const char* name : {"gear", "torus_knot", "hollow_sphere"}) {
    const MeshSolid solid(close_mesh(make_sample(name), name));
    const SoupWinding winding(solid.view());
    for (int i = 0; i < 2000; ++i) {
      const Eigen::Vector3d x(2 * uniform(random) - 1, 2 * uniform(random) - 1,
                              2 * uniform(random) - 1);
      EXPECT_NEAR(winding.at(x), solid.winding_number(x), 0.01) << name;
    }
  }
}

TEST(SoupWinding, HasTheSameBitsOnEveryInstructionSet) {
  TriangleMesh open = make_sample("gear");
  open.triangles.resize(open.triangles.size() / 2);
  const auto solid = triangles_as_solid(open);
  const SoupWinding winding(solid->view());
  const auto numbers = [&] {
    std::mt19937_64 random(3);
    std::vector<double> all;
    for (int i = 0; i < 200; ++i) {
      WindingPlaces places;
      for (double& x : places.reshaped()) x = 2 * uniform(random) - 1;
      for (const double w : winding.at_each(places)) all.push_back(w);
    }
    return all;
  };
  const std::vector<double> first = numbers();
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    EXPECT_EQ(numbers(), first) << hwy::TargetName(target);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(SoupWinding, IsTheSolidAngleOfAnOpenSurface) {
  // A square of side 2 seen from a distance h above its middle: 4 asin(1 / (1 + h²)) of 4π.
  TriangleMesh square;
  square.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto solid = triangles_as_solid(square);
  const SoupWinding winding(solid->view());
  for (const double h : {0.01, 0.3, 1.0, 4.0}) {
    const double expected = std::asin(1 / (1 + h * h)) / std::numbers::pi;
    const Eigen::Vector3d below = solid->frame().to_unit({0, 0, -h});
    const Eigen::Vector3d above = solid->frame().to_unit({0, 0, h});
    EXPECT_NEAR(winding.at(below), expected, 1e-9);
    EXPECT_NEAR(winding.at(above), -expected, 1e-9);
  }
}

TEST(OutwardWinding, TurnsWhatFacesInward) {
  std::mt19937_64 random(3);
  for (const bool some : {false, true}) {
    // A bowl, inside out or with triangles of random orientation.
    TriangleMesh bowl = cut_above(icosphere_mesh(3), 0.2);
    if (some)
      flip_some(bowl, random);
    else
      for (auto& t : bowl.triangles) std::swap(t[0], t[1]);
    const OutwardWinding winding(bowl);
    EXPECT_GT(winding.at({0, 0, -0.5}), 0.7);
    EXPECT_LT(winding.at({0, 0, -1.5}), 0.1);
  }
  // Triangles that share no edge: only their visibility decides.
  TriangleMesh apart;
  for (const auto& t : icosphere_mesh(2).triangles) {
    for (const auto v : t) apart.vertices.push_back(1.001 * icosphere_mesh(2).vertices[v]);
    const auto first = static_cast<std::uint32_t>(apart.vertices.size() - 3);
    apart.triangles.push_back({first, first + 1, first + 2});
    for (std::uint32_t k = 0; k < 3; ++k) apart.vertices[first + k] *= 1 + 1e-3 * uniform(random);
  }
  flip_some(apart, random);
  EXPECT_GT(OutwardWinding(apart).at({0.1, 0.2, 0.1}), 0.9);
}

/// Several sheets above each other are seen with more than a half from beside them.
TEST(TriangleWinding, IsLessThanHalfWhereItSaysSo) {
  std::mt19937_64 random(8);
  TriangleMesh sheets;
  for (const double z : {0.0, 0.05, 0.1, 0.15, 0.2}) {
    TriangleMesh sheet = box_mesh({-1, -1, z - 1}, {1, 1, z});
    std::erase_if(sheet.triangles, [&](const auto& t) {
      return std::ranges::any_of(t, [&](const auto v) { return sheet.vertices[v].z() != z; });
    });
    sheets = joined(sheets, sheet);
  }
  const TriangleWinding winding(sheets);
  int said = 0, more = 0;
  for (int i = 0; i < 4000; ++i) {
    Eigen::Vector3d x;
    for (double& at : x) at = 8 * uniform(random) - 4;
    if (i % 2 == 0) x.x() = x.y() = 0;  // right above or below the middle
    const bool is_less = std::abs(winding.at(x)) < 0.5;
    said += winding.surely_less_than_half(x) ? 1 : 0;
    more += is_less ? 0 : 1;
    EXPECT_TRUE(is_less || !winding.surely_less_than_half(x)) << x.transpose();
  }
  EXPECT_GT(said, 1000);
  EXPECT_GT(more, 500);
}

TEST(Judge, AClosedMeshAgreesWithItself) {
  const ClosedMesh gear = close_mesh(make_sample("gear"), "gear");
  const RepairQuality judged = judge(gear.mesh, gear, TwoMeshes(gear.mesh, gear.mesh), kKept);
  EXPECT_GT(judged.confidence, 0.98);
  EXPECT_NEAR(judged.volume_ratio, 1, 0.01);
  EXPECT_EQ(judged.kept_surface, 1);
  EXPECT_LT(judged.input_max, 1e-12);
  EXPECT_LT(judged.made_max, 1e-12);
}

TEST(Judge, ConfidenceFallsAsTheHoleGrows) {
  double last = 1;
  for (const double z : {0.95, 0.8, 0.6, 0.3, 0.0}) {
    const ClosedMesh closed =
        close_mesh(cut_above(icosphere_mesh(3), z), "ball", OpenMeshPolicy::repair);
    const double confidence = closed.report.judged.value().confidence;
    EXPECT_LT(confidence, last) << z;
    last = confidence;
    // The loss of a ball is at most three times the missing confidence.
    EXPECT_LT(1 - volume_of(closed) / volume_of(close_mesh(icosphere_mesh(3), "whole")),
              3 * (1 - confidence) * (1 - confidence) + 1.4 * (1 - confidence));
  }
}

TEST(Judge, WhatWasDroppedCounts) {
  TriangleMesh mesh = cube_mesh();
  TriangleMesh sheet = box_mesh({-2, -2, 2}, {2, 2, 3});
  sheet.triangles.resize(2);  // z = 2, four by four
  const TriangleMesh both = joined(mesh, sheet);
  try {
    close_mesh(both, "part", OpenMeshPolicy::repair);
    FAIL() << "a cube stands for a scene";
  } catch (const OpenMeshError& error) {
    EXPECT_NE(std::string(error.what()).find("confidence below"), std::string::npos)
        << error.what();
    EXPECT_NE(std::string(error.what()).find("--wrap"), std::string::npos) << error.what();
  }
}

/// A box without its lid, flush with the axes or turned, and a block that floats above the opening:
/// from the lid that is put on, what is nearest may be the block, which the lid does not touch.
TEST(Judge, TellsHowFarWhatWasAddedLies) {
  TriangleMesh open = box_mesh({-1, -1, -1}, {1, 1, 1});
  std::erase_if(open.triangles, [&](const auto& t) {
    return std::ranges::all_of(t, [&](const auto v) { return open.vertices[v].z() == 1; });
  });
  const Eigen::Vector3d low(-0.2, -0.2, 1.1), high(0.2, 0.2, 1.3);
  const Eigen::AlignedBox3d block(low, high);
  const TriangleMesh scene = joined(open, box_mesh(low, high));
  double mean = 0, furthest = 0;
  constexpr int kPlaces = 400;
  for (int i = 0; i < kPlaces; ++i)
    for (int k = 0; k < kPlaces; ++k) {
      const double x = (2 * i + 1.0) / kPlaces - 1, y = (2 * k + 1.0) / kPlaces - 1;
      const double to_walls = 1 - std::max(std::abs(x), std::abs(y));
      const double distance = std::min(to_walls, block.exteriorDistance(Eigen::Vector3d(x, y, 1)));
      mean += distance / (kPlaces * kPlaces);
      furthest = std::max(furthest, distance);
    }
  const double lid_of_all = 4 / (24 + 2 * 0.16 + 4 * 0.08);
  for (const double turn : {0.0, std::numbers::pi / 2, 0.3}) {
    TriangleMesh turned = scene;
    for (Eigen::Vector3d& v : turned.vertices)
      v = Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, 2) / 3) * v;
    const RepairQuality judged =
        close_mesh(turned, "box", OpenMeshPolicy::repair).report.judged.value();
    EXPECT_NEAR(judged.made_mean, mean * lid_of_all, 0.02 * mean * lid_of_all) << turn;
    EXPECT_NEAR(judged.made_max, furthest, 0.02) << turn;
    EXPECT_EQ(judged.input_max, 0) << turn;
  }
}

/// The result lacks one of two equal boxes, which lie flush, corner on corner, or apart.
TEST(Judge, CountsVolumeThatWasNotMade) {
  const TriangleMesh box = box_mesh({-1, -1, -1}, {1, 1, 1});
  const ClosedMesh made = close_mesh(box, "box");
  for (const Eigen::Vector3d& low : {Eigen::Vector3d(1, -1, -1), Eigen::Vector3d(-1, -1, 1),
                                     Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1.7, 0.3, -0.4)}) {
    const TriangleMesh two = joined(box, box_mesh(low, low + Eigen::Vector3d::Constant(2)));
    const RepairQuality judged = judge(two, made, TwoMeshes(two, made.mesh), kKept);
    EXPECT_NEAR(judged.volume_ratio, 2, 0.05) << low.transpose();
    EXPECT_NEAR(judged.agreement, 0.5, 0.02) << low.transpose();
  }
}

TEST(Judge, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh open = cut_above(icosphere_mesh(3), 0.5);
  const auto judged_by = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return close_mesh(open, "ball", OpenMeshPolicy::repair).report.judged.value();
  };
  const RepairQuality one = judged_by(1), many = judged_by(4);
  EXPECT_EQ(std::memcmp(&one, &many, sizeof one), 0);
}

/// Samples damaged at random: what is made with confidence is near the truth, what is far from it
/// is refused. Every relation is over all cases; the numbers stand in the user guide.
TEST(Judge, ConfidentRepairsOfDamagedSamplesAreNearTheTruth) {
  std::mt19937_64 random(4);
  int confident = 0, refused = 0;
  for (const char* name : {"gear", "bolt", "cylinder", "torus"}) {
    const TriangleMesh whole = make_sample(name);
    const double truth = volume_of(close_mesh(whole, name));
    for (const double removed : {0.01, 0.04, 0.1, 0.25, 0.5}) {
      TriangleMesh mesh = whole;
      std::erase_if(mesh.triangles, [&](const auto&) { return uniform(random) < removed; });
      flip_some(mesh, random);
      try {
        const ClosedMesh closed = close_mesh(mesh, name, OpenMeshPolicy::repair);
        const double error = std::abs(volume_of(closed) / truth - 1);
        if (closed.report.judged.value().confidence < 0.85) continue;
        ++confident;
        EXPECT_LT(error, 0.05) << name << " " << removed;
      } catch (const OpenMeshError&) {
        ++refused;
        EXPECT_GT(removed, 0.1) << name;
      }
    }
  }
  EXPECT_GT(confident, 9);
  EXPECT_GT(refused, 3);
}

TEST(Wrap, OfAClosedMeshLiesOnIt) {
  const TriangleMesh gear = make_sample("gear");
  const ClosedMesh wrapped = wrap_mesh(gear, "gear", 0.01);
  EXPECT_TRUE(wrapped.report.wrapped);
  EXPECT_NO_THROW(close_mesh(wrapped.mesh, "again"));
  const ClosedMesh truth = close_mesh(gear, "gear");
  const double step = 0.01 * truth.report.bounds.diagonal().norm();
  EXPECT_NEAR(volume_of(wrapped) / volume_of(truth), 1, 0.02);
  const RepairQuality judged = wrapped.report.judged.value();
  EXPECT_LT(judged.input_max, step);
  EXPECT_LT(judged.made_max, step);
  EXPECT_LT(judged.made_mean, 0.1 * step);
  EXPECT_GT(judged.confidence, 0.95);
}

TEST(Wrap, ClosesHolesAndThickensSheets) {
  // A ball without its top, and a sheet beside it.
  TriangleMesh sheet = box_mesh({1.5, -1, -1}, {2, 1, 1});
  sheet.triangles = {sheet.triangles[8], sheet.triangles[9]};  // x = 1.5
  const ClosedMesh wrapped =
      wrap_mesh(joined(cut_above(icosphere_mesh(3), 0.8), sheet), "scene", 0.02);
  EXPECT_EQ(wrapped.report.shells, 2u);
  EXPECT_NO_THROW(close_mesh(wrapped.mesh, "again"));
  const double step = 0.02 * Eigen::Vector3d(2.5, 2, 2).norm();
  // The plate is two steps thick and a step wider.
  const double plate = 2 * step * (2 + 2 * step) * (2 + 2 * step);
  EXPECT_NEAR(volume_of(wrapped), 4.16 + plate, 0.15 * (4.16 + plate));
  const MeshSolid solid(wrapped);
  EXPECT_TRUE(solid.inside(solid.frame().to_unit({0, 0, 0.6})));
  EXPECT_FALSE(solid.inside(solid.frame().to_unit({0, 0, 1.2})));
  EXPECT_TRUE(solid.inside(solid.frame().to_unit({1.5, 0.3, 0.4})));
  EXPECT_EQ(wrapped.report.judged.value().kept_surface, 1);
}

TEST(Wrap, MakesASolidOfWhateverHasArea) {
  std::mt19937_64 random(5);
  TriangleMesh soup;
  for (std::uint32_t t = 0; t < 30; ++t) {
    const Eigen::Vector3d middle(uniform(random), uniform(random), uniform(random));
    for (int k = 0; k < 3; ++k)
      soup.vertices.push_back(
          middle + 0.4 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)));
    soup.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  TriangleMesh triangle;
  triangle.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  triangle.triangles = {{0, 1, 2}};
  TriangleMesh doubled = triangle;
  doubled.triangles.push_back({0, 2, 1});
  for (const TriangleMesh& mesh : {soup, triangle, doubled}) {
    const ClosedMesh wrapped = wrap_mesh(mesh, "soup", 0.03);
    EXPECT_NO_THROW(close_mesh(wrapped.mesh, "again"));
    EXPECT_GT(volume_of(wrapped), 0);
  }
}

TEST(Wrap, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh open = cut_above(icosphere_mesh(2), 0.3);
  const auto wrapped_by = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return wrap_mesh(open, "ball", 0.03).mesh;
  };
  const TriangleMesh one = wrapped_by(1), many = wrapped_by(4);
  EXPECT_EQ(one.triangles, many.triangles);
  EXPECT_EQ(one.vertices, many.vertices);
}

TEST(Wrap, RefusesWhatItCannotSample) {
  for (const double detail : {0.0, 1e-4, 0.2, std::nan("")})
    EXPECT_THROW(wrap_mesh(cube_mesh(), "cube", detail), Error);
  EXPECT_THROW(wrap_mesh({}, "nothing", 0.01), Error);
  TriangleMesh infinite = cube_mesh();
  infinite.vertices[0].x() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(wrap_mesh(infinite, "cube", 0.01), Error);
}

}  // namespace
}  // namespace ist
