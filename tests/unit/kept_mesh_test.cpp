#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/lenses.h>
#include <ist/mass_properties.h>
#include <ist/query.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <ist/asset_layout.h>
#include "mesh/samples/samples.h"
#include "support/test_meshes.h"

// The mesh that an asset stores for exact queries, and mesh-only assets.

namespace ist {
namespace {

using Point = Eigen::Vector3d;

ClosedMesh closed(TriangleMesh mesh, const char* name) { return close_mesh(std::move(mesh), name); }

PackingSettings few_spheres(bool keep_mesh = true) {
  PackingSettings settings;
  settings.max_spheres = 20;
  settings.keep_mesh = keep_mesh;
  return settings;
}

void expect_sound(const Asset& asset, const ClosedMesh& mesh) {
  std::size_t of_mesh = 0;
  for (const Invariant& one : check(asset, mesh)) {
    if (one.name.find("mesh") != std::string::npos) ++of_mesh;
    EXPECT_EQ(one.violations, 0u) << one.name << ": " << one.worst << " at " << one.where;
  }
  EXPECT_GE(of_mesh, 7u);
}

const MeshHeader& mesh_of(const Asset& asset) {
  return *at<MeshHeader>(asset.view().header(), asset.view().header().mesh);
}

TEST(KeptMesh, IsAllOfTheMeshsOwnTriangles) {
  const ClosedMesh ball = closed(testing::icosphere_mesh(6), "ball");  // 81,920
  const ClosedMesh cube = closed(testing::cube_mesh(), "cube");
  for (const ClosedMesh* mesh : {&ball, &cube}) {
    const Asset asset = bake(*mesh, few_spheres());
    EXPECT_EQ(asset.view().mesh_state(), MeshState::own);
    EXPECT_EQ(asset.view().mesh_triangles(), mesh->mesh.triangles.size());
    EXPECT_EQ(mesh_of(asset).error, 0);
    EXPECT_EQ(asset.view().self_overlap_volume(), 0);
    expect_sound(bake_mesh_only(*mesh), *mesh);
  }
}

/// The flanks of the thread and its crest have blocks of their own, which are thin along their
/// normals.
TEST(KeptMesh, BlocksOfAThreadHoldOneFlank) {
  const Asset asset = bake_mesh_only(closed(make_sample("bolt"), "bolt"));
  const LevelHeader& level = mesh_of(asset).level[1];
  const auto* const boxes = at<BoxBlock>(asset.view().header(), level.blocks);
  const std::uint32_t count = mesh_of(asset).level[0].count;
  std::vector<double> thick;
  for (std::uint32_t b = 0; b < count; ++b) {
    const BoxBlock& box = boxes[b / kWidth];
    thick.push_back(std::ldexp(double{box.slab_high[b % kWidth]} - double{box.slab_low[b % kWidth]},
                               asset.view().header().exponent));
  }
  std::nth_element(thick.begin(), thick.begin() + count / 2, thick.end());
  EXPECT_LT(thick[count / 2], 0.2 * kThreadPitch);
  EXPECT_LT(count * kWidth, 1.2 * double(asset.view().mesh_triangles()));  // nearly full
}

// If the map into the unit frame is exact, nothing was rounded; otherwise the bound is tight.
/// More than 256 blocks share the tip of a cone: they do not all name each other.
TEST(KeptMesh, OfALargeFanGrowsWithItsTriangles) {
  constexpr std::uint32_t kSides = 9000;
  TriangleMesh cone;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double angle = 2 * 3.14159265358979 * i / kSides;
    cone.vertices.emplace_back(std::cos(angle), std::sin(angle), 0);
    cone.triangles.push_back({kSides, i, (i + 1) % kSides});
    cone.triangles.push_back({kSides + 1, (i + 1) % kSides, i});
  }
  cone.vertices.emplace_back(0.1, 0.2, 1);
  cone.vertices.emplace_back(0, 0, 0);
  const ClosedMesh mesh = closed(cone, "cone");
  const Asset asset = bake_mesh_only(mesh);
  expect_sound(asset, mesh);
  EXPECT_LT(asset.bytes().size(), 100u * 2 * kSides);
  // Half a cone, and the part of the other half outside a box.
  const Asset box = bake_mesh_only(closed(testing::box_mesh({-2, -2, -2}, {0, 2, 2}), "box"));
  const Asset other = bake_mesh_only(closed(testing::box_mesh({0, -2, -2}, {2, 2, 2}), "box"));
  PenetrationSettings exact;
  exact.measure = Measure::exact;
  Workspace workspace;
  const auto overlap = [&](const Asset& with) {
    return penetration(PlacedAsset{asset.view(), {}, 1}, PlacedAsset{with.view(), {}, 1}, exact,
                       workspace);
  };
  const Penetration one = overlap(box), rest = overlap(other);
  EXPECT_EQ(one.status, QueryStatus::ok);
  EXPECT_NEAR(one.volume + rest.volume, asset.view().volume(), 1e-9);
}

TEST(KeptMesh, TellsHowFarVerticesWereRounded) {
  const Asset exact = bake_mesh_only(closed(testing::cube_mesh(), "cube"));
  EXPECT_EQ(exact.view().mesh_error(), 0);
  TriangleMesh far = testing::torus_mesh(1.0, 0.4, 24, 12);
  for (Point& v : far.vertices) v += Point(0.1, 0.2, 0.3);
  const ClosedMesh moved = closed(std::move(far), "moved");
  const Asset rounded = bake_mesh_only(moved);
  EXPECT_GT(rounded.view().mesh_error(), 0);
  EXPECT_LT(rounded.view().mesh_error(), 1e-15);
  expect_sound(rounded, moved);
}

TEST(KeptMesh, IsLeftOutWhereNoneIsWanted) {
  const ClosedMesh cube = closed(testing::cube_mesh(), "cube");
  const Asset asset = bake(cube, few_spheres(false));
  EXPECT_FALSE(asset.view().has_mesh());
  EXPECT_EQ(asset.view().mesh_state(), MeshState::none);
  EXPECT_EQ(asset.view().mesh_triangles(), 0u);
}

// Never counted twice in silence.
TEST(KeptMesh, OfWhatCountsVolumeTwiceIsResolved) {
  const Point one = Point::Ones();
  const ClosedMesh crossing = closed(testing::overlapping_cubes_mesh(), "crossing");
  const ClosedMesh nested =
      closed(testing::joined(testing::box_mesh(-one, one), testing::box_mesh(-one / 2, one / 2)),
             "nested");
  for (const ClosedMesh* mesh : {&crossing, &nested}) {
    const Asset asset = bake(*mesh, few_spheres());
    EXPECT_TRUE(asset.view().has_mesh());
    EXPECT_EQ(asset.view().mesh_state(), MeshState::resolved);
    EXPECT_NEAR(asset.view().self_overlap_volume(), mesh->report.volume - asset.view().volume(),
                1e-12 * asset.view().volume());
    EXPECT_EQ(bake_mesh_only(*mesh).view().mesh_triangles(), asset.view().mesh_triangles());
    for (const Invariant& found : check(asset, *mesh))
      EXPECT_EQ(found.violations, 0u) << found.name;
  }
  EXPECT_NEAR(bake(nested, few_spheres()).view().self_overlap_volume(), 1, 1e-6);
  // The wall between touching parts is removed; cavities stay correct.
  const ClosedMesh touching =
      closed(testing::joined(testing::box_mesh(-one, one),
                             testing::box_mesh(Point(1, -0.5, -0.5), Point(2, 0.5, 0.5))),
             "touching");
  const ClosedMesh cavity =
      closed(testing::joined(testing::box_mesh(-one, one),
                             testing::inverted(testing::box_mesh(-one / 2, one / 2))),
             "cavity");
  for (const ClosedMesh* mesh : {&touching, &cavity}) {
    const Asset asset = bake(*mesh, few_spheres());
    const bool joins = mesh == &touching;
    EXPECT_EQ(asset.view().mesh_state(), joins ? MeshState::resolved : MeshState::own);
    EXPECT_EQ(asset.view().self_overlap_volume(), 0);
    EXPECT_EQ(mesh_of(asset).shell_count, joins ? 1u : 2u);
    expect_sound(asset, *mesh);
  }
}

TEST(KeptMesh, OfASolidByItsDistanceIsTheOneInItsPlace) {
  PolygoniseSettings meshing;
  meshing.cells = 24;
  const auto ball = make_ball(Point::Zero(), 1);
  const Asset asset = bake(*ball, few_spheres(), {}, meshing);
  EXPECT_EQ(asset.view().mesh_state(), MeshState::polygonised);
  EXPECT_GE(asset.view().mesh_error(),
            std::ldexp(asset.view().header().polygonise_error, asset.view().header().exponent));
  for (const Invariant& one : check(asset, *ball)) EXPECT_EQ(one.violations, 0u) << one.name;
}

TEST(KeptMesh, SameBytesForAnyNumberOfThreads) {
  const ClosedMesh ball = closed(testing::icosphere_mesh(5), "ball");
  const Asset one = bake_mesh_only(ball, 1);
  for (const unsigned threads : {2u, 5u}) {
    const Asset other = bake_mesh_only(ball, threads);
    EXPECT_TRUE(std::equal(one.bytes().begin(), one.bytes().end(), other.bytes().begin(),
                           other.bytes().end()));
  }
}

class SurfaceAlone : public ::testing::Test {
 protected:
  const ClosedMesh mesh_ = closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
  const Asset alone_ = bake_mesh_only(mesh_);
  const Asset whole_ = bake(mesh_, few_spheres());
  Workspace workspace_;
};

TEST_F(SurfaceAlone, HoldsMeshMassAndBounds) {
  expect_sound(alone_, mesh_);
  EXPECT_EQ(alone_.view().sphere_count(), 0u);
  EXPECT_FALSE(alone_.view().empty());
  EXPECT_EQ(mass_properties(alone_.view()).inertia, mass_properties(whole_.view()).inertia);
  EXPECT_EQ(alone_.view().volume(), whole_.view().volume());
  EXPECT_EQ(bounds(alone_.view()).radius, bounds(whole_.view()).radius);
}

void expect_missing_data(const Penetration& found) {
  EXPECT_EQ(found.status, QueryStatus::missing_data);
  for (const double x : {found.volume, found.volume_min, found.volume_max, found.centroid[0],
                         found.force[1], found.torque[2]})
    EXPECT_TRUE(std::isnan(x));
}

void expect_missing_data(const Separation& found) {
  EXPECT_EQ(found.status, QueryStatus::missing_data);
  for (const double x : {found.distance, found.distance_min, found.distance_max, found.point_a[0],
                         found.point_b[1], found.normal[2]})
    EXPECT_TRUE(std::isnan(x));
}

TEST_F(SurfaceAlone, AnswersNoQueryOfSpheres) {
  const PlacedAsset alone{alone_.view(), {}, 1}, whole{whole_.view(), {}, 1};
  for (const auto& [a, b] : {std::pair(alone, whole), {whole, alone}, {alone, alone}}) {
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      PenetrationSettings settings;
      settings.measure = measure;
      expect_missing_data(penetration(a, b, settings, workspace_));
      settings.pair_budget = 100;
      expect_missing_data(penetration(a, b, settings, workspace_));
      ContactSettings contact;
      contact.measure = measure;
      std::vector<ContactPatch> patches(4);
      const ContactPatches found = contact_patches(a, b, contact, workspace_, patches);
      expect_missing_data(found.penetration);
      EXPECT_EQ(found.count, 0u);
      without_protrusion(std::span(patches).first(0), a, b, contact);
    }
    expect_missing_data(separation(a, b, {.inner_spheres = true}, workspace_));
    EXPECT_EQ(separation(a, b, {}, workspace_).status, QueryStatus::ok);
    EXPECT_EQ(overlap(a, b, workspace_), YesNo::yes);
    PlacedAsset away = b;
    away.pose.t[0] = 100;
    EXPECT_EQ(overlap(a, away, workspace_), YesNo::no);
    EXPECT_EQ(overlap_lenses(a, b, {}, {}).status, QueryStatus::missing_data);
    EXPECT_TRUE(size_match(a, b).fits());
    Penetration answer;
    const PlacedPair pair{a, b};
    penetration_batch({&pair, 1}, {}, {&workspace_, 1}, {&answer, 1});
    expect_missing_data(answer);
    expect_missing_data(without_protrusion(answer, a, b));
  }
}

