#include <gtest/gtest.h>
#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/c.h>
#include <ist/contact_law.h>
#include <ist/lenses.h>
#include <ist/mass_properties.h>
#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/shapes.h>
#include <ist/time_of_impact.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "c_api/checks.h"
#include "mesh/samples/samples.h"
#include "query/base/members.h"
#include "support/oracle_assets.h"
#include "support/random_assets.h"
#include "support/temp_file.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

TEST(CApi, EveryFunctionFromC) {
  const Asset cube = bake(close_mesh(testing::cube_mesh(), "cube"), {.max_spheres = 200});
  const Asset other = testing::make_random_asset({600, 0.2, {}, 0, 2}, 1);
  const auto text = [](const Asset& asset) {
    return std::string_view(reinterpret_cast<const char*>(asset.bytes().data()),
                            asset.bytes().size());
  };
  const testing::TempFile file_a("a.ist", text(cube)), file_b("b.ist", text(other));
  EXPECT_EQ(c_api_checks(file_a.path().c_str(), file_b.path().c_str()), 0);
  EXPECT_EQ(c_api_checks(file_b.path().c_str(), file_a.path().c_str()), 0);
}

ist_asset_t viewed(const Asset& asset) {
  ist_asset_t tree;
  EXPECT_EQ(ist_asset_view(asset.bytes().data(), asset.bytes().size(), &tree), IST_OK);
  return tree;
}

/// A struct of the C functions, set up.
template <class T>
T sized() {
  T result = {};
  result.size = sizeof result;
  return result;
}

ist_placed_t placed_in_c(const ist_asset_t& tree, const PlacedAsset& like) {
  return {sizeof(ist_placed_t), &tree, nullptr, std::bit_cast<ist_pose_t>(like.pose), like.scale};
}

#define EXPECT_SAME(a, b) \
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a), std::bit_cast<std::uint64_t>(b))

void expect_same(const double (&c)[3], const Eigen::Vector3d& cpp) {
  for (int k = 0; k < 3; ++k) EXPECT_SAME(c[k], cpp[k]);
}

/// Compares two answers.
template <class C, class Cpp>
requires std::is_class_v<C>
void expect_same(const C& c, const Cpp& cpp) {
  for_each_member(
      []<class X, class Y>(const X& x, const Y& y) {
        if constexpr (std::is_array_v<X>) {
          expect_same(x, y);
        } else if constexpr (std::is_same_v<X, double>) {
          EXPECT_SAME(x, y);
        } else {
          EXPECT_EQ(x, static_cast<X>(y));
        }
      },
      c, cpp);
}

class OracleRows : public ::testing::Test {
 protected:
  void SetUp() override {
    IST_NEEDS_SHARED("oracle/poses/poses_eledino.csv");
    ASSERT_EQ(ist_workspace_make(0, nullptr, &c_workspace_), IST_OK);
  }
  void TearDown() override { ist_workspace_release(&c_workspace_); }

  Workspace workspace_;
  ist_workspace_t c_workspace_ = {};
};

