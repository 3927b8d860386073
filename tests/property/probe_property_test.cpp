#include <gtest/gtest.h>
#include <ist/mesh.h>

#include <algorithm>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "query/ball_triangle/patch_sums.h"
#include "query/exact/orientation.h"
#include "query/shape/patch_shapes.h"
#include "query/shape/plain_shapes.h"
#include "support/test_meshes.h"
#include "support/turns.h"

// Balls against closed surfaces of triangles: against an integral over slices that shares no
// formula with them, and against what must be so.

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::random_turn;

struct Ball {
  Vector3d centre = Vector3d::Zero();
  double r = 1;
  double whole() const { return 4 * std::numbers::pi / 3 * r * r * r; }
};

struct Part {
  double volume = 0;
  Vector3d gradient = Vector3d::Zero();  ///< by the centre
  Vector3d moment = Vector3d::Zero();    ///< about the centre
};

std::vector<SurfacePatch> patches_of(const TriangleMesh& mesh) {
  std::vector<SurfacePatch> patches;
  for (std::size_t from = 0; from < mesh.triangles.size(); from += kWidth) {
    TriangleCorners corners{};
    for (std::size_t lane = 0; lane < kWidth; ++lane) {
      const auto& t = mesh.triangles[std::min(from + lane, mesh.triangles.size() - 1)];
      for (std::size_t k = 0; k < 3; ++k) {
        const bool none = from + lane >= mesh.triangles.size();
        const Vector3d& v = mesh.vertices[none ? t[0] : t[k]];
        corners.x[k][lane] = v.x();
        corners.y[k][lane] = v.y();
        corners.z[k][lane] = v.z();
      }
    }
    make_patch(corners, patches.emplace_back());
  }
  return patches;
}

ProbeBalls probes_of(const std::vector<Ball>& balls) {
  ProbeBalls probes{};
  Vector3d middle = Vector3d::Zero();
  for (const Ball& ball : balls) middle += ball.centre / static_cast<double>(balls.size());
  for (std::size_t k = 0; k < 3; ++k) probes.origin[k] = middle[static_cast<Eigen::Index>(k)];
  for (std::size_t i = 0; i < balls.size(); ++i) {
    const Vector3d x = balls[i].centre - middle;
    probes.x[i] = x.x(), probes.y[i] = x.y(), probes.z[i] = x.z();
    probes.r[i] = balls[i].r;
    probes.reach = std::max(probes.reach, (x.norm() + balls[i].r) * (1 + 1e-12));
  }
  return probes;
}

/// The parts of at most sixteen balls, as a query takes them; lines to their centres begin at
/// `outside`.
std::vector<Part> parts_of(const TriangleMesh& mesh, const std::vector<Ball>& balls,
                           const Vector3d& outside) {
  const ProbeBalls probes = probes_of(balls);
  const double none[3] = {};
  const std::uint32_t used = (1u << balls.size()) - 1;
  ProbeSums sums;
  std::uint32_t odd = 0;
  for (const SurfacePatch& patch : patches_of(mesh)) {
    const std::uint32_t near = triangles_near(patch, probes.origin, probes.reach);
    if (near != 0) add_patch(patch, near, probes, used, sums);
  }
  const auto point = [](const Vector3d& x) { return exact::Point{x.x(), x.y(), x.z()}; };
  for (const auto& t : mesh.triangles) {
    const exact::Point corners[3] = {point(mesh.vertices[t[0]]), point(mesh.vertices[t[1]]),
                                     point(mesh.vertices[t[2]])};
    for (std::size_t i = 0; i < balls.size(); ++i)
      odd ^= exact::enters(point(outside), point(balls[i].centre), corners, true, {0, 0, 0}) != 0
                 ? 1u << i
                 : 0u;
  }
  if (sums.on_edge != 0) {
    const ProbeBalls moved = away_from_edges(probes, sums.on_edge);
    ProbeSums there;
    for (const SurfacePatch& patch : patches_of(mesh))
      add_patch(patch, 0xffff, moved, sums.on_edge, there);
    put_right(there, probes, sums);
  }
  std::vector<Part> parts;
  const std::uint32_t inside = sides_by_angles(sums, odd) & used;
  for (std::size_t i = 0; i < balls.size(); ++i) {
    ProbeSums alone;
    alone.met = sums.met & 1u << i;
    alone.cones[i] = sums.cones[i];
    alone.area[i] = sums.area[i];
    for (std::size_t k = 0; k < 3; ++k) {
      alone.pull[k][i] = sums.pull[k][i];
      alone.shift[k][i] = sums.shift[k][i];
    }
    const Overlap sum = total_of(probes, alone, inside & 1u << i, none).overlap;
    parts.push_back({sum.volume, sum.force, sum.moment - sum.volume * balls[i].centre});
  }
  return parts;
}

