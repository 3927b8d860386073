#include "packing/cover/cover.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>

#include <ist/bake.h>
#include <ist/types.h>

#include "support/on_host.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::closed;
using testing::cover_on_host;

/// A packing; in a sliver, where packing has no end of equal places, equal spheres at random.
std::vector<Sphere> packed_for_cover(const MeshSolid& solid, std::size_t count) {
  const Vector3d size = solid.bounds().sizes() / solid.frame().scale();
  if (size.minCoeff() < 1e-3) {
    std::mt19937_64 random(5);
    std::vector<Sphere> spheres;
    for (std::size_t k = 0; k < count; ++k) {
      Vector3d x;
      for (int i = 0; i < 3; ++i)
        x[i] = size[i] < 1e-3 ? 0 : size[i] * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5);
      spheres.push_back({static_cast<float>(x.x()), static_cast<float>(x.y()),
                         static_cast<float>(x.z()), 0.4f * static_cast<float>(size.minCoeff())});
    }
    return spheres;
  }
  PackingSettings settings;
  settings.max_spheres = count;
  return pack(solid, settings).spheres;
}

/// How far a point is outside of all cover balls; ≤ 0 if it is covered.
double gap(const Vector3d& x, const std::vector<Sphere>& inner, const std::vector<float>& covers) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < inner.size(); ++k)
    least = std::min(least, (x - Vector3d(inner[k].x, inner[k].y, inner[k].z)).norm() - covers[k]);
  return least;
}

/// Points of the solid: on its surface (the hardest to cover), or drawn from its box.
std::vector<Vector3d> points_of(const MeshSolid& solid, int count) {
  std::mt19937_64 random(11);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const Vector3d low = solid.frame().to_unit(solid.bounds().min());
  const Vector3d size = solid.frame().to_unit(solid.bounds().max()) - low;
  std::vector<Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const Vector3d x = low + Vector3d(uniform(), uniform(), uniform()).cwiseProduct(size);
    points.push_back(solid.closest_point(x).point);
    if (solid.inside(x)) points.push_back(x);
  }
  for (std::uint32_t v = 0; v < solid.view().vertex_count; ++v)
    points.emplace_back(solid.view().vertices + 3 * std::size_t{v});
  return points;
}

double worst_gap(const MeshSolid& solid, const std::vector<Sphere>& inner,
                 const std::vector<float>& covers, int count = 20'000) {
  double worst = -std::numeric_limits<double>::infinity();
  for (const Vector3d& x : points_of(solid, count)) worst = std::max(worst, gap(x, inner, covers));
  return worst;
}

struct Case {
  const char* name;
  TriangleMesh mesh;
};

std::vector<Case> cases() {
  const TriangleMesh plate = testing::box_mesh(Vector3d(0, 0, 0), Vector3d(1, 1, 1e-6));
  return {{"cube", testing::cube_mesh()},
          {"torus", testing::torus_mesh(1, 0.3, 64, 32)},
          {"overlapping shells", testing::overlapping_cubes_mesh()},
          {"cavity", testing::joined(testing::cube_mesh(),
                                     testing::inverted(testing::box_mesh(
                                         Vector3d::Constant(-0.3), Vector3d::Constant(0.3))))},
          {"plate", plate},
          {"needle", testing::box_mesh(Vector3d(0, 0, 0), Vector3d(1, 1e-6, 1e-6))}};
}

TEST(Cover, HoldsEveryPointOfTheSolid) {
  for (const Case& c : cases()) {
    const MeshSolid solid(closed(c.mesh, c.name));
    for (const std::size_t count : {1u, 30u, 300u}) {
      const std::vector<Sphere> inner = packed_for_cover(solid, count);
      const std::vector<float> covers = cover_on_host(solid, inner);
      ASSERT_EQ(covers.size(), inner.size());
      for (std::size_t k = 0; k < inner.size(); ++k) EXPECT_GE(covers[k], inner[k].r);
      EXPECT_LE(worst_gap(solid, inner, covers), 0) << c.name << ", " << count << " spheres";
    }
  }
}

/// The same test sees radii that are too small: those covers are no larger than they have to be.
TEST(Cover, ShrunkRadiiLeaveGaps) {
  for (const Case& c : cases()) {
    const MeshSolid solid(closed(c.mesh, c.name));
    const std::vector<Sphere> inner = packed_for_cover(solid, 30);
    std::vector<float> covers = cover_on_host(solid, inner);
    for (float& r : covers) r *= 0.7f;
    EXPECT_GT(worst_gap(solid, inner, covers), 0) << c.name;
  }
}

TEST(Cover, IsTight) {
  const MeshSolid solid(closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"));
  double before = 1;
  for (const std::size_t count : {100u, 1'000u}) {
    const std::vector<Sphere> inner = packed_for_cover(solid, count);
    const std::vector<float> covers = cover_on_host(solid, inner);
    double sum = 0;  // how far cover balls stick out of the solid
    for (std::size_t k = 0; k < inner.size(); ++k) {
      const Vector3d x(inner[k].x, inner[k].y, inner[k].z);
      sum += covers[k] - solid.closest_point(x).distance;
    }
    const double mean = sum / static_cast<double>(count);
    EXPECT_LT(mean, 0.6 * before);
    before = mean;
  }
  EXPECT_LT(before, 0.03);
}

TEST(Cover, SameBytesForAnyThreadCount) {
  const MeshSolid solid(closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"));
  const std::vector<Sphere> inner = packed_for_cover(solid, 300);
  const std::vector<float> one = cover_on_host(solid, inner, 1);
  for (const unsigned threads : {2u, 7u}) EXPECT_EQ(one, cover_on_host(solid, inner, threads));
}

TEST(Cover, CancelAndNoSpheresAreErrors) {
  const MeshSolid solid(closed(testing::cube_mesh(), "cube"));
  const Sphere ball = {0, 0, 0, 0.5f};
  EXPECT_THROW(cover_on_host(solid, {&ball, 1}, 0, [](const Progress&) { return false; }), Error);
  EXPECT_THROW(cover_on_host(solid, {}), Error);
}

}  // namespace
}  // namespace ist