TEST_F(OracleRows, HaveTheBitsOfCpp) {
  int answered = 0;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
    if (row.id % 8 != 0) continue;
    const auto [a, b] = testing::placed(row, 1000);
    const ist_asset_t tree_a = viewed(testing::oracle_asset(row.mesh_a, 1000));
    const ist_asset_t tree_b = viewed(testing::oracle_asset(row.mesh_b, 1000));
    const ist_placed_t c_a = placed_in_c(tree_a, a), c_b = placed_in_c(tree_b, b);

    PenetrationSettings settings;
    settings.measure = row.id % 16 == 0 ? Measure::matched : Measure::inner;
    settings.max_visits = row.id % 24 == 0 ? 40 : 0;
    settings.pair_budget = row.id % 40 == 0 ? 200 : 0;
    const ist_penetration_settings_t c_settings = {sizeof c_settings,
                                                   static_cast<ist_measure_t>(settings.measure),
                                                   0,
                                                   settings.pair_budget,
                                                   settings.max_visits,
                                                   0,
                                                   0};
    auto c_penetration = sized<ist_penetration_t>();
    auto c_separation = sized<ist_separation_t>();
    ASSERT_GE(
        ist_query(&c_a, &c_b, &c_settings, nullptr, &c_workspace_, &c_penetration, &c_separation),
        0);
    const PenetrationAndSeparation asked = query(a, b, {settings, {}}, workspace_);
    expect_same(c_penetration, asked.penetration);
    expect_same(c_separation, asked.separation);

    const PlacedShape field{BallShape{0.4}, a.pose, a.scale};
    auto c_field = sized<ist_shape_t>();
    c_field.kind = IST_BALL;
    c_field.as.ball.radius = 0.4;
    const ist_placed_t c_placed = {sizeof c_placed, nullptr, &c_field, c_a.pose, c_a.scale};
    ASSERT_GE(
        ist_query(&c_placed, &c_b, nullptr, nullptr, &c_workspace_, &c_penetration, &c_separation),
        0);
    const PenetrationAndSeparation both = query(field, b, {}, workspace_);
    expect_same(c_penetration, both.penetration);
    expect_same(c_separation, both.separation);

    ContactPatch patches[16];
    ist_contact_patch_t c_storage[16];
    ist_contact_patches_t c_patches = {sizeof c_patches, sizeof c_storage[0], c_storage, 16, 0};
    const ContactPatches found = contact_patches(a, b, {}, workspace_, patches);
    ASSERT_GE(ist_contact_patches(&c_a, &c_b, nullptr, &c_workspace_, &c_patches, &c_penetration),
              0);
    expect_same(c_penetration, found.penetration);
    ASSERT_EQ(c_patches.count, found.count);
    for (std::size_t i = 0; i < found.count; ++i) expect_same(c_storage[i], patches[i]);
    without_protrusion({patches, found.count}, a, b, {});
    ASSERT_EQ(ist_patches_without_protrusion(&c_a, &c_b, nullptr, &c_patches), IST_OK);
    for (std::size_t i = 0; i < found.count; ++i) expect_same(c_storage[i], patches[i]);

    const Eigen::Vector3d point(0.1, 0.2, 0.3);
    auto c_wrenches = sized<ist_wrenches_t>();
    ASSERT_EQ(ist_wrenches(&c_penetration, &c_b.pose, point.data(), point.data(), &c_wrenches),
              IST_OK);
    const Wrenches both_wrenches = wrenches(found.penetration, b.pose, point, point);
    expect_same(c_wrenches.on_a.force, both_wrenches.on_a.force);
    expect_same(c_wrenches.on_a.torque, both_wrenches.on_a.torque);
    expect_same(c_wrenches.on_b.torque, both_wrenches.on_b.torque);

    PlacedAsset away = b;
    away.pose.t[0] += 3;
    ist_placed_t c_away = placed_in_c(tree_b, away);
    const Motion motion{{-6, 0.1, 0.2}, {0.5, 0.6, 0.7}, {0.01, 0.02, 0.03}};
    const ist_motion_t c_motion = {{-6, 0.1, 0.2}, {0.5, 0.6, 0.7}, {0.01, 0.02, 0.03}};
    const TimeOfImpact impact = time_of_impact(a, away, {{}, motion}, {}, workspace_);
    auto c_impact = sized<ist_impact_t>();
    ASSERT_GE(
        ist_time_of_impact(&c_a, &c_away, nullptr, &c_motion, nullptr, &c_workspace_, &c_impact),
        0);
    EXPECT_EQ(c_impact.kind, static_cast<int>(impact.kind));
    expect_same(c_impact, impact);

    ist_yes_no_t c_overlap;
    ASSERT_EQ(ist_overlap(&c_a, &c_b, &c_workspace_, &c_overlap), IST_OK);
    EXPECT_EQ(c_overlap, static_cast<int>(overlap(a, b, workspace_).answer));

    const MassProperties mass = mass_properties(b);
    const Bounds box = bounds(b);
    auto c_mass = sized<ist_mass_properties_t>();
    auto c_box = sized<ist_bounds_t>();
    ASSERT_EQ(ist_placed_mass_properties(&c_b, &c_mass), IST_OK);
    ASSERT_EQ(ist_placed_bounds(&c_b, &c_box), IST_OK);
    EXPECT_SAME(c_mass.volume, mass.volume);
    EXPECT_SAME(c_mass.volume_error, mass.volume_error);
    EXPECT_SAME(c_mass.centre_of_mass_error, mass.centre_of_mass_error);
    EXPECT_SAME(c_mass.inertia_error, mass.inertia_error);
    expect_same(c_mass.centre_of_mass, mass.centre_of_mass);
    for (int k = 0; k < 3; ++k) expect_same(c_mass.inertia[k], mass.inertia.row(k).transpose());
    expect_same(c_box.lower, box.lower);
    expect_same(c_box.upper, box.upper);
    expect_same(c_box.centre, box.centre);
    EXPECT_SAME(c_box.radius, box.radius);
    ++answered;
  }
  EXPECT_GT(answered, 20);
}