Part part_of(const TriangleMesh& mesh, const Ball& ball,
             const Vector3d& outside = Vector3d(37, 41, 43)) {
  return parts_of(mesh, {ball}, outside)[0];
}

/// Signed area of the triangle of the origin, p and q within the circle around the origin.
double sector_area(const Eigen::Vector2d& p, const Eigen::Vector2d& q, double radius) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const auto arc = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return 0.5 * radius * radius * std::atan2(cross(a, b), a.dot(b));
  };
  const Eigen::Vector2d edge = q - p;
  const double a = edge.squaredNorm(), b = p.dot(edge), c = p.squaredNorm() - radius * radius;
  const double root = b * b - a * c;
  if (!(a > 0)) return 0;
  if (!(root > 0)) return arc(p, q);
  const double t1 = std::clamp((-b - std::sqrt(root)) / a, 0.0, 1.0);
  const double t2 = std::clamp((-b + std::sqrt(root)) / a, 0.0, 1.0);
  const Eigen::Vector2d u = p + t1 * edge, v = p + t2 * edge;
  if (t1 == t2) return arc(p, q);
  return arc(p, u) + 0.5 * cross(u, v) + arc(v, q);
}

/// Area of the solid's section at height z within the ball, by its outline alone.
double section(const TriangleMesh& mesh, const Ball& ball, double z) {
  const double above = z - ball.centre.z();
  const double radius2 = (ball.r - above) * (ball.r + above);
  if (!(radius2 > 0)) return 0;
  double area = 0;
  for (const auto& t : mesh.triangles) {
    // The outline enters through an edge that rises and leaves through one that falls, or the
    // reverse, by the triangle's order of corners.
    Eigen::Vector2d up, down;
    int found = 0;
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.vertices[t[static_cast<std::size_t>(k)]];
      const Vector3d& b = mesh.vertices[t[static_cast<std::size_t>((k + 1) % 3)]];
      if ((a.z() <= z) == (b.z() <= z)) continue;
      const Vector3d x = a + (z - a.z()) / (b.z() - a.z()) * (b - a) - ball.centre;
      (a.z() <= z ? up : down) = x.head<2>();
      ++found;
    }
    if (found == 2) area += sector_area(down, up, std::sqrt(radius2));
  }
  return area;
}

struct Slices {
  double volume = 0, moment_z = 0;
};

/// Integrates slices along z, split at the corners.
Slices by_slices(const TriangleMesh& mesh, const Ball& ball) {
  std::vector<double> at = {ball.centre.z() - ball.r, ball.centre.z() + ball.r};
  for (const Vector3d& v : mesh.vertices)
    if (std::abs(v.z() - ball.centre.z()) < ball.r) at.push_back(v.z());
  std::sort(at.begin(), at.end());
  Slices sum;
  using Rule = boost::math::quadrature::gauss_kronrod<double, 31>;
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    if (!(at[i + 1] - at[i] > 1e-14 * ball.r)) continue;
    sum.volume += Rule::integrate([&](double z) { return section(mesh, ball, z); }, at[i],
                                  at[i + 1], 7, 1e-10);
    sum.moment_z +=
        Rule::integrate([&](double z) { return (z - ball.centre.z()) * section(mesh, ball, z); },
                        at[i], at[i + 1], 7, 1e-10);
  }
  return sum;
}

TriangleMesh tetrahedron(const Vector3d& a, const Vector3d& b, const Vector3d& c,
                         const Vector3d& d) {
  TriangleMesh mesh;
  mesh.vertices = {a, b, c, d};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  return mesh;
}

TriangleMesh turned(TriangleMesh mesh, const Eigen::Quaterniond& q, const Vector3d& shift) {
  for (Vector3d& v : mesh.vertices) v = q * v + shift;
  return mesh;
}

Vector3d in_box(std::mt19937_64& random, const Vector3d& half) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return Vector3d(x, y, z).cwiseProduct(half);
}

struct Facets {
  const char* name;
  TriangleMesh mesh;
  double radius;  ///< of balls that it is met by, the geometric mean
};

