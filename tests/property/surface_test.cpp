#include <gtest/gtest.h>
#include <ist/query.h>
#include <ist/raycast.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "query/exact/nearest_points.h"
#include "query/exact/orientation.h"
#include "support/exact_pair.h"
#include "support/float_traps.h"
#include "support/random_assets.h"
#include "support/surface_queries.h"
#include "support/test_meshes.h"

// Rays, points and gaps against all triangles of the meshes, one by one.

namespace ist {
namespace {

using testing::Quaterniond;
using testing::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

exact::Point point(const Vector3d& x) { return {x.x(), x.y(), x.z()}; }
Vector3d vector(const exact::Point& p) { return {p.x, p.y, p.z}; }

/// A solid and the mesh that it was made from.
struct Body {
  explicit Body(TriangleMesh given) : mesh(given), asset(testing::surface(std::move(given))) {}

  std::vector<exact::FlatTriangle> triangles(const PlacedAsset& placed) const {
    std::vector<exact::FlatTriangle> out;
    const auto world = [&](std::uint32_t v) {
      return point(testing::rotation(placed.pose) * (placed.scale * mesh.vertices[v]) +
                   testing::position(placed.pose));
    };
    for (const auto& t : mesh.triangles) out.emplace_back(world(t[0]), world(t[1]), world(t[2]));
    return out;
  }