/// A mesh-only asset is reported, and answers no query of spheres.
TEST(CApi, SurfaceAlone) {
  const Asset asset = bake_mesh_only(close_mesh(testing::cube_mesh(), "cube"));
  const ist_asset_t tree = viewed(asset);
  ist_asset_info_t info = {};
  info.size = sizeof info;
  ASSERT_EQ(ist_asset_get_info(&tree, &info), IST_OK);
  EXPECT_EQ(info.spheres, 0u);
  EXPECT_EQ(info.details, 0u);
  EXPECT_EQ(info.mesh_triangles, 12u);
  EXPECT_EQ(info.mesh_state, IST_MESH_OWN);
  ist_placed_t placed = {};
  placed.size = sizeof placed;
  placed.asset = &tree;
  placed.pose = IST_POSE_IDENTITY;
  ist_workspace_t workspace = {};
  ASSERT_EQ(ist_workspace_make(0, nullptr, &workspace), IST_OK);
  ist_penetration_t answer = {};
  answer.size = sizeof answer;
  EXPECT_EQ(ist_penetration(&placed, &placed, nullptr, &workspace, &answer), IST_MISSING_DATA);
  EXPECT_EQ(answer.status, IST_MISSING_DATA);
  EXPECT_TRUE(std::isnan(answer.volume) && std::isnan(answer.force[2]));
  ist_separation_t gap = {};
  gap.size = sizeof gap;
  ist_separation_settings_t spheres = {};
  spheres.size = sizeof spheres;
  spheres.inner_spheres = 1;
  EXPECT_EQ(ist_separation(&placed, &placed, &spheres, &workspace, &gap), IST_MISSING_DATA);
  EXPECT_TRUE(std::isnan(gap.distance));
  const ist_ball_set_t set = {sizeof set, IST_INNER, 0, 0};
  std::size_t count = 1;
  EXPECT_EQ(ist_asset_get_balls(&tree, &set, nullptr, 0, &count), IST_MISSING_DATA);
  EXPECT_EQ(count, 0u);
  EXPECT_EQ(ist_workspace_release(&workspace), IST_OK);
}