/// The mesh answers them, with spheres and without.
TEST_F(SurfaceAlone, HasTheTimesOfImpactOfTheWholeAsset) {
  ImpactSettings settings;
  settings.duration = 4;
  settings.tolerance = 1e-3;
  const Motion away{{-1, 0.1, 0.2}, {0.3, 0.8, -0.2}, Eigen::Vector3d::Zero()};
  const PlacedShape ball{BallShape{0.5}, {}, 1};
  int impacts = 0;
  for (double y = -3; y <= 3; y += 0.25) {
    const Pose start{{0.9, 0.1, 0.3, 0.2}, {3.5, y, 0.1}};
    const PlacedAsset alone{alone_.view(), start, 1}, whole{whole_.view(), start, 1};
    const TimeOfImpact pairs[][2] = {
        {time_of_impact(PlacedAsset{alone_.view(), {}, 1.2}, alone, {{}, away}, settings,
                        workspace_),
         time_of_impact(PlacedAsset{whole_.view(), {}, 1.2}, whole, {{}, away}, settings,
                        workspace_)},
        {time_of_impact(ball, alone, {{}, away}, settings, workspace_),
         time_of_impact(ball, whole, {{}, away}, settings, workspace_)}};
    for (const auto& [own, expected] : pairs) {
      EXPECT_EQ(own.status, QueryStatus::ok);
      EXPECT_EQ(own.kind, expected.kind) << y;
      EXPECT_NEAR(own.time, expected.time, 2e-3) << y;
      impacts += own.kind == ImpactKind::impact;
    }
  }
  EXPECT_GT(impacts, 10);
  EXPECT_EQ(time_of_impact(PlacedAsset{alone_.view(), {}, 1}, {alone_.view(), {}, 0.1}, {}, {},
                           workspace_)
                .kind,
            ImpactKind::no_impact);  // in the torus's hole
}

TEST_F(SurfaceAlone, MeetsNoField) {
  const PlacedAsset alone{alone_.view(), {}, 1};
  const PlacedShape ball{BallShape{1}, {}, 1};
  expect_missing_data(penetration(ball, alone, {}, workspace_));
  expect_missing_data(separation(ball, alone, {}, workspace_));
  const YesNoAnswer unknown = overlap(ball, alone, workspace_);
  EXPECT_EQ(unknown, YesNo::unknown);
  EXPECT_EQ(unknown.status, QueryStatus::missing_data);
  std::vector<ContactPatch> patches(4);
  expect_missing_data(contact_patches(ball, alone, {}, workspace_, patches).penetration);
}

}  // namespace
}  // namespace ist
