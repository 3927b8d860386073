#include <ist/cover_spheres.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include <cmath>
#include <random>

#include <ist/solid.h>
#include <ist/types.h>

#include "robots/covers/cover_search.h"
#include "support/test_meshes.h"

namespace ist::testing {
namespace {

using Eigen::Vector3d;

TriangleMesh turned(TriangleMesh mesh, double angle, const Vector3d& shift) {
  const Eigen::Matrix3d r =
      Eigen::AngleAxisd(angle, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (Vector3d& v : mesh.vertices) v = r * v + shift;
  return mesh;
}

bool held(const Vector3d& x, const std::vector<CoverSphere>& spheres) {
  for (const CoverSphere& s : spheres)
    if ((x - s.centre).norm() <= s.radius) return true;
  return false;
}

struct Case {
  const char* name;
  TriangleMesh mesh;
};

std::vector<Case> cases() {
  return {{"ball", icosphere_mesh(2)},
          {"torus", torus_mesh(1, 0.3, 24, 12)},
          {"long box", turned(box_mesh({-2, -0.3, -0.1}, {2, 0.3, 0.1}), 0.7, {100, 5, -3})},
          {"overlapping cubes", overlapping_cubes_mesh()},
          {"small and far", turned(box_mesh({0, 0, 0}, {1e-3, 2e-3, 1e-3}), 1.1, {10, 0, 0})}};
}

TEST(CoverSpheres, HoldEveryPointOfTheSolidAndReachNoFurtherThanSaid) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    const ClosedMesh mesh = close_mesh(one.mesh, one.name);
    SphereCoverSettings settings;
    settings.count = 10;
    const SphereCover cover = cover_with_spheres(mesh, settings);
    EXPECT_LE(cover.spheres.size(), 10u);
    EXPECT_TRUE(prove_cover(mesh, cover.spheres).covered);
    const auto solid = make_solid(mesh);
    const Eigen::AlignedBox3d box = solid->bounds();
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> share(-0.5, 1.5);
    std::size_t inside = 0;
    double furthest = 0;
    for (int i = 0; i < 20'000; ++i) {
      const Vector3d x = box.min() + box.sizes().cwiseProduct(
                                         Vector3d(share(random), share(random), share(random)));
      const double depth = -solid->signed_distance(x);
      if (depth > 0) {
        ++inside;
        ASSERT_TRUE(held(x, cover.spheres)) << x.transpose();
      } else if (held(x, cover.spheres)) {
        furthest = std::max(furthest, -depth);
      }
    }
    EXPECT_GT(inside, 50u);
    EXPECT_LE(furthest, cover.protrusion.largest);
    EXPECT_LE(cover.protrusion.largest_seen, cover.protrusion.largest);
    EXPECT_GE(cover.protrusion.largest_seen, 0.95 * cover.protrusion.largest);
    EXPECT_LE(cover.protrusion.mean, cover.protrusion.p95);
    EXPECT_GE(cover.protrusion.volume_ratio, 0.995);
  }
}

TEST(CoverSpheres, TheProofFailsWithoutASphereThatIsNeeded) {
  const ClosedMesh mesh = close_mesh(torus_mesh(1, 0.3, 24, 12), "torus");
  SphereCoverSettings settings;
  settings.count = 12;
  const SphereCover cover = cover_with_spheres(mesh, settings);
  const auto solid = make_solid(mesh);
  std::size_t failed = 0;
  for (std::size_t i = 0; i < cover.spheres.size(); ++i) {
    std::vector<CoverSphere> fewer = cover.spheres;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    const SphereCoverProof proof = prove_cover(mesh, fewer);
    if (proof.covered) continue;
    ++failed;
    EXPECT_GT(proof.gap, 0);
    EXPECT_FALSE(held(proof.where, fewer));
    EXPECT_LT(solid->signed_distance(proof.where), 1e-9);
  }
  EXPECT_GT(failed, cover.spheres.size() / 2);
}

TEST(CoverSpheres, TheProofSeesSpheresThatAreALittleTooSmall) {
  const ClosedMesh mesh = close_mesh(cube_mesh(), "cube");
  const double reach = std::sqrt(0.75);
  EXPECT_TRUE(prove_cover(mesh, std::vector<CoverSphere>{{{0, 0, 0}, reach * (1 + 1e-9)}}).covered);
  EXPECT_FALSE(
      prove_cover(mesh, std::vector<CoverSphere>{{{0, 0, 0}, reach * (1 - 1e-9)}}).covered);
  EXPECT_FALSE(prove_cover(mesh, {}).covered);
  EXPECT_FALSE(prove_cover(mesh, std::vector<CoverSphere>{{{0, 0, 0}, NAN}}).covered);
}

/// Spheres over the whole surface of the cube leave a void in its middle.
TEST(CoverSpheres, TheProofSeesAVoidInside) {
  const ClosedMesh mesh = close_mesh(cube_mesh(), "cube");
  std::vector<CoverSphere> shell;
  for (int i = 0; i <= 10; ++i)
    for (int j = 0; j <= 10; ++j)
      for (int k = 0; k <= 10; ++k)
        if (i % 10 == 0 || j % 10 == 0 || k % 10 == 0)
          shell.push_back({{0.1 * i - 0.5, 0.1 * j - 0.5, 0.1 * k - 0.5}, 0.12});
  const SphereCoverProof open = prove_cover(mesh, shell);
  EXPECT_FALSE(open.covered);
  EXPECT_GT(open.gap, 0);
  EXPECT_LT(open.where.cwiseAbs().maxCoeff(), 0.45);
  shell.push_back({{0, 0, 0}, 0.87});
  EXPECT_TRUE(prove_cover(mesh, shell).covered);
}

/// Every ball around a ball protrudes everywhere by about as much: the search finds no descent.
TEST(CoverSpheres, FewSpheresOnABallAreHardlyWorseThanOneAroundIt) {
  const ClosedMesh mesh = close_mesh(icosphere_mesh(2), "ball");
  const std::vector<CoverSphere> around = {{{0, 0, 0}, 1 + 1e-9}};
  ASSERT_TRUE(prove_cover(mesh, around).covered);
  const double largest = sphere_protrusion(mesh, around).largest;
  for (std::size_t count = 1; count <= 4; count += 3) {
    SphereCoverSettings settings;
    settings.count = count;
    const SphereCover cover = cover_with_spheres(mesh, settings);
    EXPECT_LE(cover.spheres.size(), count);
    EXPECT_TRUE(prove_cover(mesh, cover.spheres).covered);
    EXPECT_LT(cover.protrusion.largest, 1.25 * largest);
  }
}

TEST(CoverSpheres, AsFewAsReachNoFurtherThanAsked) {
  const ClosedMesh mesh = close_mesh(box_mesh({-1, -0.3, -0.1}, {1, 0.3, 0.1}), "box");
  SphereCoverSettings settings;
  settings.max_protrusion = 0.25;
  const SphereCover cover = cover_with_spheres(mesh, settings);
  EXPECT_TRUE(cover.reached);
  EXPECT_LE(cover.protrusion.largest, 0.25);
  EXPECT_TRUE(prove_cover(mesh, cover.spheres).covered);
  ASSERT_GT(cover.spheres.size(), 1u);
  ASSERT_LE(cover.spheres.size(), 16u);  // few enough that the last one is told
  SphereCoverSettings fewer;
  fewer.count = cover.spheres.size() - 1;
  EXPECT_GT(cover_with_spheres(mesh, fewer).protrusion.largest, 0.25);
  settings.count = fewer.count;
  const SphereCover failed = cover_with_spheres(mesh, settings);
  EXPECT_FALSE(failed.reached);
  EXPECT_GT(failed.protrusion.largest, 0.25);
  EXPECT_TRUE(prove_cover(mesh, failed.spheres).covered);
}

TEST(CoverSpheres, ThreadsChangeNothing) {
  const ClosedMesh mesh = close_mesh(overlapping_cubes_mesh(), "cubes");
  SphereCoverSettings settings;
  settings.count = 8;
  settings.threads = 1;
  const SphereCover one = cover_with_spheres(mesh, settings);
  settings.threads = 4;
  const SphereCover four = cover_with_spheres(mesh, settings);
  ASSERT_EQ(one.spheres.size(), four.spheres.size());
  for (std::size_t i = 0; i < one.spheres.size(); ++i) {
    EXPECT_EQ(one.spheres[i].centre, four.spheres[i].centre);
    EXPECT_EQ(one.spheres[i].radius, four.spheres[i].radius);
  }
  EXPECT_EQ(one.protrusion.largest, four.protrusion.largest);
}

TEST(CoverSpheres, SettingsOutOfRangeAndCancelAreErrors) {
  const ClosedMesh mesh = close_mesh(cube_mesh(), "cube");
  SphereCoverSettings settings;
  settings.count = 0;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
  settings.count = 5000;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
  settings.count = 4;
  settings.max_protrusion = NAN;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
  settings = {};
  settings.counts = {4, 4};
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
  settings.counts = {4};
  settings.total = 3;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
  settings.counts = {};
  settings.max_protrusion = 1;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
}

double largest(const std::vector<SphereCover>& covers) {
  double most = 0;
  for (const SphereCover& cover : covers) most = std::max(most, cover.protrusion.largest);
  return most;
}

std::size_t spheres_in(const std::vector<SphereCover>& covers) {
  std::size_t count = 0;
  for (const SphereCover& cover : covers) count += cover.spheres.size();
  return count;
}

TEST(CoverSpheres, ATotalGoesWhereItIsNeeded) {
  // A long bar among small cubes, of which two are the same.
  const TriangleMesh small = box_mesh({0, 0, 0}, {0.1, 0.1, 0.1});
  const std::vector<ClosedMesh> meshes = {
      close_mesh(box_mesh({0, 0, 0}, {4, 0.4, 0.4}), "bar"), close_mesh(small, "small"),
      close_mesh(small, "same"), close_mesh(box_mesh({0, 0, 0}, {0.2, 0.1, 0.1}), "other")};
  SphereCoverSettings settings;
  settings.count = 6;
  const std::vector<SphereCover> even = cover_with_spheres(meshes, settings);
  settings.total = 24;
  const std::vector<SphereCover> shared = cover_with_spheres(meshes, settings);
  EXPECT_LE(spheres_in(shared), 24u);
  EXPECT_GT(shared[0].spheres.size(), 12u);
  EXPECT_LT(largest(shared), 0.6 * largest(even));
  for (std::size_t i = 0; i < meshes.size(); ++i)
    EXPECT_TRUE(prove_cover(meshes[i], shared[i].spheres).covered) << i;
  // Equal meshes are covered once.
  EXPECT_EQ(shared[2].seconds, 0);
  EXPECT_EQ(shared[1].spheres.size(), shared[2].spheres.size());
  // A mesh's own count is not touched, and may be all there is.
  settings.counts = {3, 0, 0, 0};
  EXPECT_EQ(cover_with_spheres(meshes, settings)[0].spheres.size(), 3u);
  settings.counts = {3, 1, 1, 1};
  settings.total = 6;
  EXPECT_EQ(spheres_in(cover_with_spheres(meshes, settings)), 6u);
  settings.total = 5;
  EXPECT_THROW(cover_with_spheres(meshes, settings), Error);
}

/// No other distribution has a smaller maximum of estimates.
TEST(CoverSpheres, SharesAreTheBestOfTheEstimates) {
  const std::vector<TriedCounts> tried = {{{2, 0.5}, {6, 0.1}}, {{1, 0.3}}, {{3, 0.05}, {4, 0.2}}};
  EXPECT_EQ(estimated_protrusion(tried[0], 2), 0.5);
  EXPECT_EQ(estimated_protrusion(tried[0], 1), 1);
  EXPECT_EQ(estimated_protrusion(tried[2], 4), 0.05);  // three of them do better
  EXPECT_NEAR(estimated_protrusion(tried[0], 4), 0.5 * std::pow(0.2, std::log(2) / std::log(3)),
              1e-12);
  const std::vector<std::size_t> copies = {1, 2, 1};
  for (std::size_t total = 4; total < 20; ++total) {
    const auto worst = [&](const std::vector<std::size_t>& counts) {
      double most = 0;
      for (std::size_t i = 0; i < 3; ++i)
        most = std::max(most, estimated_protrusion(tried[i], counts[i]));
      return most;
    };
    const std::vector<std::size_t> shares = share_out(tried, copies, total);
    EXPECT_LE(shares[0] + 2 * shares[1] + shares[2], total);
    for (std::size_t a = 1; a < total; ++a)
      for (std::size_t b = 1; a + 2 * b < total; ++b)
        EXPECT_LE(worst(shares), worst({a, b, total - a - 2 * b})) << total;
  }
}

/// [u] The largest distance, of points of spheres with x above `from`, from the box.
double protrusion_above(double from, const SphereCover& cover, const Eigen::AlignedBox3d& box) {
  double most = 0;
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  for (const CoverSphere& s : cover.spheres)
    for (int i = 0; i < 2000; ++i) {
      const Vector3d x =
          s.centre +
          s.radius * Vector3d(normal(random), normal(random), normal(random)).normalized();
      if (x.x() > from) most = std::max(most, box.exteriorDistance(x));
    }
  return most;
}

TEST(CoverSpheres, ProtrudeLessWhereThereIsLessRoom) {
  const Eigen::AlignedBox3d box(Vector3d(0, 0, 0), Vector3d(4, 0.5, 0.4));
  const ClosedMesh mesh = close_mesh(box_mesh(box.min(), box.max()), "bar");
  SphereCoverSettings settings;
  settings.max_protrusion = 0.1;
  settings.count = 400;
  const SphereCover even = cover_with_spheres(mesh, settings);
  EXPECT_GT(protrusion_above(3.8, even, box), 0.07);
  const double least = 0.03;
  const auto room = [&](const Vector3d& place, const Vector3d&) {
    return place.x() > 3.5 ? least : 0.1;
  };
  settings.room = {room};
  const SphereCover cover = cover_with_spheres(mesh, settings);
  EXPECT_TRUE(prove_cover(mesh, cover.spheres).covered);
  EXPECT_LT(protrusion_above(3.8, cover, box), 1.2 * least);
  EXPECT_LT(cover.protrusion.largest, 0.12);
  // It takes more only where there is less space.
  EXPECT_GT(cover.spheres.size(), even.spheres.size());
  const std::size_t estimate = estimated_count(mesh, 0.1, room);
  EXPECT_LE(cover.spheres.size(), estimate);
  EXPECT_GT(2 * cover.spheres.size(), estimate);
  EXPECT_LT(cover.spheres.size(), estimated_count(mesh, least));
  // Equal meshes with different free space are covered differently.
  settings.room.push_back(nullptr);
  const std::vector<ClosedMesh> both = {mesh, mesh};
  EXPECT_EQ(cover_with_spheres(both, settings)[1].spheres.size(), even.spheres.size());
  settings.room.pop_back();
  EXPECT_THROW(cover_with_spheres(both, settings), Error);
  settings.max_protrusion = 0;
  EXPECT_THROW(cover_with_spheres(mesh, settings), Error);
}

double away(const Vector3d& x, const CoverCapsule& capsule) {
  const Vector3d along = capsule.end - capsule.begin, d = x - capsule.begin;
  const double t = along.isZero() ? 0 : std::clamp(d.dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (d - t * along).norm();
}

double volume_of(const CoverCapsule& c) {
  return M_PI * c.radius * c.radius * ((c.end - c.begin).norm() + 4 * c.radius / 3);
}

/// No larger than the capsule around the mesh along each of many lines through its middle.
TEST(CoverCapsules, HoldTheMeshAndAreSmall) {
  for (const Case& one : cases()) {
    SCOPED_TRACE(one.name);
    const CoverCapsule capsule = cover_with_capsules(close_mesh(one.mesh, one.name))[0];
    Eigen::AlignedBox3d box;
    for (const Vector3d& v : one.mesh.vertices) {
      box.extend(v);
      EXPECT_LE(away(v, capsule), capsule.radius);
    }
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    for (int i = 0; i < 300; ++i) {
      const Vector3d along = Vector3d(normal(random), normal(random), normal(random)).normalized();
      double radius = 0, low = 0, high = 0;
      for (const Vector3d& v : one.mesh.vertices) {
        const Vector3d d = v - box.center();
        radius = std::max(radius, d.cross(along).norm());
      }
      for (const Vector3d& v : one.mesh.vertices) {
        const Vector3d d = v - box.center();
        const double cap = std::sqrt(std::max(0.0, radius * radius - d.cross(along).squaredNorm()));
        low = std::min(low, d.dot(along) + cap);
        high = std::max(high, d.dot(along) - cap);
      }
      EXPECT_LE(volume_of(capsule), (1 + 1e-6) * volume_of({low * along, high * along, radius}));
    }
  }
}

TEST(CoverCapsules, FindACapsule) {
  TriangleMesh mesh = icosphere_mesh(3);
  for (Vector3d& v : mesh.vertices) v = 0.3 * v + Vector3d(0, 0, v.z() > 0 ? 1 : -1);
  mesh = turned(std::move(mesh), 1.2, {5, 6, 7});
  const CoverCapsule capsule = cover_with_capsules(close_mesh(mesh, "capsule"))[0];
  EXPECT_NEAR(volume_of(capsule), M_PI * 0.09 * 2.4, 0.01 * M_PI * 0.09 * 2.4);
  EXPECT_LT((0.5 * (capsule.begin + capsule.end) - Vector3d(5, 6, 7)).norm(), 0.01);
  EXPECT_THROW(cover_with_capsules(ClosedMesh{}), Error);
}

TEST(CoverCapsules, SeveralHoldEveryPointOfTheSolid) {
  std::vector<Case> all = cases();
  // Between its ends there are cuts alone.
  TriangleMesh spike;
  spike.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 10}};
  spike.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  all.push_back({"spike", turned(spike, 0.3, {0, 0, 0})});
  for (const Case& one : all) {
    SCOPED_TRACE(one.name);
    const ClosedMesh mesh = close_mesh(one.mesh, one.name);
    const auto solid = make_solid(mesh);
    const Eigen::AlignedBox3d box = solid->bounds();
    double before = std::numeric_limits<double>::infinity();
    for (const std::size_t count : {1u, 4u}) {
      const std::vector<CoverCapsule> capsules = cover_with_capsules(mesh, count, 2);
      EXPECT_LE(capsules.size(), count);
      double sum = 0;
      for (const CoverCapsule& c : capsules) sum += volume_of(c);
      EXPECT_LE(sum, before * 1.05);  // searched with fewer points
      before = std::min(before, sum);
      std::mt19937_64 random(9);
      std::uniform_real_distribution<double> share(0, 1);
      for (int i = 0; i < 5'000; ++i) {
        const Vector3d x =
            box.min() +
            Vector3d(share(random), share(random), share(random)).cwiseProduct(box.sizes());
        if (solid->signed_distance(x) >= 0) continue;
        EXPECT_TRUE(std::any_of(capsules.begin(), capsules.end(),
                                [&](const CoverCapsule& c) { return away(x, c) <= c.radius; }));
      }
    }
  }
  EXPECT_THROW(cover_with_capsules(close_mesh(box_mesh({0, 0, 0}, {1, 1, 1}), "box"), 13), Error);
}