TEST(CApi, RaysAndPointsHaveTheBitsOfCpp) {
  const Asset asset = bake_mesh_only(close_mesh(testing::icosphere_mesh(3), "ball"));
  const ist_asset_t tree = viewed(asset);
  const PlacedAsset placed{asset.view(), {{0.6, 0, 0.8, 0}, {1, 2, 3}}, 0.7};
  const ist_placed_t c_placed = {sizeof c_placed, &tree, nullptr,
                                 std::bit_cast<ist_pose_t>(placed.pose), placed.scale};
  const double points[] = {1, 2.1, 3, 4, 5, 6, 1.3, 2, 3.2};
  ist_ray_t rays[3] = {};
  ist_ray_hit_t hits[3];
  ist_surface_point_t feet[3];
  ist_yes_no_t inside[3];
  for (int i = 0; i < 3; ++i) {
    std::copy_n(points + 3 * i, 3, rays[i].origin);
    for (int k = 0; k < 3; ++k) rays[i].direction[k] = placed.pose.t[k] - points[3 * i + k];
  }
  ASSERT_EQ(ist_raycast(&c_placed, rays, 3, hits, sizeof *hits), IST_OK);
  ASSERT_EQ(ist_closest_point(&c_placed, points, 3, feet, sizeof *feet), IST_OK);
  ASSERT_EQ(ist_contains(&c_placed, points, 3, inside), IST_OK);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d x(points + 3 * i);
    expect_same(hits[i], raycast(placed, Ray{x, Eigen::Vector3d(rays[i].direction)}));
    expect_same(feet[i], closest_point(placed, x));
    EXPECT_EQ(inside[i], static_cast<int>(contains(placed, x).answer));
  }
  ist_shape_t ball = {};
  ball.size = sizeof ball;
  ball.kind = IST_BALL;
  ball.as.ball.radius = 0.5;
  const ist_placed_t c_ball = {sizeof c_ball, nullptr, &ball, IST_POSE_IDENTITY, 1};
  ASSERT_EQ(ist_closest_point(&c_ball, points, 3, feet, sizeof *feet), IST_OK);
  EXPECT_NEAR(feet[0].distance, std::sqrt(14.41) - 0.5, 1e-12);
  ASSERT_EQ(ist_contains(&c_ball, points, 3, inside), IST_OK);
  ASSERT_EQ(ist_raycast(&c_ball, rays, 3, hits, sizeof *hits), IST_OK);
  rays[1].direction[0] = rays[1].direction[1] = rays[1].direction[2] = 0;
  EXPECT_EQ(ist_raycast(&c_placed, rays, 3, hits, sizeof *hits), IST_INVALID_INPUT);
  EXPECT_TRUE(std::isnan(hits[1].distance) && hits[2].status == IST_OK);
  EXPECT_EQ(ist_raycast(nullptr, rays, 3, hits, sizeof *hits), IST_NULL_POINTER);
  EXPECT_EQ(ist_raycast(&c_placed, nullptr, 3, hits, sizeof *hits), IST_NULL_POINTER);
  EXPECT_EQ(ist_raycast(&c_placed, rays, 3, hits, 8), IST_WRONG_SIZE);
  EXPECT_EQ(ist_contains(&c_placed, points, 3, nullptr), IST_NULL_POINTER);
  EXPECT_EQ(ist_contains(&c_placed, nullptr, 0, nullptr), IST_OK);
}