std::vector<Facets> shapes() {
  const Vector3d one = Vector3d::Ones();
  std::vector<Facets> all;
  all.push_back({"box", testing::box_mesh(-Vector3d(1, 0.7, 0.4), Vector3d(1, 0.7, 0.4)), 0.4});
  all.push_back(
      {"tetrahedron", tetrahedron({0, 0, 0}, {1, 0.1, 0}, {0.2, 0.9, 0.1}, {0.3, 0.3, 0.8}), 0.25});
  all.push_back({"plate", testing::box_mesh(-Vector3d(1, 1, 0.005), Vector3d(1, 1, 0.005)), 0.1});
  all.push_back(
      {"needle", tetrahedron({0, 0, 0}, {1, 0, 0}, {1, 0.01, 0}, {1, 0.003, 0.01}), 0.05});
  all.push_back({"cavity",
                 testing::joined(testing::box_mesh(-one, one),
                                 testing::inverted(testing::box_mesh(-0.5 * one, 0.6 * one))),
                 0.5});
  all.push_back({"torus", testing::torus_mesh(1, 0.3, 12, 7), 0.3});
  return all;
}

/// Balls about the surface of a mesh, from a tenth to ten times the shape's radius.
Ball random_ball(const Facets& shape, const TriangleMesh& mesh, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto& t = mesh.triangles[random() % mesh.triangles.size()];
  double a = 0.5 + 0.5 * uniform(random), b = 0.5 + 0.5 * uniform(random);
  if (a + b > 1) a = 1 - a, b = 1 - b;
  Ball ball;
  ball.r = shape.radius * std::pow(10.0, uniform(random));
  const Vector3d on = mesh.vertices[t[0]] + a * (mesh.vertices[t[1]] - mesh.vertices[t[0]]) +
                      b * (mesh.vertices[t[2]] - mesh.vertices[t[0]]);
  ball.centre = on + in_box(random, Vector3d::Constant(0.7 * ball.r));
  return ball;
}

TEST(Probe, PartsAgainstSlices) {
  std::mt19937_64 random(11);
  for (const Facets& shape : shapes()) {
    double worst = 0, worst_moment = 0;
    for (int i = 0; i < 30; ++i) {
      const TriangleMesh mesh =
          turned(shape.mesh, random_turn(random), in_box(random, Vector3d::Ones()));
      const Ball ball = random_ball(shape, mesh, random);
      const Part got = part_of(mesh, ball);
      const Slices want = by_slices(mesh, ball);
      const double r3 = ball.r * ball.r * ball.r;
      worst = std::max(worst, std::abs(got.volume - want.volume) / r3);
      worst_moment =
          std::max(worst_moment, std::abs(got.moment.z() - want.moment_z) / (r3 * ball.r));
    }
    std::printf("%s: volume %.2g r³, moment %.2g r⁴\n", shape.name, worst, worst_moment);
    // The accuracy of the integral over slices: its integrand has square roots where a slice
    // begins to touch an edge, and needles have many.
    EXPECT_LE(worst, 3e-8) << shape.name;
    EXPECT_LE(worst_moment, 3e-8) << shape.name;
  }
}

TEST(Probe, GradientIsThatOfTheVolume) {
  std::mt19937_64 random(12);
  for (const Facets& shape : shapes()) {
    double worst = 0;
    for (int i = 0; i < 300; ++i) {
      const TriangleMesh mesh = turned(shape.mesh, random_turn(random), Vector3d::Zero());
      const Ball ball = random_ball(shape, mesh, random);
      const Part here = part_of(mesh, ball);
      const double h = 1e-6 * ball.r;
      for (int k = 0; k < 3; ++k) {
        const Ball more{ball.centre + h * Vector3d::Unit(k), ball.r};
        const Ball less{ball.centre - h * Vector3d::Unit(k), ball.r};
        const double slope = (part_of(mesh, more).volume - part_of(mesh, less).volume) / (2 * h);
        worst = std::max(worst, std::abs(slope - here.gradient[k]) / (ball.r * ball.r));
      }
    }
    // The gradient changes by at most 2πr a length, and jumps nowhere.
    EXPECT_LE(worst, 2 * std::numbers::pi * 1e-6) << shape.name;
  }
}

