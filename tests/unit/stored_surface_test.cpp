#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/error.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "bake/check/check_surface.h"
#include "bake/surface/build_surface.h"
#include "bake/surface/float_mesh.h"
#include "mesh/exact_sign.h"
#include "query/asset/surface_tree.h"
#include "query/probe/sides.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

// The surface that an asset holds for queries of spheres.

namespace ist {
namespace {

using Corners = CheckedMesh::Corners;
using Point = Eigen::Vector3d;

ClosedMesh closed(TriangleMesh mesh, const char* name) { return close_mesh(std::move(mesh), name); }

PackingSettings settings_of(double error, unsigned threads = 0) {
  PackingSettings settings;
  settings.max_spheres = 20;
  settings.threads = threads;
  settings.surface.error = error;
  return settings;
}

Asset baked(const ClosedMesh& mesh, double error = 0, unsigned threads = 0) {
  return bake(mesh, settings_of(error, threads));
}

void expect_sound_surface(const Asset& asset, const ClosedMesh& mesh) {
  ASSERT_TRUE(asset.view().has_surface());
  std::size_t looked_at = 0;
  for (const Invariant& one : check(asset, mesh)) {
    if (!one.name.starts_with("surface ") && one.name != "mesh near surface") continue;
    ++looked_at;
    EXPECT_EQ(one.violations, 0u) << one.name << ": " << one.worst << " at " << one.where;
  }
  EXPECT_GE(looked_at, 6u);
}

Point on_triangle(const Corners& t, std::mt19937_64& random) {
  double a = static_cast<double>(random() >> 11) * 0x1p-53;
  double b = static_cast<double>(random() >> 11) * 0x1p-53;
  if (a + b > 1) {
    a = 1 - a;
    b = 1 - b;
  }
  return t[0] + a * (t[1] - t[0]) + b * (t[2] - t[0]);
}

/// Distances of random points of either surface from the other, by other code than the proof.
void expect_near(const Asset& asset, const ClosedMesh& mesh) {
  const AssetHeader& header = asset.view().header();
  const SurfaceHeader& surface = *at<SurfaceHeader>(header, header.surface);
  const MeshSolid solid(mesh);
  const CheckedMesh of_mesh(mesh, solid.frame());
  const CheckedMesh of_surface(SurfaceTriangles(header, surface).all());
  std::mt19937_64 random(4);
  double worst = 0;
  for (int i = 0; i < 20'000; ++i) {
    const auto from = [&](const CheckedMesh& side) {
      return on_triangle(side.triangles()[random() % side.triangles().size()], random);
    };
    worst = std::max(worst, of_mesh.nearest(from(of_surface)).first);
    worst = std::max(worst, of_surface.nearest(from(of_mesh)).first);
  }
  EXPECT_LE(worst, surface.error);
  const Point low = solid.frame().to_unit(mesh.report.bounds.min());
  const Point high = solid.frame().to_unit(mesh.report.bounds.max());
  for (int i = 0; i < 5'000; ++i) {
    Point p;
    for (int k = 0; k < 3; ++k)
      p[k] = low[k] + (high[k] - low[k]) * (static_cast<double>(random() >> 11) * 0x1p-53);
    if (of_surface.distance(p, 2 * surface.error) <= surface.error) continue;
    EXPECT_EQ(of_surface.winding(p), of_mesh.winding(p) >= 1 ? 1 : 0);
  }
  std::printf("%s: %u triangles, error %.2g, %.2g seen, unit frame; %llu bytes\n",
              mesh.name.c_str(), surface.triangle_count, surface.error, worst,
              static_cast<unsigned long long>(header.file_bytes - header.surface));
}

/// Every triangle cut into four, over and over.
TriangleMesh finely_cut(TriangleMesh mesh, int times) {
  for (int k = 0; k < times; ++k) {
    TriangleMesh cut{mesh.vertices, {}};
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(cut.vertices.size()));
      if (is_new) cut.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
      return at->second;
    };
    for (const auto& [a, b, c] : mesh.triangles) {
      const std::uint32_t x = middle(a, b), y = middle(b, c), z = middle(c, a);
      cut.triangles.insert(cut.triangles.end(), {{a, x, z}, {x, b, y}, {z, y, c}, {x, y, z}});
    }
    mesh = std::move(cut);
  }
  return mesh;
}