/// The spheres that the asset's layout has, at every level of detail.
// The bits of C++, one by one and in batches, of surfaces alone too; nothing else is asked of
// meshes.
TEST(CApi, ExactHasTheBitsOfCpp) {
  const Asset solids[] = {bake_mesh_only(close_mesh(testing::cube_mesh(), "cube")),
                          bake_mesh_only(close_mesh(testing::icosphere_mesh(3), "ball"))};
  const ist_asset_t trees[] = {viewed(solids[0]), viewed(solids[1])};
  Workspace workspace;
  ist_workspace_t scratch = {};
  ASSERT_EQ(ist_workspace_make(0, nullptr, &scratch), IST_OK);
  auto settings = sized<ist_penetration_settings_t>();
  settings.measure = IST_EXACT;
  std::vector<ist_placed_t> a, b;
  std::vector<Penetration> expected;
  for (int i = 0; i < 40; ++i) {
    const PlacedAsset x{solids[0].view(), {}, 1};
    PlacedAsset y{solids[i % 2].view(), {}, i % 3 == 0 ? 0.5 : 1};
    for (int k = 0; k < 3; ++k) y.pose.t[k] = 0.07 * ((i * (k + 3)) % 17 - 8);
    a.push_back(placed_in_c(trees[0], x));
    b.push_back(placed_in_c(trees[i % 2], y));
    expected.push_back(penetration(x, y, {.measure = Measure::exact}, workspace));
    auto answer = sized<ist_penetration_t>();
    EXPECT_EQ(ist_penetration(&a.back(), &b.back(), &settings, &scratch, &answer), IST_OK);
    expect_same(answer, expected.back());
  }
  std::vector<ist_pair_t> pairs;
  for (std::size_t i = 0; i < a.size(); ++i) pairs.push_back({&a[i], &b[i]});
  std::vector<ist_penetration_t> answers(pairs.size());
  ASSERT_EQ(ist_penetration_batch(pairs.data(), pairs.size(), &settings, &scratch, 1,
                                  answers.data(), sizeof answers[0], nullptr),
            IST_OK);
  for (std::size_t i = 0; i < answers.size(); ++i) expect_same(answers[i], expected[i]);

  auto info = sized<ist_asset_info_t>();
  EXPECT_EQ(ist_asset_get_info(&trees[0], &info), IST_OK);
  EXPECT_EQ(info.mesh_triangles, 12u);
  EXPECT_EQ(info.spheres, 0u);
  auto lenses = sized<ist_lenses_t>();
  lenses.lens_size = sizeof(ist_lens_t);
  auto of = sized<ist_lens_settings_t>();
  of.measure = IST_EXACT;
  EXPECT_EQ(ist_overlap_lenses(&a[0], &b[0], &of, &lenses), IST_INVALID_INPUT);
  settings.measure = IST_MATCHED;
  auto answer = sized<ist_penetration_t>();
  EXPECT_EQ(ist_penetration(&a[0], &b[0], &settings, &scratch, &answer), IST_MISSING_DATA);
  EXPECT_TRUE(std::isnan(answer.volume));
  EXPECT_EQ(ist_workspace_release(&scratch), IST_OK);
}

/// The segments of each patch form closed curves: where one ends another begins, bit by bit.
void expect_closed(std::span<const ist_outline_segment_t> segments, std::size_t patches) {
  std::vector<std::array<double, 4>> from, to;  // the patch first
  for (const ist_outline_segment_t& segment : segments) {
    EXPECT_LT(segment.patch, patches);
    from.push_back({double(segment.patch), segment.from[0], segment.from[1], segment.from[2]});
    to.push_back({double(segment.patch), segment.to[0], segment.to[1], segment.to[2]});
  }
  std::sort(from.begin(), from.end());
  std::sort(to.begin(), to.end());
  EXPECT_EQ(from, to);
}

