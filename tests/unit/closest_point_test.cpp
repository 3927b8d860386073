#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "mesh/geometry/closest_point.h"
#include "mesh/mesh_solid.h"
#include "support/quad.h"
#include "support/test_meshes.h"

namespace {

using namespace ist::testing;
using Eigen::Vector3d;
using ist::MeshSolid;

struct Triangle {
  Vector3d a, b, c;
};

using Wide = ist::testing::Quad;

struct WideVector {
  explicit WideVector(const Vector3d& v) : x(v.x()), y(v.y()), z(v.z()) {}
  WideVector(Wide vx, Wide vy, Wide vz) : x(vx), y(vy), z(vz) {}
  Wide x, y, z;
};

WideVector operator-(const WideVector& a, const WideVector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
WideVector operator*(Wide s, const WideVector& a) { return {s * a.x, s * a.y, s * a.z}; }
Wide dot(const WideVector& a, const WideVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
WideVector cross(const WideVector& a, const WideVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

Wide segment_distance2(const WideVector& p, const WideVector& a, const WideVector& b) {
  const WideVector ab = b - a, ap = p - a;
  const Wide length2 = dot(ab, ab);
  Wide t = length2 > 0 ? dot(ap, ab) / length2 : Wide(0);
  t = t < 0 ? Wide(0) : (t > 1 ? Wide(1) : t);
  const WideVector off = ap - t * ab;
  return dot(off, off);
}

/// Distance in twice the digits: the edges, and the plane where the foot is inside.
double reference_distance(const Triangle& t, const Vector3d& point) {
  const WideVector p(point), a(t.a), b(t.b), c(t.c);
  Wide distance2 = std::min(
      {segment_distance2(p, a, b), segment_distance2(p, b, c), segment_distance2(p, c, a)});
  const WideVector n = cross(b - a, c - a);
  const auto left_of = [&](const WideVector& from, const WideVector& to) {
    return dot(cross(to - from, p - from), n) >= 0;
  };
  if (dot(n, n) > 0 && left_of(a, b) && left_of(b, c) && left_of(c, a)) {
    const Wide off = dot(n, p - a);
    distance2 = std::min(distance2, off * off / dot(n, n));
  }
  return std::sqrt(static_cast<double>(distance2));
}

double formula_distance(const Triangle& t, const Vector3d& p) {
  const auto frame = ist::make_triangle_frame(t.a.data(), t.b.data(), t.c.data());
  return std::sqrt(ist::closest_in_frame(frame, p.data()).distance2);
}

class Shapes {
 public:
  Vector3d point(double size) {
    return size * Vector3d(coordinate_(random_), coordinate_(random_), coordinate_(random_));
  }

  /// Ordinary triangles, needles, caps, folded and collapsed ones, down to `thinnest` of their
  /// size.
  Triangle triangle(int i, double thinnest) {
    const Vector3d a = point(1), b = point(1);
    const double thin = std::pow(10, -std::abs(coordinate_(random_)) * -std::log10(thinnest));
    const double along = coordinate_(random_);
    switch (i % 6) {
      case 0:
        return {a, b, point(1)};
      case 1:
        return {a, b, b + point(thin)};  // needle
      case 2:
        return {a, b, a + (0.5 + 0.5 * along) * (b - a) + point(thin)};  // cap
      case 3:
        return {a, a, b};
      case 4:
        return {a, b, (a + b) / 2};
      default:
        return i % 12 == 5 ? Triangle{a, a, a} : Triangle{a, a + point(thin), a + point(thin)};
    }
  }

  /// Somewhere, or close to the triangle.
  Vector3d query(const Triangle& t) {
    const double u = coordinate_(random_), v = coordinate_(random_);
    const Vector3d near = t.a + u * (t.b - t.a) + v * (t.c - t.a);
    const double off = std::pow(10, -12 * std::abs(coordinate_(random_)));
    return coordinate_(random_) < 0 ? point(1.5) : Vector3d(near + point(off));
  }

 private:
  std::mt19937_64 random_{3};
  std::uniform_real_distribution<double> coordinate_{-1, 1};
};

TEST(TriangleDistance, IsAccurateForAnyShape) {
  Shapes shapes;
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Triangle t = shapes.triangle(i, 1e-12);
    const Vector3d p = shapes.query(t);
    const double error = std::abs(formula_distance(t, p) - reference_distance(t, p));
    worst = std::max(worst, error);
    ASSERT_LT(error, 4e-15) << i;  // the packing's δ is 1e-12
  }
  EXPECT_GT(worst, 0);
}

TEST(TriangleDistance, FloatErrorStaysInItsBound) {
  Shapes shapes;
  double worst = 0;
  for (int i = 0; i < 100'000; ++i) {
    const Triangle t = shapes.triangle(i, 1e-6);
    const Vector3d p = shapes.query(t);
    const ist::TriangleFrame<double> exact =
        ist::make_triangle_frame(t.a.data(), t.b.data(), t.c.data());
    ist::TriangleFrame<float> frame;  // as bvh_build.cpp makes it
    for (int k = 0; k < 3; ++k) {
      frame.origin[k] = static_cast<float>(exact.origin[k]);
      frame.u[k] = static_cast<float>(exact.u[k]);
      frame.v[k] = static_cast<float>(exact.v[k]);
      frame.n[k] = static_cast<float>(exact.n[k]);
    }
    frame.length = static_cast<float>(exact.length);
    frame.apex = static_cast<float>(exact.apex);
    frame.height = static_cast<float>(exact.height);
    const Eigen::Vector3f rounded = p.cast<float>();
    const double distance =
        std::sqrt(double(ist::closest_in_frame(frame, rounded.data()).distance2));
    const double bound = ist::float_distance_error(rounded.cwiseAbs().maxCoeff());
    worst = std::max(worst, std::abs(distance - formula_distance(t, p)) / bound);
  }
  EXPECT_LT(worst, 0.5);
  EXPECT_GT(worst, 0.01);  // else the bound costs visits for nothing
}

TEST(TriangleDistance, LanesGiveTheBitsOfOneFloat) {
  const MeshSolid solid(closed(torus_mesh(2, 0.5, 40, 20), "torus"));
  Shapes shapes;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3f p = shapes.point(1).cast<float>();
    const ist::TriangleBlock& block = solid.view().blocks[i];
    ist::BlockPoints points;
    ist::block_points(block, p.data(), points);
    for (int lane = 0; lane < ist::kBvhWidth; ++lane) {
      if (block.triangle[lane] == ist::kNoTriangle) continue;
      ist::TriangleFrame<float> frame;
      for (int k = 0; k < 3; ++k) {
        frame.origin[k] = block.origin[k][lane];
        frame.u[k] = block.u[k][lane];
        frame.v[k] = block.v[k][lane];
        frame.n[k] = block.n[k][lane];
      }
      frame.length = block.length[lane];
      frame.apex = block.apex[lane];
      frame.height = block.height[lane];
      const ist::FramePoint<float> q = ist::closest_in_frame(frame, p.data());
      ASSERT_EQ(q.distance2, points.distance2[lane]);
      ASSERT_EQ(q.x, points.x[lane]);
      ASSERT_EQ(q.y, points.y[lane]);
    }
  }
}

/// Every triangle with its float distance from p, by a search that skips nothing.
std::vector<std::pair<float, std::uint32_t>> all_distances(const ist::MeshView& mesh,
                                                           const float p[3], std::size_t blocks) {
  std::vector<std::pair<float, std::uint32_t>> all;
  for (std::size_t b = 0; b < blocks; ++b) {
    ist::BlockPoints points;
    ist::block_points(mesh.blocks[b], p, points);
    for (int lane = 0; lane < ist::kBvhWidth; ++lane)
      if (mesh.blocks[b].triangle[lane] != ist::kNoTriangle)
        all.emplace_back(points.distance2[lane], mesh.blocks[b].triangle[lane]);
  }
  return all;
}

/// The blocks of a mesh are as many as it takes to name every triangle.
std::size_t block_count(const ist::MeshView& mesh) {
  std::size_t blocks = 0;
  for (std::uint32_t named = 0; named < mesh.triangle_count; ++blocks)
    for (const std::uint32_t t : mesh.blocks[blocks].triangle) named += t != ist::kNoTriangle;
  return blocks;
}

ist::TriangleMesh plate_and_needle() {
  return joined(box_mesh({-1, -1, -1e-6}, {1, 1, 1e-6}),
                box_mesh({-1, 0, 0.5}, {1, 2e-6, 0.5 + 2e-6}));
}

std::vector<ist::TriangleMesh> search_meshes() {
  return {cube_mesh(),        torus_mesh(2, 0.5, 40, 20),
          icosphere_mesh(3),  overlapping_cubes_mesh(),
          plate_and_needle(), needle_tube(150, 0.3)};
}

TEST(NearestTriangle, IsTheMinimumOverAllOfThem) {
  Shapes shapes;
  for (const ist::TriangleMesh& triangles : search_meshes()) {
    const MeshSolid solid(closed(triangles, "mesh"));
    const ist::MeshView& mesh = solid.view();
    const std::size_t blocks = block_count(mesh);
    for (int i = 0; i < 1500; ++i) {
      Eigen::Vector3f p = shapes.point(1.5).cast<float>();
      if (i % 4 == 0) p = (p * 4).array().round() / 8;  // many equal distances
      if (i % 4 == 1) p *= 100;
      const auto all = all_distances(mesh, p.data(), blocks);
      ASSERT_EQ(all.size(), mesh.triangle_count);
      const auto best = *std::min_element(all.begin(), all.end());
      const ist::NearestTriangle nearest = ist::nearest_triangle(mesh, p.data());
      ASSERT_EQ(nearest.distance2, best.first);
      ASSERT_EQ(nearest.triangle, best.second);
    }
  }
}

TEST(NearTriangles, AreAllVisitedOnce) {
  Shapes shapes;
  for (const ist::TriangleMesh& triangles : search_meshes()) {
    const MeshSolid solid(closed(triangles, "mesh"));
    const ist::MeshView& mesh = solid.view();
    const std::size_t blocks = block_count(mesh);
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector3f p = shapes.point(1.2).cast<float>();
      const float radius2 = 0.001f * static_cast<float>(i % 100);
      std::vector<std::uint32_t> visited, expected;
      ist::for_triangles_near(mesh, p.data(), radius2, [&](const ist::NearTriangle& near) {
        if (near.closest.distance2 <= radius2) visited.push_back(near.triangle);
        return radius2;
      });
      for (const auto& [distance2, triangle] : all_distances(mesh, p.data(), blocks))
        if (distance2 <= radius2) expected.push_back(triangle);
      std::sort(visited.begin(), visited.end());
      std::sort(expected.begin(), expected.end());
      ASSERT_EQ(visited, expected);
    }
  }
}

TEST(NearestTriangle, ReturnsTheLimitWhereNothingIsCloser) {
  const MeshSolid cube(closed(cube_mesh(), "cube"));  // half-extent 1 in its frame
  const float p[3] = {0, 0, 0.5f};
  EXPECT_EQ(ist::nearest_triangle(cube.view(), p, 0.2f).triangle, ist::kNoTriangle);
  EXPECT_EQ(ist::nearest_triangle(cube.view(), p, 0.2f).distance2, 0.2f);
  EXPECT_EQ(ist::nearest_triangle(cube.view(), p, 0.3f).distance2, 0.25f);
  const Vector3d q(0, 0, 0.5);
  EXPECT_EQ(cube.closest_point(q, 0.4).distance, 0.4);
  EXPECT_DOUBLE_EQ(cube.closest_point(q, 0.6).distance, 0.5);
  EXPECT_DOUBLE_EQ(cube.closest_point(q, 0.5).distance, 0.5);
}

/// The exact answer is the double formula's minimum over all triangles, to the last bit.
TEST(ClosestPoint, IsTheMinimumOverAllTriangles) {
  Shapes shapes;
  for (const ist::TriangleMesh& triangles : search_meshes()) {
    const MeshSolid solid(closed(triangles, "mesh"));
    const ist::MeshView& mesh = solid.view();
    for (int i = 0; i < 1500; ++i) {
      Vector3d p = shapes.point(1.5);
      if (i % 4 == 0) p = (p * 4).array().round() / 8;
      if (i % 4 == 1) p *= 1e4;
      if (i % 4 == 2)  // on the surface, all but 1e-9
        p = Vector3d(mesh.vertices + 3 * (std::size_t(i) % mesh.vertex_count)) + shapes.point(1e-9);
      double best2 = std::numeric_limits<double>::infinity();
      std::uint32_t best = 0;
      for (std::uint32_t t = 0; t < mesh.triangle_count; ++t) {
        const auto corner = [&](std::size_t k) {
          return mesh.vertices + 3 * std::size_t{mesh.triangles[3 * std::size_t{t} + k]};
        };
        const auto frame = ist::make_triangle_frame(corner(0), corner(1), corner(2));
        const double distance2 = ist::closest_in_frame(frame, p.data()).distance2;
        if (distance2 < best2) {
          best2 = distance2;
          best = t;
        }
      }
      const ist::ClosestPoint closest = solid.closest_point(p);
      ASSERT_EQ(closest.distance, std::sqrt(best2));
      ASSERT_EQ(closest.triangle, best);
      ASSERT_NEAR((closest.point - p).norm(), closest.distance, 1e-15 * (1 + p.norm()));
      // A limit changes only results beyond it.
      ASSERT_EQ(solid.closest_point(p, closest.distance * (1 + 1e-12) + 1e-150).triangle, best);
      ASSERT_EQ(solid.closest_point(p, closest.distance / 2).distance, closest.distance / 2);
    }
  }
}

}  // namespace