/// Every triangle cut in three at a point of its own, or in two at the middle of its longest edge
/// together with its neighbour there.
TriangleMesh cut_up(const TriangleMesh& mesh, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0.05, 0.9);
  TriangleMesh cut;
  cut.vertices = mesh.vertices;
  // Four triangles by the middles of the edges, which neighbours share.
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), cut.vertices.size());
    if (fresh) {
      const Vector3d x = 0.5 * (cut.vertices[a] + cut.vertices[b]);
      cut.vertices.push_back(x);
    }
    return it->second;
  };
  for (const auto& t : mesh.triangles) {
    if (random() % 2 == 0) {
      const double a = uniform(random), b = uniform(random) * (1 - a);
      const Vector3d x = cut.vertices[t[0]] + a * (cut.vertices[t[1]] - cut.vertices[t[0]]) +
                         b * (cut.vertices[t[2]] - cut.vertices[t[0]]);
      const auto m = static_cast<std::uint32_t>(cut.vertices.size());
      cut.vertices.push_back(x);
      for (std::size_t k = 0; k < 3; ++k) cut.triangles.push_back({t[k], t[(k + 1) % 3], m});
      continue;
    }
    const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
    cut.triangles.push_back({t[0], ab, ca});
    cut.triangles.push_back({t[1], bc, ab});
    cut.triangles.push_back({t[2], ca, bc});
    cut.triangles.push_back({ab, bc, ca});
  }
  return cut;
}

TEST(Probe, CuttingTrianglesChangesNothing) {
  std::mt19937_64 random(13);
  for (const Facets& shape : shapes()) {
    double worst = 0, worst_pull = 0, worst_moment = 0;
    for (int i = 0; i < 100; ++i) {
      const TriangleMesh mesh = turned(shape.mesh, random_turn(random), Vector3d::Zero());
      const TriangleMesh cut = cut_up(cut_up(mesh, random), random);
      const Ball ball = random_ball(shape, mesh, random);
      const Part a = part_of(mesh, ball), b = part_of(cut, ball);
      const double r = ball.r;
      worst = std::max(worst, std::abs(a.volume - b.volume) / (r * r * r));
      worst_pull = std::max(worst_pull, (a.gradient - b.gradient).norm() / (r * r));
      worst_moment = std::max(worst_moment, (a.moment - b.moment).norm() / (r * r * r * r));
    }
    // Rounding grows as the mesh's size over the ball's, 200 at most, and as the ball's radius over
    // its centre's distance to the nearest edge, some 100 in so many tries.
    EXPECT_LE(worst, 1e-11) << shape.name;
    EXPECT_LE(worst_pull, 1e-12) << shape.name;
    EXPECT_LE(worst_moment, 1e-12) << shape.name;
  }
}

TEST(Probe, ShellsAddUp) {
  std::mt19937_64 random(14);
  for (int i = 0; i < 200; ++i) {
    const TriangleMesh a = turned(testing::box_mesh(-Vector3d::Ones(), Vector3d(-0.1, 1, 1)),
                                  Eigen::Quaterniond::Identity(), Vector3d::Zero());
    const TriangleMesh b = testing::box_mesh(Vector3d(0.1, -1, -1), Vector3d::Ones());
    const Ball ball{in_box(random, Vector3d::Ones()), i % 2 == 0 ? 0.3 : 1.5};
    const Part both = part_of(testing::joined(a, b), ball);
    const Part one = part_of(a, ball), other = part_of(b, ball);
    const double r3 = ball.r * ball.r * ball.r;
    EXPECT_NEAR(both.volume, one.volume + other.volume, 1e-13 * r3);
    EXPECT_LE((both.gradient - one.gradient - other.gradient).norm(), 1e-13 * ball.r * ball.r);
    EXPECT_LE((both.moment - one.moment - other.moment).norm(), 1e-13 * r3 * ball.r);
  }
}

TEST(Probe, FarInsideIsAllAndFarOutsideNothing) {
  const TriangleMesh box = testing::box_mesh(-Vector3d::Ones(), Vector3d::Ones());
  std::mt19937_64 random(15);
  for (int i = 0; i < 200; ++i) {
    const Ball in{in_box(random, Vector3d::Constant(0.8)), 0.19};
    EXPECT_EQ(part_of(box, in).volume, in.whole());
    EXPECT_EQ(part_of(box, in).gradient.norm(), 0);
    Ball out = in;
    out.centre[i % 3] += 2.1;
    EXPECT_EQ(part_of(box, out).volume, 0);
    // A ball that contains the whole box.
    const Ball around{in_box(random, Vector3d::Ones()), 4};
    EXPECT_NEAR(part_of(box, around).volume, 8, 1e-13 * 64);
    EXPECT_LE(part_of(box, around).gradient.norm(), 1e-13 * 16);
  }
}