  TriangleMesh mesh;
  Asset asset;
};

std::vector<Body> bodies() {
  std::vector<Body> out;
  out.emplace_back(testing::cube_mesh());
  out.emplace_back(testing::icosphere_mesh(3));
  out.emplace_back(testing::torus_mesh(0.35, 0.14, 40, 20));
  // Two shells, and a cavity.
  out.emplace_back(
      testing::joined(testing::box_mesh({-1, -1, -1}, {1, 1, 1}),
                      testing::inverted(testing::box_mesh({-0.8, -0.8, -0.8}, {0.8, 0.8, 0.8}))));
  out.emplace_back(
      testing::joined(testing::box_mesh({-2, -1, -1}, {-1.1, 1, 1}), testing::icosphere_mesh(2)));
  return out;
}

double nearest(const std::vector<exact::FlatTriangle>& triangles, const Vector3d& x) {
  double least = kInfinity;
  for (const exact::FlatTriangle& t : triangles)
    least = std::min(least, (vector(nearest_on_triangle(point(x), t)) - x).norm());
  return least;
}

/// The winding number of a surface around a point, by solid angles.
double winding(const std::vector<exact::FlatTriangle>& triangles, const Vector3d& x) {
  double sum = 0;
  for (const exact::FlatTriangle& t : triangles) {
    const Vector3d a = vector(t.corner[0]) - x, b = vector(t.corner[1]) - x,
                   c = vector(t.corner[2]) - x;
    sum += 2 * std::atan2(a.dot(b.cross(c)), a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() +
                                                 b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return sum / (4 * std::numbers::pi);
}

/// The first hit of a ray with the triangles, except near edges.
double first(const std::vector<exact::FlatTriangle>& triangles, const Ray& ray) {
  double least = kInfinity;
  const Vector3d d = ray.direction.normalized();
  for (const exact::FlatTriangle& t : triangles) {
    const Vector3d n = vector(t.normal), a = vector(t.corner[0]) - ray.origin;
    const double along = n.dot(a) / n.dot(d);
    if (!(along >= 0) || along >= least) continue;
    const exact::Point at = point(ray.origin + along * d);
    bool inside = true;
    for (int k = 0; k < 3; ++k)
      inside = inside && dot(t.normal, cross(t.side[k], at - t.corner[k])) >= 0;
    if (inside) least = along;
  }
  return least;
}

TEST(Surface, PointsAndRaysMatchAllTriangles) {
  const testing::NoFloatTraps division_by_zero;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int hits = 0, inside = 0;
  for (const Body& body : bodies())
    for (const double scale : {1.0, 0.02, 300.0})
      for (int i = 0; i < 60; ++i) {
        const PlacedAsset placed{body.asset.view(), testing::random_pose(random, scale), scale};
        const auto triangles = body.triangles(placed);
        const auto place = [&]() -> Vector3d {
          return testing::position(placed.pose) +
                 1.4 * scale * Vector3d(uniform(random), uniform(random), uniform(random));
        };
        const Vector3d x = place();
        const SurfacePoint got = closest_point(placed, x);
        ASSERT_EQ(got.status, QueryStatus::ok);
        EXPECT_NEAR(std::abs(got.distance), nearest(triangles, x), 1e-13 * scale);
        EXPECT_LE(std::abs(std::abs(got.distance) - nearest(triangles, x)), got.error);
        EXPECT_LE(nearest(triangles, got.point), 1e-13 * scale);
        EXPECT_NEAR(got.gradient.norm(), 1, 1e-12);
        EXPECT_LE((got.point + got.distance * got.gradient - x).norm(), 1e-12 * scale);
        const bool holds = winding(triangles, x) > 0.5;
        EXPECT_EQ(got.distance < 0, holds);
        EXPECT_EQ(contains(placed, x) == YesNo::yes, holds);
        inside += holds;

        const Ray ray{x, Vector3d(uniform(random), uniform(random), uniform(random)) * 7};
        const RayHit hit = raycast(placed, ray);
        const double want = first(triangles, ray);
        ASSERT_EQ(hit.hit(), want < kInfinity);
        if (!hit.hit()) continue;
        ++hits;
        EXPECT_NEAR(hit.distance, want, 1e-12 * scale);
        EXPECT_LE((ray.origin + hit.distance * ray.direction.normalized() - hit.point).norm(),
                  1e-13 * scale);
        EXPECT_LE(nearest(triangles, hit.point), 1e-13 * scale);
        EXPECT_NEAR(hit.normal.norm(), 1, 1e-12);
        EXPECT_EQ(hit.normal.dot(ray.direction) > 0, holds);
        Ray limited = ray;
        limited.max_distance = 0.999 * want;
        EXPECT_FALSE(raycast(placed, limited).hit());
        limited.max_distance = 1.001 * want;
        EXPECT_NEAR(raycast(placed, limited).distance, want, 1e-12 * scale);
      }
  EXPECT_GT(hits, 200);
  EXPECT_GT(inside, 100);
}

/// Through corners and along edges and faces of a lattice: in at one side, out at the other.
TEST(Surface, NoRaySlipsThrough) {
  const Body cube(testing::box_mesh({-1, -1, -1}, {1, 1, 1}));
  const Body ball(testing::icosphere_mesh(2));
  const PlacedAsset box{cube.asset.view(), {}, 1};
  for (int i = -3; i <= 3; ++i)
    for (int j = -3; j <= 3; ++j) {
      const double x = i / 4.0, y = j / 4.0;
      for (int k = 0; k < 3; ++k)
        for (const double side : {-1.0, 1.0}) {
          Vector3d from;
          from[k] = 3 * side, from[(k + 1) % 3] = x, from[(k + 2) % 3] = y;
          const RayHit hit = raycast(box, Ray{from, -side * Vector3d::Unit(k)});
          EXPECT_EQ(hit.distance, 2) << from.transpose();
          EXPECT_EQ(hit.normal, side * Vector3d::Unit(k));
          from[k] = 0;
          EXPECT_EQ(raycast(box, Ray{from, side * Vector3d::Unit(k)}).distance, 1);
        }
    }
  // From the middle through every vertex and every edge's middle.
  for (const Body* body : {&cube, &ball}) {
    const PlacedAsset placed{body->asset.view(), {}, 1};
    for (const auto& t : body->mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const Vector3d p = body->mesh.vertices[t[k]], q = body->mesh.vertices[t[(k + 1) % 3]];
        for (const Vector3d& to : {p, Vector3d(0.5 * (p + q)), Vector3d(p + (q - p) / 3)}) {
          EXPECT_NEAR(raycast(placed, Ray{Vector3d::Zero(), to}).distance, to.norm(), 1e-12);
          EXPECT_NEAR(raycast(placed, Ray{1e-3 * to.reverse(), to}).distance,
                      raycast(placed, Ray{1e-3 * to.reverse(), to * 1e-9}).distance, 1e-12);
          EXPECT_TRUE(raycast(placed, Ray{-2 * to, to}).hit());
        }
      }
  }
}

TEST(Surface, PointsOnTheSurface) {
  const Body body(testing::icosphere_mesh(3));
  std::mt19937_64 random(3);
  const PlacedAsset placed{body.asset.view(), testing::random_pose(random, 5), 3};
  for (const exact::FlatTriangle& t : body.triangles(placed)) {
    const Vector3d middle = (vector(t.corner[0]) + vector(t.corner[1]) + vector(t.corner[2])) / 3;
    for (const Vector3d& x : {middle, vector(t.corner[0])}) {
      const SurfacePoint got = closest_point(placed, x);
      EXPECT_LE(std::abs(got.distance), got.error);
      EXPECT_LE(got.error, 1e-12);
      EXPECT_NEAR(got.gradient.norm(), 1, 1e-12);
      EXPECT_GT(got.gradient.dot(vector(t.normal)), 0);
      EXPECT_EQ(contains(placed, x).answer, contains(placed, x).answer);
    }
  }
}

TEST(Surface, BatchesHaveTheSameBits) {
  const Body body(testing::torus_mesh(0.35, 0.14, 40, 20));
  std::mt19937_64 random(4);
  const PlacedAsset placed{body.asset.view(), testing::random_pose(random, 0.3), 1};
  std::vector<Vector3d> points;
  std::vector<Ray> rays;
  for (int i = 0; i < 50; ++i) {
    points.push_back(testing::random_direction(random));
    rays.push_back({points.back(), testing::random_direction(random)});
  }
  std::vector<SurfacePoint> feet(50);
  std::vector<YesNoAnswer> inside(50);
  std::vector<RayHit> hits(50);
  closest_point(placed, points, feet);
  contains(placed, points, inside);
  raycast(placed, rays, hits);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(closest_point(placed, points[i]).distance, feet[i].distance);
    EXPECT_EQ(contains(placed, points[i]).answer, inside[i].answer);
    EXPECT_EQ(raycast(placed, rays[i]).distance, hits[i].distance);
  }
}

TEST(Surface, WhatIsNotUsableOrHeldIsNotAnswered) {
  const testing::NoFloatTraps with_nan;
  const Body body(testing::cube_mesh());
  const Asset bare = testing::make_random_asset({20, 0.5, {}, 0}, 90);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto expect = [&](const auto& placed, const Ray& ray, QueryStatus status) {
    const RayHit hit = raycast(placed, ray);
    EXPECT_EQ(hit.status, status);
    EXPECT_TRUE(std::isnan(hit.distance) && !hit.hit());
  };
  const auto expect_point = [&](const auto& placed, const Vector3d& x, QueryStatus status) {
    const SurfacePoint foot = closest_point(placed, x);
    EXPECT_EQ(foot.status, status);
    EXPECT_TRUE(std::isnan(foot.distance) && std::isnan(foot.gradient[0]));
    EXPECT_EQ(contains(placed, x).status, status);
    EXPECT_NE(contains(placed, x), YesNo::yes);
  };
  const PlacedAsset good{body.asset.view(), {}, 1};
  const Vector3d zero = Vector3d::Zero();
  expect(PlacedAsset{bare.view(), {}, 1}, {}, QueryStatus::missing_data);
  expect_point(PlacedAsset{bare.view(), {}, 1}, zero, QueryStatus::missing_data);
  for (const Ray& ray : {Ray{zero, zero}, Ray{zero, {nan, 1, 0}}, Ray{{nan, 0, 0}},
                         Ray{{1e90, 0, 0}}, Ray{zero, {kInfinity, 0, 0}},
                         Ray{zero, Vector3d::UnitX(), 0}, Ray{zero, Vector3d::UnitX(), nan}}) {
    expect(good, ray, QueryStatus::invalid_input);
    expect(PlacedShape{BallShape{1}, {}, 1}, ray, QueryStatus::invalid_input);
  }
  for (const Vector3d& x :
       {Vector3d(nan, 0, 0), Vector3d(0, kInfinity, 0), Vector3d(0, 0, 1e300)}) {
    expect_point(good, x, QueryStatus::invalid_input);
    expect_point(PlacedShape{BallShape{1}, {}, 1}, x, QueryStatus::invalid_input);
  }
  std::vector<PlacedAsset> bad(4, good);
  bad[0].pose.q[0] = nan;
  bad[1].scale = -1;
  bad[2].asset = AssetView();
  bad[3].pose.t[2] = kInfinity;
  for (const PlacedAsset& wrong : bad) {
    expect(wrong, {}, QueryStatus::invalid_input);
    expect_point(wrong, zero, QueryStatus::invalid_input);
  }
  expect_point(PlacedShape{BallShape{-1}, {}, 1}, zero, QueryStatus::invalid_input);
  // Directions of any length, and origins far away.
  for (const double length : {1e-300, 1e-10, 1e200, 1e300}) {
    EXPECT_EQ(raycast(good, Ray{zero, Vector3d(length, 0, 0)}).distance, 0.5) << length;
    EXPECT_EQ(
        raycast(PlacedShape{BallShape{0.5}, {}, 1}, Ray{zero, Vector3d(length, 0, 0)}).distance,
        0.5)
        << length;
  }
  EXPECT_NEAR(raycast(good, Ray{{-1e9, 0.1, 0.2}}).distance, 1e9 - 0.5, 1e-6);
  EXPECT_NEAR(closest_point(good, {1e30, 0, 0}).distance, 1e30, 1e20);
}

// For shapes: the ray up to the hit is all outside, or all inside; distances grow by the gradient.
TEST(Surface, ShapesAnswerByTheirDistances) {
  std::mt19937_64 random(5);
  int hits = 0;
  for (const auto& [name, field] : testing::fields())
    for (int i = 0; i < 60; ++i) {
      const std::string kind = name;
      const bool rough = kind == "terrain" || kind == "grid";
      const PlacedShape placed{field, testing::random_pose(random, 0.3), 1.3};
      const Vector3d x = testing::position(testing::random_pose(random, 0.1 + 0.02 * i));
      const SurfacePoint foot = closest_point(placed, x);
      if (kind == "mesh") {
        const PlacedAsset tree{testing::torus().view(), placed.pose, placed.scale};
        EXPECT_EQ(foot.distance, closest_point(tree, x).distance);
      }
      ASSERT_EQ(foot.status, QueryStatus::ok) << name;
      EXPECT_NEAR(foot.gradient.norm(), 1, 1e-12) << name;
      if (!rough) {
        EXPECT_NEAR(closest_point(placed, foot.point).distance, 0, 1e-9) << name;
      }
      EXPECT_EQ(contains(placed, x) == YesNo::yes, foot.distance < 0) << name;
      const Ray ray{x, testing::random_direction(random)};
      const RayHit hit = raycast(placed, ray);
      if (rough || kind == "function") {
        EXPECT_EQ(hit.status, QueryStatus::missing_data);
        continue;
      }
      ASSERT_EQ(hit.status, QueryStatus::ok) << name;
      const double end = hit.hit() ? hit.distance : 5;
      for (int k = 1; k < 50; ++k) {
        const Vector3d on = x + end * k / 50.0 * ray.direction.normalized();
        EXPECT_EQ(contains(placed, on) == YesNo::yes, foot.distance < 0) << name;
      }
      if (!hit.hit()) continue;
      ++hits;
      EXPECT_NEAR(closest_point(placed, hit.point).distance, 0, 1e-12) << name;
      EXPECT_EQ(hit.normal.dot(ray.direction) > 0, foot.distance < 0) << name;
    }
  EXPECT_GT(hits, 60);
}

TEST(Surface, SeparationMatchesAllPairsOfTriangles) {
  std::mt19937_64 random(6);
  Workspace workspace;
  const std::vector<Body> solids = bodies();
  int apart = 0, meet = 0;
  for (std::size_t s = 0; s < solids.size(); ++s)
    for (int i = 0; i < 12; ++i) {
      const Body &of_a = solids[s], &of_b = solids[(s + 2) % solids.size()];
      const PlacedAsset a{of_a.asset.view(), testing::random_pose(random, 0.3), 1};
      const PlacedAsset b{of_b.asset.view(), testing::random_pose(random, 0.24 * i),
                          i % 3 != 0 ? 0.7
                          : i == 3   ? 1e-5
                                     : 0.05};
      const auto triangles_a = of_a.triangles(a), triangles_b = of_b.triangles(b);
      exact::NearestPair least;
      for (const exact::FlatTriangle& x : triangles_a)
        for (const exact::FlatTriangle& y : triangles_b) {
          for (int k = 0; k < 3; ++k) {
            least.take(x.corner[k], nearest_on_triangle(x.corner[k], y));
            least.take(nearest_on_triangle(y.corner[k], x), y.corner[k]);
          }
          take_nearest(x, y, {}, {}, least);
        }
      const bool overlap = testing::exactly(a, b, workspace).volume > 0;
      const double want = overlap ? 0 : std::sqrt(least.squared);
      const Separation got = separation(a, b, {}, workspace);
      ASSERT_EQ(got.status, QueryStatus::ok);
      EXPECT_NEAR(got.distance, want, 1e-13);
      EXPECT_LE(got.distance_min, want);
      EXPECT_GE(got.distance_max, want);
      EXPECT_LE(got.distance_max - got.distance_min, 1e-12 * (1 + 2 * want));
      (overlap ? meet : apart) += 1;
      if (overlap) {
        EXPECT_EQ(got.normal, Vector3d::Zero());
        EXPECT_EQ(got.distance_max, 0);
        continue;
      }
      EXPECT_NEAR(nearest(triangles_a, got.point_a), 0, 1e-13);
      EXPECT_NEAR(nearest(triangles_b, got.point_b), 0, 1e-13);
      EXPECT_LE((got.point_b - got.point_a - got.distance * got.normal).norm(), 1e-13);
      EXPECT_NEAR(separation(b, a, {}, workspace).distance, got.distance, 1e-13);
      for (const std::uint32_t visits : {1u, 3u, 10u}) {
        SeparationSettings settings;
        settings.max_visits = visits;
        const Separation stopped = separation(a, b, settings, workspace);
        EXPECT_LE(stopped.node_visits, visits);
        EXPECT_LE(stopped.distance_min, want);
        EXPECT_GE(stopped.distance_max, want);
      }
    }
  EXPECT_GT(apart, 15);
  EXPECT_GT(meet, 15);
}

/// The bits of two answers: all but the counts.
void expect_same_gap(const Separation& got, const Separation& want, int step) {
  EXPECT_EQ(got.distance, want.distance) << step;
  EXPECT_EQ(got.distance_min, want.distance_min) << step;
  EXPECT_EQ(got.distance_max, want.distance_max) << step;
  EXPECT_EQ(got.point_a, want.point_a) << step;
  EXPECT_EQ(got.point_b, want.point_b) << step;
  EXPECT_EQ(got.normal, want.normal) << step;
  EXPECT_EQ(got.status, want.status) << step;
}

std::vector<Body> small_bodies() {
  std::vector<Body> out;
  out.emplace_back(testing::box_mesh({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}));
  out.emplace_back(testing::box_mesh({-0.5, -0.25, -1e-3}, {0.5, 0.25, 1e-3}));
  out.emplace_back(testing::box_mesh({-0.5, -1e-6, -0.25}, {0.5, 1e-6, 0.25}));
  out.emplace_back(testing::joined(
      testing::box_mesh({-1, -1, -1}, {1, 1, 1}),
      testing::inverted(testing::box_mesh({-0.75, -0.75, -0.75}, {0.75, 0.75, 0.75}))));
  out.emplace_back(testing::icosphere_mesh(1));
  return out;
}

/// Lattice poses, in which faces are flush and edges touch, as often as any; far from the origin
/// too. A distance that is asked for up to a limit has the same bits, or is farther. `./dev soak
/// exact` asks others, by --gtest_random_seed.
TEST(Surface, SeparationOfSmallMeshesIsTheLeast) {
  std::mt19937_64 random(54 + static_cast<unsigned>(GTEST_FLAG_GET(random_seed)));
  std::uniform_int_distribution<int> quarter(-6, 6), turn(0, 3), axis(0, 2);
  Workspace workspace;
  const std::vector<Body> solids = small_bodies();
  int apart = 0, meet = 0, touch = 0;
  for (int i = 0; i < 1500; ++i) {
    const Body &of_a = solids[random() % solids.size()], &of_b = solids[random() % solids.size()];
    Pose pose = testing::random_pose(random, 1.2);
    if (i % 2 == 0) {
      const double half = 0.25 * 3.14159265358979323846 * turn(random);
      pose = {{std::cos(half), 0, 0, 0}, {}};
      pose.q[1 + axis(random)] = std::sin(half);
      for (double& t : pose.t) t = 0.25 * quarter(random);
    }
    const double scale = i % 5 == 0 ? 0.125 : 1;
    const PlacedAsset a{of_a.asset.view(), {}, 1}, b{of_b.asset.view(), pose, scale};
    exact::NearestPair least;
    bool cross = false;
    for (const exact::FlatTriangle& x : of_a.triangles(a))
      for (const exact::FlatTriangle& y : of_b.triangles(b)) {
        for (int k = 0; k < 3; ++k) {
          least.take(x.corner[k], nearest_on_triangle(x.corner[k], y));
          least.take(nearest_on_triangle(y.corner[k], x), y.corner[k]);
        }
        take_nearest(x, y, {}, {}, least);
        cross = cross || exact::cross_exactly(x.corner, y.corner);
      }
    // Ties of touching surfaces may be decided as inside or outside.
    const bool overlap = testing::exactly(a, b, workspace).volume > 1e-14 ||
                         (cross && std::sqrt(least.squared) > 1e-12);
    const double want = overlap ? 0 : std::sqrt(least.squared);
    const Separation got = separation(a, b, {}, workspace);
    ASSERT_EQ(got.status, QueryStatus::ok);
    EXPECT_NEAR(got.distance, want, 1e-13) << i;
    EXPECT_LE(got.distance_min, want) << i;
    EXPECT_GE(got.distance_max, want - 1e-13 * (want < 1e-12)) << i;
    (overlap ? meet : want < 1e-12 ? touch : apart) += 1;
    if (want < 1e-12) continue;
    EXPECT_NEAR(nearest(of_a.triangles(a), got.point_a), 0, 1e-13) << i;
    EXPECT_NEAR(nearest(of_b.triangles(b), got.point_b), 0, 1e-13) << i;
    EXPECT_NEAR(separation(b, a, {}, workspace).distance, got.distance, 1e-13) << i;
    for (const double part : {0.01, 0.5, 1 - 1e-9, 1 + 1e-9, 3.0}) {
      if (std::abs(part - 1) * want < 1e-13) continue;  // as near, to rounding
      const Separation up_to = separation(a, b, {.max_distance = part * want}, workspace);
      const YesNoAnswer within = ist::overlap(a, b, part * want, workspace);
      if (part > 1) {
        expect_same_gap(up_to, got, i);
        EXPECT_EQ(within, YesNo::yes) << i << ' ' << part;
        continue;
      }
      EXPECT_EQ(up_to.status, QueryStatus::ok);
      EXPECT_EQ(up_to.distance, part * want) << i;
      EXPECT_EQ(up_to.distance_min, part * want) << i;
      EXPECT_TRUE(std::isinf(up_to.distance_max)) << i;
      EXPECT_TRUE(std::isnan(up_to.normal[0]) && std::isnan(up_to.point_a[1])) << i;
      EXPECT_EQ(within, YesNo::no) << i << ' ' << part;
    }
  }
  EXPECT_GT(apart, 500);
  EXPECT_GT(meet, 100);
  EXPECT_GT(touch, 25);
}

/// Kept data of a pair changes no bit, whatever the direction of the motion.
TEST(Surface, SeparationOfAMotionsStepsIsThatFromScratch) {
  std::mt19937_64 random(55);
  Workspace kept, scratch;
  const std::vector<Body> solids = bodies();
  int fewer = 0, steps = 0;
  for (std::size_t s = 0; s < solids.size(); ++s)
    for (const double step : {1e-7, 1e-3, 0.05}) {
      const Body &of_a = solids[s], &of_b = solids[(s + 1) % solids.size()];
      Pose pose = testing::random_pose(random, 1.5);
      std::uniform_real_distribution<double> any(-step, step);
      const auto id = static_cast<std::uint32_t>(1 + s);
      for (int i = 0; i < 60; ++i) {
        for (double& t : pose.t) t += any(random) - 0.2 * step * (t > 0 ? 1 : -1);
        for (double& q : pose.q) q += 0.3 * any(random);
        if (i % 20 == 19) pose = testing::random_pose(random, 1.2);
        const PlacedAsset a{of_a.asset.view(), {}, 1}, b{of_b.asset.view(), pose, 0.7};
        const double most = i % 7 == 3 ? 0.2 : 0;
        const Separation want = separation(a, b, {.max_distance = most}, scratch);
        const Separation got = separation(a, b, {.max_distance = most, .pair_id = id}, kept);
        if (std::isnan(want.normal[0])) {
          EXPECT_EQ(got.distance, want.distance);
          EXPECT_TRUE(std::isinf(got.distance_max));
          continue;
        }
        expect_same_gap(got, want, i);
        fewer += got.node_visits + 1 < want.node_visits;
        ++steps;
      }
    }
  // A ball rolls about another: the nearest blocks change again and again.
  const Body ball(testing::icosphere_mesh(4));
  for (int i = 0; i < 1500; ++i) {
    const double at = 2e-3 * i, half = 0.7 * at;
    const Pose pose{{std::cos(half), 0, 0.6 * std::sin(half), 0.8 * std::sin(half)},
                    {2.01 * std::cos(at), 2.01 * std::sin(at), 0.1 * at}};
    const PlacedAsset a{ball.asset.view(), {}, 1}, b{ball.asset.view(), pose, 1};
    expect_same_gap(separation(a, b, {.pair_id = 99}, kept), separation(a, b, {}, scratch), i);
  }
  EXPECT_GT(fewer, 80);
  EXPECT_GT(steps, 800);
}

/// A ball in a cavity that is nearly as far away everywhere, so that most pairs of nodes wait.
TEST(Surface, SeparationNeedsNoCapacity) {
  const Body ball(testing::icosphere_mesh(6));
  const Body hollow(testing::joined(testing::box_mesh({-3, -3, -3}, {3, 3, 3}),
                                    testing::inverted(testing::icosphere_mesh(6))));
  Workspace least(1), most;
  std::mt19937_64 random(11);
  for (const double scale : {0.4, 0.9}) {
    const PlacedAsset a{hollow.asset.view(), {}, 1};
    const PlacedAsset b{ball.asset.view(), testing::random_pose(random, 0), scale};
    const Separation got = separation(a, b, {}, least);
    EXPECT_EQ(got.status, QueryStatus::ok);
    EXPECT_NEAR(got.distance, 1 - scale, 1e-3 * scale);
    EXPECT_EQ(got.distance, separation(a, b, {}, most).distance);
  }
}

/// A solid wholly inside another has distance 0; one in a cavity does not.
TEST(Surface, SeparationOfWhatIsInside) {
  Workspace workspace;
  const Body box(testing::box_mesh({-1, -1, -1}, {1, 1, 1}));
  const std::vector<Body> solids = bodies();
  const PlacedAsset whole{box.asset.view(), {}, 1}, hollow{solids[3].asset.view(), {}, 1};
  const PlacedAsset small{box.asset.view(), {}, 0.5};
  EXPECT_EQ(separation(whole, small, {}, workspace).distance_max, 0);
  EXPECT_EQ(separation(small, whole, {}, workspace).distance_max, 0);
  EXPECT_NEAR(separation(hollow, small, {}, workspace).distance, 0.3, 1e-15);
  EXPECT_NEAR(separation(small, hollow, {}, workspace).distance, 0.3, 1e-15);
  for (const double gap : {0.0, 1e-9, 1e-3, 0.5, 1e3, 1e9, 1e30, 1e50}) {
    const PlacedAsset beside{box.asset.view(), {{1, 0, 0, 0}, {2 + gap, 0, 0}}, 1};
    const Separation got = separation(whole, beside, {}, workspace);
    EXPECT_NEAR(got.distance, gap, 4e-16 * (2 + gap)) << gap;
    EXPECT_LE(got.distance_min, gap);
    EXPECT_GE(got.distance_max, gap);
    EXPECT_LT(got.node_visits, 100u);
  }
}

}  // namespace
}  // namespace ist