/// Large triangles of the surface lie over many of the mesh, and no part near a side of these is
/// near one of them alone.
TEST(StoredSurface, WhereOneTriangleLiesOverManyInItsPlaneEachHasItsPart) {
  TriangleMesh mesh = finely_cut(testing::cube_mesh(), 6);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Point(1, 2, 3).normalized()).toRotationMatrix();
  for (Point& v : mesh.vertices) v = turn * v;
  const ClosedMesh cube = closed(std::move(mesh), "cube");
  const Asset asset = baked(cube, 1e-4);
  EXPECT_LT(asset.view().surface_triangles(), cube.mesh.triangles.size() / 2);
  expect_sound_surface(asset, cube);
}

TEST(StoredSurface, HoldsTheMeshsOwnTriangles) {
  const ClosedMesh torus = closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
  const Asset asset = baked(torus);
  EXPECT_EQ(asset.view().surface_triangles(), torus.mesh.triangles.size());
  EXPECT_LT(asset.view().surface_error(), 2e-7);
  expect_sound_surface(asset, torus);
  expect_near(asset, torus);
}

/// A plate and a needle thinner than float precision cancel: the error says how far they are.
TEST(StoredSurface, ErrorCountsWhatVanishesInFloats) {
  for (const bool needle : {false, true}) {
    TriangleMesh mesh = testing::cube_mesh();
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const double thin = 1e-10;
    const Point corner(2, 0.2, 0.3);
    const Point u = needle ? Point(0, thin, 0) : Point(0, 0.5, 0);
    for (const Point& p : {corner, Point(corner + Point(1, 0, 0)), Point(corner + u)})
      mesh.vertices.push_back(p);
    for (int i = 0; i < 3; ++i)
      mesh.vertices.push_back(mesh.vertices[first + static_cast<std::size_t>(i)] +
                              Point(0, 0, thin));
    for (const auto& [a, b, c] : std::initializer_list<std::array<std::uint32_t, 3>>{{0, 2, 1},
                                                                                     {3, 4, 5},
                                                                                     {0, 1, 4},
                                                                                     {0, 4, 3},
                                                                                     {1, 2, 5},
                                                                                     {1, 5, 4},
                                                                                     {2, 0, 3},
                                                                                     {2, 3, 5}})
      mesh.triangles.push_back({first + a, first + b, first + c});
    const ClosedMesh thing = closed(std::move(mesh), needle ? "needle" : "plate");
    const Asset asset = baked(thing);
    expect_sound_surface(asset, thing);
    expect_near(asset, thing);
  }
}

TEST(StoredSurface, HoldsThemHoweverMany) {
  const ClosedMesh ball = closed(testing::icosphere_mesh(6), "ball");
  const Asset asset = baked(ball);
  EXPECT_EQ(asset.view().surface_triangles(), ball.mesh.triangles.size());
  EXPECT_LT(asset.view().surface_error(), 2e-7);
  expect_sound_surface(asset, ball);
  expect_near(asset, ball);
}

TEST(StoredSurface, SharedMeshes) {
  for (const char* name : {"oracle/meshes/ico20k.off", "oracle/meshes/dino200k.off"}) {
    IST_NEEDS_SHARED(name);
    const ClosedMesh mesh = close_mesh(load_mesh(testing::shared_path(name)), name);
    const Asset asset = baked(mesh);
    EXPECT_LT(at<SurfaceHeader>(asset.view().header(), asset.view().header().surface)->error, 5e-3);
    expect_sound_surface(asset, mesh);
    expect_near(asset, mesh);
  }
}

TEST(StoredSurface, ErrorIsKeptByAsFewTrianglesAsItAllows) {
  const ClosedMesh ball = closed(testing::icosphere_mesh(4), "ball");
  std::uint32_t last = 0;
  for (const double error : {0.05, 0.01, 2e-3}) {
    const Asset asset = baked(ball, error);
    EXPECT_LE(asset.view().surface_error(), error);
    EXPECT_EQ(asset.view().header().asked_surface_error, error);
    EXPECT_GT(asset.view().surface_triangles(), 2 * last) << error;
    last = asset.view().surface_triangles();
    expect_near(asset, ball);
  }
  EXPECT_LT(last, ball.mesh.triangles.size());
  EXPECT_THROW(baked(ball, 1e-12), Error);
  EXPECT_THROW(baked(ball, -1), Error);
}