// The bits of C++, with memory for all and for less.
TEST(CApi, OutlinesHaveTheBitsOfCpp) {
  const Asset a = bake_mesh_only(close_mesh(make_sample("gear"), "gear"));
  const Asset b = bake_mesh_only(close_mesh(make_sample("torus_knot"), "knot"));
  const ist_asset_t tree_a = viewed(a), tree_b = viewed(b);
  Workspace workspace;
  ist_workspace_t scratch = {};
  ASSERT_EQ(ist_workspace_make(0, nullptr, &scratch), IST_OK);
  std::size_t most = 0;
  for (int i = 0; i < 12; ++i) {
    const PlacedAsset x{a.view(), {{0.6, 0, 0.8, 0}, {0.1, 0, 0}}, 1};
    const PlacedAsset y{b.view(), {{1, 0, 0, 0}, {0.4 * (i % 4), 0.3 * (i % 3), 0.2}}, 0.7};
    const ist_placed_t c_x = placed_in_c(tree_a, x), c_y = placed_in_c(tree_b, y);
    for (const std::size_t capacity : {0u, 1u, 2u, 32u}) {
      std::vector<ContactPatch> patches(capacity);
      std::vector<OutlineSegment> segments(capacity == 2 ? 10 : 20000);
      const OverlapOutline found = overlap_outline(x, y, {}, workspace, patches, segments);
      std::vector<ist_contact_patch_t> c_storage(capacity);
      std::vector<ist_outline_segment_t> c_segments(segments.size());
      ist_contact_patches_t c_patches = {sizeof c_patches, sizeof c_storage[0], c_storage.data(),
                                         capacity, 0};
      ist_outline_t c_outline = {
          sizeof c_outline, sizeof c_segments[0], c_segments.data(), c_segments.size(), 0, 0};
      auto whole = sized<ist_penetration_t>();
      ASSERT_EQ(ist_overlap_outline(&c_x, &c_y, nullptr, &scratch, &c_patches, &c_outline, &whole),
                IST_OK);
      expect_same(whole, found.contact.penetration);
      ASSERT_EQ(c_patches.count, found.contact.count);
      for (std::size_t k = 0; k < c_patches.count; ++k) expect_same(c_storage[k], patches[k]);
      EXPECT_EQ(c_outline.total, found.segments);
      ASSERT_EQ(c_outline.count, std::min(found.segments, segments.size()));
      for (std::size_t k = 0; k < c_outline.count; ++k) {
        expect_same(c_segments[k].from, segments[k].from);
        expect_same(c_segments[k].to, segments[k].to);
        EXPECT_EQ(c_segments[k].patch, segments[k].patch);
      }
      if (c_outline.count == c_outline.total)
        expect_closed(std::span(c_segments).first(c_outline.count),
                      std::max<std::size_t>(capacity, 1));
      most = std::max(most, c_patches.count);
    }
    // Stopped: no outline.
    auto settings = sized<ist_contact_settings_t>();
    settings.max_visits = 1;
    ist_contact_patches_t none = {sizeof none, sizeof(ist_contact_patch_t), nullptr, 0, 0};
    ist_outline_t c_outline = {sizeof c_outline, sizeof(ist_outline_segment_t), nullptr, 0, 0, 0};
    EXPECT_EQ(ist_overlap_outline(&c_x, &c_y, &settings, &scratch, &none, &c_outline, nullptr),
              IST_BUDGET_EXHAUSTED);
    EXPECT_EQ(c_outline.total, 0u);
  }
  EXPECT_GT(most, 2u);
  EXPECT_EQ(ist_workspace_release(&scratch), IST_OK);
}

TEST(CApi, Balls) {
  const Asset asset = bake(close_mesh(testing::cube_mesh(), "cube"), {.max_spheres = 2000});
  const AssetHeader& header = asset.view().header();
  const ist_asset_t tree = viewed(asset);
  const double unit = std::ldexp(1.0, header.exponent);
  const auto expect_spheres = [&](ist_measure_t measure, std::uint32_t detail,
                                  const Sphere* spheres, std::size_t wanted) {
    std::vector<ist_ball_t> balls(wanted);
    const ist_ball_set_t set = {sizeof set, measure, detail, 0};
    std::size_t count = 0;
    ASSERT_EQ(ist_asset_get_balls(&tree, &set, balls.data(), wanted, &count), IST_OK);
    ASSERT_EQ(count, wanted);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_SAME(balls[i].centre[2], spheres[i].z * unit + header.centre[2]);
      EXPECT_SAME(balls[i].radius, spheres[i].r * unit);
    }
  };
  ASSERT_GT(header.detail_count, 0u);
  expect_spheres(IST_INNER, 0, at<Sphere>(header, header.inner_spheres), header.sphere_count);
  for (std::uint32_t detail = 0; detail <= header.detail_count; ++detail)
    expect_spheres(IST_MATCHED, detail, matched_spheres(header, detail),
                   detail_spheres(header.sphere_count, detail));
}