/// An elbow of two rods needs one for each.
TEST(CoverCapsules, DivideAnElbow) {
  TriangleMesh mesh = box_mesh({0, 0, 0}, {4, 0.5, 0.5});
  const auto more = static_cast<std::uint32_t>(mesh.vertices.size());
  const TriangleMesh other = box_mesh({3.6, 0.1, 0.1}, {4.1, 4, 0.4});
  mesh.vertices.insert(mesh.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (const auto& t : other.triangles)
    mesh.triangles.push_back({t[0] + more, t[1] + more, t[2] + more});
  const ClosedMesh elbow = close_mesh(mesh, "elbow");
  const std::vector<CoverCapsule> two = cover_with_capsules(elbow, 2);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_LT(volume_of(two[0]) + volume_of(two[1]), 0.3 * volume_of(cover_with_capsules(elbow)[0]));
}

/// A sheet as large as the solid, which is no part of it.
TEST(ExtendCover, ContainsASheetBesideTheSolid) {
  TriangleMesh sheet;
  for (int i = 0; i < 4; ++i) sheet.vertices.emplace_back(i & 1 ? 4 : 1, i & 2 ? 1 : -1, 0.3);
  sheet.triangles = {{0, 1, 2}, {2, 1, 3}};
  SphereCover cover;
  cover.spheres = {{{0, 0, 0}, 1.2}};
  cover.protrusion.largest = 0.2;
  extend_cover(sheet, cover);
  EXPECT_GT(cover.spheres.size(), 2u);
  EXPECT_LE(cover.spheres.size(), 9u);
  for (int i = 0; i <= 30; ++i)
    for (int j = 0; j <= 20; ++j) {
      const Eigen::Vector3d x(1 + 0.1 * i, 0.1 * j - 1, 0.3);
      EXPECT_TRUE(std::any_of(cover.spheres.begin(), cover.spheres.end(), [&](const auto& s) {
        return (x - s.centre).norm() <= s.radius;
      })) << x.transpose();
    }
  // No added sphere reaches further from the sheet than reported.
  for (std::size_t k = 1; k < cover.spheres.size(); ++k)
    EXPECT_LE(cover.spheres[k].radius, cover.protrusion.largest);

  // A covered surface stays unchanged.
  for (Eigen::Vector3d& x : sheet.vertices) x *= 0.2;
  cover.spheres = {{{0, 0, 0}, 1.2}};
  cover.protrusion.largest = 0.2;
  extend_cover(sheet, cover);
  EXPECT_EQ(cover.spheres.size(), 1u);
  EXPECT_EQ(cover.protrusion.largest, 0.2);
}

/// Flat layers once made the search creep towards infinity.
TEST(CoverCapsules, OfAFlatRingTakeNoTime) {
  ClosedMesh ring;
  for (std::uint32_t i = 0; i < 400; ++i)
    for (const double z : {0.0, 0.01})
      for (const double r : {0.9, 1.0})
        ring.mesh.vertices.emplace_back(r * std::cos(i * 0.0157079632679),
                                        r * std::sin(i * 0.0157079632679), z);
  for (std::uint32_t i = 0; i < 400; ++i) {
    const std::uint32_t a = 4 * i, b = 4 * ((i + 1) % 400);
    for (const auto& [p, q] : {std::pair{0u, 1u}, {1u, 3u}, {3u, 2u}, {2u, 0u}}) {
      ring.mesh.triangles.push_back({a + p, b + p, b + q});
      ring.mesh.triangles.push_back({a + p, b + q, a + q});
    }
  }
  for (const std::size_t count : {1, 2, 3}) {
    const std::clock_t start = std::clock();
    EXPECT_LE(cover_with_capsules(ring, count).size(), count);
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 10) << count;
  }
}

}  // namespace
}  // namespace ist::testing