TEST(StoredSurface, NoneWhereNoneIsWanted) {
  PackingSettings settings = settings_of(0);
  settings.surface.wanted = false;
  const Asset asset = bake(closed(testing::cube_mesh(), "cube"), settings);
  EXPECT_FALSE(asset.view().has_surface());
  EXPECT_EQ(asset.view().surface_triangles(), 0u);
  EXPECT_EQ(asset.view().surface_error(), 0);
}

TEST(StoredSurface, OfSeveralShellsThoseThatBoundTheSolid) {
  const Point one = Point::Ones();
  const TriangleMesh outer = testing::box_mesh(-one, one);
  const TriangleMesh inner = testing::box_mesh(-one / 2, one / 2);
  const ClosedMesh cavity = closed(testing::joined(outer, testing::inverted(inner)), "cavity");
  const ClosedMesh nested = closed(testing::joined(outer, inner), "nested");
  const ClosedMesh apart =
      closed(testing::joined(outer, testing::box_mesh(2 * one, 3 * one)), "apart");
  for (const auto& [mesh, triangles] : {std::pair(&cavity, 24u), {&nested, 12u}, {&apart, 24u}}) {
    const Asset asset = baked(*mesh);
    EXPECT_EQ(asset.view().surface_triangles(), triangles) << mesh->name;
    expect_sound_surface(asset, *mesh);
  }
}

TEST(StoredSurface, SameBytesForAnyNumberOfThreads) {
  const ClosedMesh ball = closed(testing::icosphere_mesh(6), "ball");
  const ClosedMesh torus = closed(testing::torus_mesh(1.0, 0.4, 100, 60), "torus");
  for (const ClosedMesh* mesh : {&ball, &torus}) {
    const Asset one = baked(*mesh, 0, 1);
    for (const unsigned threads : {2u, 5u}) {
      const Asset other = baked(*mesh, 0, threads);
      EXPECT_TRUE(std::equal(one.bytes().begin(), one.bytes().end(), other.bytes().begin(),
                             other.bytes().end()));
    }
  }
}

TEST(StoredSurface, VertexMapsKeepASurfaceClosed) {
  FloatMesh mesh;
  // A tetrahedron with a copy of its first vertex, and a flat pair of triangles on its base.
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-0.0f, 0, 0}, {1, 1, 0}};
  mesh.triangles = {{0, 2, 1}, {4, 1, 3}, {1, 2, 3}, {2, 0, 3},
                    {1, 2, 5}, {1, 5, 2}, {0, 4, 5}, {5, 4, 0}};
  const std::vector<std::uint32_t> place = reduce(mesh);
  EXPECT_EQ(place[4], place[0]);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  mesh.vertices[3] = {0, 0, 0};  // flat: its base and what covers it cancel
  reduce(mesh);
  EXPECT_TRUE(mesh.triangles.empty());
}

/// Crossings of a segment and a triangle, 0 or 1; nothing where a sign is 0.
std::optional<int> crossings(const Point& p, const Point& q, const Corners& t) {
  const auto side = [](const Point& a, const Point& b, const Point& c, const Point& d) {
    return orient3d_sign(a.data(), b.data(), c.data(), d.data());
  };
  const int from = side(t[0], t[1], t[2], p), to = side(t[0], t[1], t[2], q);
  if (from == 0 || to == 0) return std::nullopt;
  if (from == to) return 0;
  const int a = side(p, q, t[0], t[1]), b = side(p, q, t[1], t[2]), c = side(p, q, t[2], t[0]);
  if (a == 0 || b == 0 || c == 0) return std::nullopt;
  return a == b && b == c ? 1 : 0;
}