/// Lenses are those that a penetration sums, and lie where their two spheres do.
TEST_F(OracleRows, LensesSumToTheVolume) {
  int held = 0;
  for (const testing::OracleRow& row : testing::read_oracle_rows("eledino")) {
    if (row.id % 16 != 0) continue;
    const auto [a, b] = testing::placed(row, 1000);
    for (const Measure measure : {Measure::matched, Measure::inner}) {
      const Penetration whole =
          penetration(a, b, {.measure = measure, .spheres_only = true}, workspace_);
      std::vector<OverlapLens> lenses(1 << 16);
      const LensSettings settings{.measure = measure};
      const OverlapLenses found = overlap_lenses(a, b, settings, lenses);
      ASSERT_EQ(found.status, QueryStatus::ok);
      ASSERT_EQ(found.count, found.total);
      const auto sphere = [&](const PlacedAsset& placed, std::uint32_t i) {
        const AssetHeader& header = placed.asset.header();
        const Sphere& s = (measure == Measure::inner ? at<Sphere>(header, header.inner_spheres)
                                                     : matched_spheres(header, 0))[i];
        const double unit = std::ldexp(1.0, header.exponent) * placed.scale;
        const Eigen::Vector3d centre =
            Eigen::Vector3d(s.x, s.y, s.z) * unit +
            Eigen::Vector3d(header.centre[0], header.centre[1], header.centre[2]) * placed.scale;
        const double* q = placed.pose.q;
        return std::pair<Eigen::Vector3d, double>(
            Eigen::Quaterniond(q[0], q[1], q[2], q[3]) * centre +
                Eigen::Vector3d(placed.pose.t[0], placed.pose.t[1], placed.pose.t[2]),
            s.r * unit);
      };
      double sum = 0;
      for (const OverlapLens& l : std::span(lenses).first(found.count)) {
        const auto [x, r] = sphere(a, l.sphere_a);
        const auto [y, s] = sphere(b, l.sphere_b);
        const double d = (y - x).norm();
        const double caps = r + s - d;
        sum +=
            d <= std::abs(r - s)
                ? 4 * M_PI / 3 * std::pow(std::min(r, s), 3)
                : M_PI * caps * caps * (d * d + 2 * d * (r + s) - 3 * (r - s) * (r - s)) / (12 * d);
        // The ends of its thickness lie in both spheres, on the surface of one.
        for (const double side : {-0.5, 0.5}) {
          const Eigen::Vector3d end = l.centre + side * l.thickness * l.axis;
          EXPECT_NEAR(std::max((end - x).norm() - r, (end - y).norm() - s), 0, 1e-12);
        }
        // The rim by Heron's formula, the smaller sphere where its centre is past the rim.
        const double p = (r + s + d) / 2;
        const double rim = 2 * std::sqrt(std::max(0.0, p * (p - r) * (p - s) * (p - d))) / d;
        EXPECT_NEAR(l.radius, d * d > std::abs(r * r - s * s) ? rim : std::min(r, s), 1e-9);
      }
      EXPECT_GE(sum, whole.volume_min * (1 - 1e-9));
      EXPECT_LE(sum, whole.volume_max * (1 + 1e-9) + 1e-18);
      held += sum > 0;
    }
  }
  EXPECT_GT(held, 10);
}