// A ball whose centre lies on a face, an edge or a corner, to the last digit or a few away.
TEST(Probe, CentreOnTheSurface) {
  std::mt19937_64 random(16);
  const TriangleMesh box = testing::box_mesh(-Vector3d::Ones(), Vector3d::Ones());
  for (const bool aligned : {true, false}) {
    double worst[3] = {}, worst_force[3] = {};
    for (int i = 0; i < 3000; ++i) {
      const Eigen::Quaterniond q = aligned ? Eigen::Quaterniond::Identity() : random_turn(random);
      const Vector3d shift = aligned ? Vector3d::Zero() : in_box(random, Vector3d::Ones());
      const int on = i % 3;  // face, edge, corner
      Vector3d x = in_box(random, Vector3d::Constant(0.5));
      for (int k = 0; k <= on; ++k) x[(i / 3 + k) % 3] = random() % 2 == 0 ? 1 : -1;
      Ball ball{q * x + shift, 0.3};
      if (i % 2 == 0)
        for (int k = 0; k < 3; ++k)
          ball.centre[k] += (static_cast<double>(random() % 9) - 4) * 1e-16;
      const Part got = part_of(turned(box, q, shift), ball);
      const double share[3] = {0.5, 0.25, 0.125};
      worst[on] = std::max(worst[on], std::abs(got.volume / ball.whole() - share[on]));
      // A half of the disc for each face but the one, a quarter at the corner.
      const double disc = std::numbers::pi * ball.r * ball.r;
      const double force[3] = {1, std::sqrt(0.5), std::sqrt(3.0) / 4};
      worst_force[on] = std::max(worst_force[on], std::abs(got.gradient.norm() / disc - force[on]));
    }
    std::printf("%s: face %.2g, edge %.2g, corner %.2g\n", aligned ? "aligned" : "turned", worst[0],
                worst[1], worst[2]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_LE(worst[k], 1e-9) << (aligned ? "aligned " : "turned ") << k;
      EXPECT_LE(worst_force[k], 1e-9) << (aligned ? "aligned " : "turned ") << k;
    }
  }
}

// The error of a part must not grow as its ball's centre nears an edge.
TEST(Probe, CentreNearAnEdge) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> uniform(0, 1);
  const TriangleMesh box = testing::box_mesh(-Vector3d::Ones(), Vector3d::Ones());
  double worst = 0, at = 0;
  for (int i = 0; i < 20'000; ++i) {
    const double away = std::pow(10.0, -17 * uniform(random));
    const double angle = 2 * std::numbers::pi * uniform(random), r = 0.3;
    const double a = away * std::cos(angle), b = away * std::sin(angle);
    const Eigen::Quaterniond q = random_turn(random);
    const Part got = part_of(turned(box, q, Vector3d::Zero()),
                             {q * Vector3d(1 + a * r, 1 + b * r, 0.3 * uniform(random)), r});
    // A quarter ball, and half discs times the displacements; second order in them.
    const double want = 0.25 * 4 * std::numbers::pi / 3 - (a + b) * std::numbers::pi / 2;
    const double error = std::abs(got.volume / (r * r * r) - want) - 2 * away * away;
    if (error > worst) worst = error, at = away;
  }
  std::printf("worst error %.2g r³, %.2g r from the edge\n", worst, at);
  EXPECT_LE(worst, 1e-9);
}

TEST(Probe, FlatTrianglesAreNothing) {
  std::mt19937_64 random(18);
  TriangleMesh box = testing::box_mesh(-Vector3d::Ones(), Vector3d::Ones());
  TriangleMesh more = box;
  // Points, lines that fold back, needles without width.
  more.vertices.push_back(Vector3d(0.25, 0, 1));
  more.vertices.push_back(Vector3d(0.5, 0, 1));
  more.vertices.push_back(Vector3d(1, 0, 1));
  more.triangles.insert(more.triangles.begin() + 3, {8, 9, 10});
  more.triangles.insert(more.triangles.begin() + 5, {9, 8, 10});
  more.triangles.push_back({0, 0, 0});
  more.triangles.push_back({8, 8, 9});
  more.triangles.push_back({9, 8, 8});
  for (int i = 0; i < 100; ++i) {
    const Ball ball{in_box(random, Vector3d::Constant(1.2)), 0.4};
    const Part a = part_of(box, ball), b = part_of(more, ball);
    EXPECT_NEAR(a.volume, b.volume, 1e-13);
    EXPECT_LE((a.gradient - b.gradient).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace ist