// What a query does: from the cell's reference point to the point asked about, through the cell's
// triangles.
TEST(StoredSurface, GridTellsInsideFromOutside) {
  const ClosedMesh torus = closed(testing::torus_mesh(1.0, 0.4, 70, 40), "torus");
  const ClosedMesh cube = closed(testing::cube_mesh(), "cube");
  for (const ClosedMesh* mesh : {&torus, &cube}) {
    const Asset asset = baked(*mesh);
    const SurfaceTree tree = surface_tree(asset.view());
    const SurfaceHeader& surface = *tree.header;
    const MeshSolid solid(*mesh);
    std::mt19937_64 random(8);
    std::size_t in_surface_cells = 0;
    for (int i = 0; i < 20'000; ++i) {
      Point p, reference;
      std::uint64_t cell[3];
      for (int k = 0; k < 3; ++k) {
        const double cells = kBrickWidth * surface.bricks[k];
        const double x = cells * (static_cast<double>(random() >> 11) * 0x1p-53);
        cell[k] = static_cast<std::uint64_t>(x);
        p[k] = surface.low[k] + x * surface.cell;
        reference[k] =
            surface.low[k] + (static_cast<double>(cell[k]) + kCellReference[k]) * surface.cell;
      }
      if (solid.closest_point(p).distance <= surface.error) continue;
      const std::uint32_t code =
          tree.brick_index[cell[0] / 4 +
                           surface.bricks[0] * (cell[1] / 4 + surface.bricks[1] * (cell[2] / 4))];
      bool inside = code == kInsideBrick;
      if (code < surface.brick_count) {
        const CellBrick& brick = tree.bricks[code];
        const std::uint64_t bit = cell[0] % 4 + 4 * (cell[1] % 4) + 16 * (cell[2] % 4);
        inside = (brick.inside >> bit & 1) != 0;
        if ((brick.surface >> bit & 1) != 0) {
          ++in_surface_cells;
          const auto [begin, end] = cell_list(brick, static_cast<std::uint32_t>(bit),
                                              [&](std::uint32_t i) { return tree.cell_ends[i]; });
          std::optional<int> steps = 0;
          for (std::uint32_t e = begin; e < end && steps; ++e) {
            const std::uint32_t triangle = tree.cell_triangles[e];
            Corners t;
            for (int k = 0; k < 3; ++k) {
              float corner[3];
              tree.corner(triangle / kWidth, triangle % kWidth, k, corner);
              t[static_cast<std::size_t>(k)] = {corner[0], corner[1], corner[2]};
            }
            const std::optional<int> more = crossings(reference, p, t);
            steps = more ? std::optional(*steps + *more) : std::nullopt;
          }
          if (!steps) continue;
          inside = inside != (*steps % 2 != 0);
        }
      }
      ASSERT_EQ(inside, solid.inside(p)) << mesh->name << " " << p.transpose();
    }
    EXPECT_GT(in_surface_cells, 1000u);
  }
}

/// The surface of a mesh that meets itself tells its solid: away from the error for certain.
void expect_tells_solid(const Asset& asset, const ClosedMesh& mesh) {
  const AssetHeader& header = asset.view().header();
  const SurfaceHeader& surface = *at<SurfaceHeader>(header, header.surface);
  const CheckedMesh of_surface(SurfaceTriangles(header, surface).all());
  const MeshSolid solid(mesh);
  std::mt19937_64 random(3);
  std::size_t clear = 0;
  for (int i = 0; i < 20'000; ++i) {
    Point p;
    for (int k = 0; k < 3; ++k) p[k] = 2 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1;
    if (of_surface.distance(p, 2 * surface.error) <= surface.error) continue;
    ++clear;
    ASSERT_EQ(of_surface.winding(p) % 2 != 0, solid.inside(p)) << p.transpose();
  }
  EXPECT_GT(clear, 10'000u);
  std::printf("%s: %u triangles, error %.2g, unit frame\n", mesh.name.c_str(),
              surface.triangle_count, surface.error);
}

TEST(StoredSurface, OfAMeshThatReachesFarIntoItselfIsTheUnions) {
  const ClosedMesh two = closed(testing::overlapping_cubes_mesh(), "two cubes");
  ASSERT_TRUE(two.report.meets_itself);
  const Asset asset = baked(two);
  EXPECT_TRUE(asset.view().has_surface());
  EXPECT_LE(asset.view().surface_error(), 1e-6);
  expect_sound_surface(asset, two);
}

TEST(StoredSurface, OfASmallOverlapIsTheUnions) {
  TriangleMesh mesh = testing::icosphere_mesh(4);
  for (const double at : {1.1, 1.102})
    mesh = testing::joined(std::move(mesh),
                           testing::box_mesh(Point::Constant(at), Point::Constant(at + 0.003)));
  const ClosedMesh ball = closed(std::move(mesh), "ball and crumbs");
  ASSERT_TRUE(ball.report.meets_itself);
  const Asset asset = baked(ball);
  EXPECT_GT(asset.view().surface_triangles(), ball.mesh.triangles.size());
  EXPECT_LE(asset.view().surface_error(), 1e-6);
  expect_sound_surface(asset, ball);
  expect_tells_solid(asset, ball);
}

}  // namespace
}  // namespace ist