/// A floor on which a cube's spheres rest: flat faces that hardly touch lose most, from C too.
TEST(CApi, PatchesWithoutProtrusion) {
  const Asset cube = bake(close_mesh(testing::cube_mesh(), "cube"), {.max_spheres = 500});
  const ist_asset_t tree = viewed(cube);
  const PlacedAsset a{cube.view(), {}, 1}, b{cube.view(), {{1, 0, 0, 0}, {0.02, 0.01, 0.999}}, 1};
  const ist_placed_t c_a = placed_in_c(tree, a), c_b = placed_in_c(tree, b);
  Workspace workspace;
  ContactPatch patches[16];
  const ContactSettings settings{.spheres_only = true};
  const std::size_t count = contact_patches(a, b, settings, workspace, patches).count;
  double before = 0, after = 0;
  std::vector<ist_contact_patch_t> c_storage(count);
  std::memcpy(c_storage.data(), patches, count * sizeof c_storage[0]);
  for (const ContactPatch& patch : std::span(patches, count)) before += patch.volume;
  without_protrusion({patches, count}, a, b, settings);
  for (const ContactPatch& patch : std::span(patches, count)) after += patch.volume;
  EXPECT_GT(before, 0);
  EXPECT_LT(after, 0.9 * before);
  ist_contact_patches_t c_patches = {sizeof c_patches, sizeof c_storage[0], c_storage.data(), count,
                                     count};
  auto c_settings = sized<ist_contact_settings_t>();
  c_settings.spheres_only = 1;
  ASSERT_EQ(ist_patches_without_protrusion(&c_a, &c_b, &c_settings, &c_patches), IST_OK);
  for (std::size_t i = 0; i < count; ++i) expect_same(c_storage[i], patches[i]);
}

TEST(CApi, BakesAndPushesFromC) { EXPECT_EQ(c_bake_checks(), 0); }

TEST(CApi, PredictedErrors) {
  const TargetedAsset baked = bake_to_error(close_mesh(testing::cube_mesh(), "cube"), {0.2, 0.01});
  const PredictedErrors cpp = baked.asset.view().predicted_errors();
  const ist_asset_t tree = viewed(baked.asset);
  auto c = sized<ist_predicted_errors_t>();
  ASSERT_EQ(ist_asset_get_predicted_errors(&tree, &c), IST_OK);
  EXPECT_GT(c.poses, 0u);
  EXPECT_EQ(c.poses, cpp.poses);
  for (std::size_t i = 0; i < cpp.classes.size(); ++i) {
    EXPECT_SAME(c.classes[i].from, cpp.classes[i].from);
    EXPECT_SAME(c.classes[i].to, cpp.classes[i].to);
    EXPECT_SAME(c.classes[i].median, cpp.classes[i].median);
  }
  EXPECT_SAME(c.target_error, cpp.target_error);
  EXPECT_SAME(c.target_overlap, cpp.target_overlap);
  EXPECT_SAME(c.measured_error, cpp.measured_error);
  EXPECT_EQ(c.measured_poses, cpp.measured_poses);
  EXPECT_EQ(c.worst_partner, static_cast<int>(cpp.worst_partner));
  EXPECT_EQ(c.target_met, cpp.target_met() ? 1u : 0u);
}

// A caller's memory serves the C++ workspace too, and no answer depends on it.
TEST(MemoryHooks, HoldAWorkspace) {
  struct Count {
    std::size_t taken = 0, given_back = 0;
  } count;
  const MemoryHooks hooks{
      [](void* context, std::size_t bytes, std::size_t alignment) {
        static_cast<Count*>(context)->taken += bytes;
        return ::operator new(bytes, std::align_val_t(alignment));
      },
      [](void* context, void* memory, std::size_t bytes, std::size_t alignment) {
        static_cast<Count*>(context)->given_back += bytes;
        ::operator delete(memory, std::align_val_t(alignment));
      },
      &count};
  const Asset asset = testing::make_random_asset({600, 0.2, {}, 0, 2}, 1);
  const PlacedAsset a{asset.view(), {}, 1}, b{asset.view(), {{1, 0, 0, 0}, {0.3, 0, 0}}, 1};
  {
    Workspace hooked(1 << 12, hooks), plain(1 << 12);
    EXPECT_GT(count.taken, std::size_t{40} << 12);
    EXPECT_EQ(penetration(a, b, {}, hooked).volume, penetration(a, b, {}, plain).volume);
    Workspace moved = std::move(hooked);
    EXPECT_EQ(count.given_back, 0u);
  }
  EXPECT_EQ(count.taken, count.given_back);
  const MemoryHooks none{[](void*, std::size_t, std::size_t) -> void* { return nullptr; }};
  EXPECT_THROW(Workspace(64, none), std::bad_alloc);
}

}  // namespace
}  // namespace ist
