#include "mesh/level_set/polygonise.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <random>

#include <ist/types.h>

#include "mesh/mesh_solid.h"

namespace {

using Eigen::Vector3d;
using ist::Solid;

std::unique_ptr<Solid> box_with_bore() {
  return ist::make_difference(ist::make_box({0.1, 0, 0}, {1, 0.7, 0.4}),
                              ist::make_ball({1, 0.7, 0.4}, 0.5));
}

std::unique_ptr<Solid> snowman() {
  return ist::make_union(ist::make_ball({0, 0, 0}, 1), ist::make_ball({0, 0.3, 1.2}, 0.7));
}

struct Case {
  const char* name;
  std::unique_ptr<Solid> solid;
  double off;  ///< of a cell's edge: no point of the mesh may lie further off the surface
};

std::vector<Case> cases() {
  std::vector<Case> all;
  all.push_back({"ball", ist::make_ball({0.1, 0.2, 0.3}, 0.8), 0.05});
  all.push_back({"box", ist::make_box({0.1, -0.2, 0}, {0.5, 1, 0.25}), 1e-3});
  all.push_back({"torus", ist::make_torus({0, 0.3, 0}, 0.8, 0.3), 0.1});
  all.push_back({"snowman", snowman(), 0.3});
  all.push_back({"bored box", box_with_bore(), 0.3});
  return all;
}

/// Every directed edge is run as often as its reverse.
void expect_cycle(const ist::TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> runs;
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      ++runs[{a, b}];
      --runs[{b, a}];
    }
  for (const auto& [edge, balance] : runs) ASSERT_EQ(balance, 0);
}

/// The surface's distances from the mesh, by walks from random points along the gradient to it.
double sampled_distance_to_mesh(const Solid& solid, const ist::MeshSolid& mesh, int count) {
  std::mt19937_64 random(5);
  const Eigen::AlignedBox3d box = solid.bounds();
  double most = 0;
  for (int i = 0; i < count; ++i) {
    Vector3d x;
    for (int k = 0; k < 3; ++k)
      x[k] = std::uniform_real_distribution<double>(box.min()[k], box.max()[k])(random);
    for (int step = 0; step < 60; ++step) {
      const double s = solid.signed_distance(x);
      Vector3d g;
      for (int k = 0; k < 3; ++k) {
        const Vector3d e = 1e-7 * Vector3d::Unit(k);
        g[k] = (solid.signed_distance(x + e) - solid.signed_distance(x - e)) / 2e-7;
      }
      if (std::abs(s) < 1e-12 || g.norm() < 0.1) break;
      x -= s / g.squaredNorm() * g;
    }
    if (std::abs(solid.signed_distance(x)) < 1e-9)
      most = std::max(most, std::abs(mesh.signed_distance(x)));
  }
  return most;
}

TEST(Polygonise, ErrorsHoldAndMeshesClose) {
  for (const unsigned cells : {24u, 48u})
    for (const Case& c : cases()) {
      SCOPED_TRACE(testing::Message() << c.name << ", " << cells << " cells");
      const auto start = std::chrono::steady_clock::now();
      const ist::Polygonised made = ist::polygonise(*c.solid, cells);
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      const double edge = c.solid->bounds().sizes().maxCoeff() / cells;
      expect_cycle(made.mesh);
      EXPECT_LE(made.error, std::max(0.15, 2.2 * c.off) * edge);
      // From the mesh: exact where the signed distance is, which it is near these surfaces.
      std::mt19937_64 random(3);
      double off = 0;
      for (const auto& t : made.mesh.triangles)
        for (int i = 0; i < 6; ++i) {
          double u = static_cast<double>(random() >> 11) * 0x1p-53;
          double v = static_cast<double>(random() >> 11) * 0x1p-53;
          if (u + v > 1) u = 1 - u, v = 1 - v;
          const Vector3d x = (1 - u - v) * made.mesh.vertices[t[0]] + u * made.mesh.vertices[t[1]] +
                             v * made.mesh.vertices[t[2]];
          off = std::max(off, std::abs(c.solid->signed_distance(x)));
        }
      EXPECT_LE(off, made.error);
      EXPECT_LE(off, c.off * edge);
      const ist::ClosedMesh closed = ist::close_mesh(made.mesh, c.name);
      EXPECT_EQ(closed.report.boundary_edges, 0u);
      EXPECT_EQ(closed.report.flipped_components, 0u);
      EXPECT_EQ(closed.mesh.triangles.size(), made.mesh.triangles.size());
      const ist::MeshSolid mesh(closed);
      EXPECT_LE(sampled_distance_to_mesh(*c.solid, mesh, 3000), made.error);
      // Inside and outside agree off the surface.
      const Eigen::AlignedBox3d box = c.solid->bounds();
      for (int i = 0; i < 5000; ++i) {
        Vector3d x;
        for (int k = 0; k < 3; ++k)
          x[k] = std::uniform_real_distribution<double>(box.min()[k], box.max()[k])(random);
        const double s = c.solid->signed_distance(x);
        ASSERT_TRUE(std::abs(s) <= made.error || (s < 0) == mesh.inside(mesh.frame().to_unit(x)));
      }
      const double volume = c.solid->volume();
      EXPECT_NEAR(mesh.volume(), volume, 3 * edge * edge / 0.25 * volume);
      std::printf(
          "%-10s %3u cells: %7zu triangles, error %.4f of a cell (sampled %.4f), volume off "
          "%.2g, %zu non-manifold edges, %zu self-intersections, %.2f s\n",
          c.name, cells, made.mesh.triangles.size(), made.error / edge, off / edge,
          mesh.volume() / volume - 1, closed.report.nonmanifold_edges,
          closed.report.self_intersections, seconds);
    }
}

TEST(Polygonise, BoxesAreExact) {
  const auto box = ist::make_box({0.1, -0.2, 0}, {0.5, 1, 0.25});
  const ist::MeshSolid mesh(ist::close_mesh(ist::polygonise(*box, 32).mesh, "box"));
  EXPECT_NEAR(mesh.volume(), box->volume(), 1e-5 * box->volume());
}

TEST(Polygonise, SameBytesForAnyNumberOfThreads) {
  const auto solid = box_with_bore();
  const ist::Polygonised all = ist::polygonise(*solid, 40);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const ist::Polygonised alone = ist::polygonise(*solid, 40);
  EXPECT_EQ(all.mesh.triangles, alone.mesh.triangles);
  EXPECT_EQ(all.error, alone.error);
  ASSERT_EQ(all.mesh.vertices.size(), alone.mesh.vertices.size());
  for (std::size_t v = 0; v < all.mesh.vertices.size(); ++v)
    ASSERT_EQ(all.mesh.vertices[v], alone.mesh.vertices[v]);
}

TEST(Polygonise, SizesAndOffsetsDoNotMatter) {
  for (const double size : {1e-9, 1.0, 1e9})
    for (const double offset : {0.0, 1e6}) {
      const auto ball = ist::make_ball(Vector3d(offset * size, 0, 0), size);
      const ist::Polygonised made = ist::polygonise(*ball, 24);
      expect_cycle(made.mesh);
      EXPECT_LE(made.error, 0.3 * size / 12);
      EXPECT_NEAR(ist::MeshSolid(ist::close_mesh(made.mesh, "ball")).volume() / ball->volume(), 1,
                  0.01);
    }
}

/// Solids that so few cells cannot resolve: still closed, and the error shows it.
TEST(Polygonise, WhatIsTooThinCountsIntoTheError) {
  const auto thin = ist::make_union(ist::make_ball({0, 0, 0}, 0.3),
                                    ist::make_box({0.5, 0, 0.01}, {0.5, 0.2, 0.002}));
  const ist::Polygonised made = ist::polygonise(*thin, 16);
  expect_cycle(made.mesh);
  EXPECT_GT(made.error, 0.01);
  const ist::MeshSolid mesh(ist::close_mesh(made.mesh, "thin"));
  EXPECT_LE(sampled_distance_to_mesh(*thin, mesh, 3000), made.error);
  EXPECT_THROW(ist::polygonise(*ist::make_box({0, 0, 0}, {1, 1, 1e-4}), 16), ist::Error);
}

class Faulty final : public Solid {
 public:
  Faulty(double slope, double bound) : slope_(slope), bound_(bound) {}
  double signed_distance(const Vector3d& x) const override { return slope_ * (x.norm() - 1); }
  Eigen::AlignedBox3d bounds() const override {
    return {Vector3d::Constant(-bound_), Vector3d::Constant(bound_)};
  }
  double volume() const override { return 4 * std::numbers::pi / 3; }

 private:
  double slope_, bound_;
};

TEST(Polygonise, RefusesWhatCannotBeDone) {
  const auto ball = ist::make_ball({0, 0, 0}, 1);
  EXPECT_THROW(ist::polygonise(*ball, 7), ist::Error);
  EXPECT_THROW(ist::polygonise(*ball, 1025), ist::Error);
  EXPECT_THROW(ist::polygonise(*ball, 32, [](const ist::Progress&) { return false; }), ist::Error);
  EXPECT_THROW(ist::polygonise(Faulty(1, 0.6), 16), ist::Error);  // reaches out of its bounds
}

TEST(Polygonise, FlatSlopesKeepTheirErrors) {
  const Faulty flat(0.2, 1);
  const ist::Polygonised made = ist::polygonise(flat, 12);
  const ist::MeshSolid mesh(ist::close_mesh(made.mesh, "flat"));
  EXPECT_LE(sampled_distance_to_mesh(flat, mesh, 2000), made.error);
  EXPECT_LE(made.error, 1.0 / 6);
}

}  // namespace
