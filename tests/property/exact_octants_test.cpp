#include <gtest/gtest.h>
#include <ist/query.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "mesh/samples/samples.h"
#include "support/exact_pair.h"
#include "support/test_meshes.h"

// Contact patches by Measure::exact: connected parts of an overlap, divided into octants.

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using testing::box_mesh;
using testing::surface;

constexpr double kPi = std::numbers::pi;

/// A pipe about z, from −h to h.
TriangleMesh pipe(double inner, double outer, double h, std::uint32_t around) {
  TriangleMesh mesh;
  const double profile[4][2] = {{inner, -h}, {outer, -h}, {outer, h}, {inner, h}};
  for (const auto& [r, z] : profile)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double turn = 2 * kPi * i / around;
      mesh.vertices.emplace_back(r * std::cos(turn), r * std::sin(turn), z);
    }
  for (std::uint32_t row = 0; row < 4; ++row)
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t j = (i + 1) % around, a = row * around, b = (row + 1) % 4 * around;
      mesh.triangles.push_back({a + i, a + j, b + j});
      mesh.triangles.push_back({a + i, b + j, b + i});
    }
  return mesh;
}

Pose turned(const Point& axis, double angle, const Point& t) {
  const Eigen::Quaterniond q(Eigen::AngleAxisd(angle, axis.normalized()));
  return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
}

TriangleMesh tilted(TriangleMesh mesh) {
  const Eigen::AngleAxisd turn(0.02, Point::UnitY());
  for (Point& x : mesh.vertices) x = turn * x;
  return mesh;
}

class ExactOctants : public ::testing::Test {
 protected:
  const std::vector<ContactPatch>& ask(const PlacedAsset& a, const PlacedAsset& b,
                                       std::size_t capacity = 64) {
    patches_.assign(capacity, {});
    const ContactSettings settings{.measure = Measure::exact};
    const ContactPatches found = contact_patches(a, b, settings, workspace_, patches_);
    whole_ = found.penetration;
    patches_.resize(found.count);
    expect_whole(a, b);
    return patches_;
  }

  const Penetration& whole() const { return whole_; }

 private:
  /// Patches sum to the whole, each is its own wrench, and no two have one name.
  void expect_whole(const PlacedAsset& a, const PlacedAsset& b) {
    double volume = 0;
    Point force = Point::Zero(), torque = Point::Zero(), moment = Point::Zero();
    std::set<std::uint64_t> names;
    const Point origin(b.pose.t);
    const double size = testing::size_of(a) + testing::size_of(b), area = size * size;
    for (const ContactPatch& patch : patches_) {
      EXPECT_GT(patch.volume, 0);
      names.insert(patch.id);
      volume += patch.volume;
      force += patch.force;
      torque += patch.torque;
      moment += patch.volume * patch.centroid;
      const Point again = (patch.point - origin).cross(patch.force) + patch.torsion * patch.normal;
      if (patch.area > 1e-6 * std::cbrt(patch.volume * patch.volume)) {
        EXPECT_LE((again - patch.torque).norm(),
                  1e-13 * (area + (patch.point - origin).norm() * patch.area));
        EXPECT_LE(std::abs((patch.point - patch.centroid).dot(patch.normal)),
                  1e-13 * (size + (patch.point - patch.centroid).norm()));
      }
    }
    EXPECT_EQ(names.size(), patches_.size());
    EXPECT_NEAR(volume, whole_.volume, 1e-15 * area * size);
    EXPECT_LE((force - whole_.force).norm(), 1e-14 * area);
    EXPECT_LE((torque - whole_.torque).norm(), 1e-14 * area * size);
    EXPECT_LE((moment - whole_.volume * whole_.centroid).norm(), 1e-14 * area * area);
  }

  Workspace workspace_;
  std::vector<ContactPatch> patches_;
  Penetration whole_;
};

TEST_F(ExactOctants, SumToTheWholeInAnyPose) {
  const Asset assets[] = {surface(testing::cube_mesh()),
                          surface(testing::torus_mesh(1, 0.4, 48, 24)),
                          surface(testing::icosphere_mesh(3)), surface(pipe(0.3, 0.6, 1, 24))};
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1);
  std::size_t divided = 0;
  for (int i = 0; i < 400; ++i) {
    const PlacedAsset a{assets[i % 4].view(), {}, 1};
    const Point axis(any(random), any(random), any(random)),
        t(any(random), any(random), any(random));
    const PlacedAsset b{assets[i / 4 % 4].view(), turned(axis, 3 * any(random), 1.6 * t),
                        std::exp(any(random))};
    for (const std::size_t capacity : {1, 3, 64}) divided += ask(a, b, capacity).size() > 1 ? 1 : 0;
  }
  EXPECT_GT(divided, 80u);
}

TEST_F(ExactOctants, ALevelFaceHasFourPoints) {
  const Asset table = surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0)));
  const Asset box = surface(testing::cube_mesh());
  for (const double turn : {0.0, 0.3}) {
    const Pose pose = turned(Point::UnitZ(), turn, Point(0.2, 0.1, 0.499));
    ask({table.view(), {}, 1}, {box.view(), pose, 1});
    const std::vector<ContactPatch> patches = ask({table.view(), {}, 1}, {box.view(), pose, 1}, 8);
    ASSERT_EQ(patches.size(), 4u);
    for (const ContactPatch& patch : patches) {
      EXPECT_NEAR(patch.volume, 0.00025, 1e-15);
      EXPECT_NEAR(patch.depth, 0.001, 2e-6);
      EXPECT_GT(patch.normal.z(), 0.9999);
      EXPECT_NEAR((patch.centroid - whole().centroid).norm(), std::sqrt(0.125), 1e-6);
    }
  }
}

/// A box of n × n squares a face.
TriangleMesh fine_box(std::uint32_t n, const Point& lower, const Point& upper) {
  TriangleMesh mesh;
  std::map<std::array<std::uint32_t, 3>, std::uint32_t> numbers;
  const auto vertex = [&](const std::array<std::uint32_t, 3>& at) {
    const auto [it, fresh] = numbers.try_emplace(at, mesh.vertices.size());
    if (fresh)
      mesh.vertices.push_back(lower + (upper - lower).cwiseProduct(Point(at[0], at[1], at[2])) / n);
    return it->second;
  };
  for (std::size_t k = 0; k < 3; ++k)
    for (const std::uint32_t end : {0u, n})
      for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t j = 0; j < n; ++j) {
          const auto corner = [&](std::uint32_t u, std::uint32_t v) {
            std::array<std::uint32_t, 3> at;
            at[k] = end;
            at[(k + 1) % 3] = i + (end == 0 ? v : u);
            at[(k + 2) % 3] = j + (end == 0 ? u : v);
            return vertex(at);
          };
          mesh.triangles.push_back({corner(0, 0), corner(1, 0), corner(1, 1)});
          mesh.triangles.push_back({corner(0, 0), corner(1, 1), corner(0, 1)});
        }
  return mesh;
}

TEST_F(ExactOctants, AFineFaceIsDividedLikeACoarseOne) {
  const Point lower(-0.5, -0.4, -0.3), upper(0.5, 0.4, 0.3);
  const Asset table = surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0))),
              coarse = surface(box_mesh(lower, upper)), fine = surface(fine_box(40, lower, upper));
  const Pose pose = turned(Point(0.003, 0.005, 1), 0.4, Point(0.2, 0.1, 0.295));
  std::vector<ContactPatch> before;
  for (const bool a_is_table : {true, false}) {
    const auto both = [&](const Asset& box) {
      const PlacedAsset t{table.view(), {}, 1}, b{box.view(), pose, 1};
      return a_is_table ? ask(t, b) : ask(b, t);
    };
    const std::vector<ContactPatch> one = both(coarse), other = both(fine);
    ASSERT_GE(one.size(), 4u);
    ASSERT_EQ(one.size(), other.size());
    for (std::size_t i = 0; i < one.size(); ++i) {
      EXPECT_EQ(one[i].id % 8, other[i].id % 8);
      EXPECT_NEAR(one[i].volume, other[i].volume, 1e-13);
      EXPECT_LE((one[i].centroid - other[i].centroid).norm(), 1e-11);
      EXPECT_LE((one[i].force - other[i].force).norm(), 1e-13);
      EXPECT_LE((one[i].torque - other[i].torque).norm(), 1e-13);
      // The same in either order.
      if (!a_is_table) {
        EXPECT_LE((one[i].force + before[i].force).norm(), 1e-13);
      }
    }
    before = one;
  }
}

/// Pressure that grows with the depth turns a tilted box back by ∫ x · depth dA.
TEST_F(ExactOctants, ALevelFaceResistsTilt) {
  const Asset table = surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0)));
  const Asset box = surface(box_mesh(Point(-0.5, -0.3, 0), Point(0.5, 0.3, 1)));
  const Point middle(0.1, 0.2, -0.004);
  for (const Point& axis : {Point(1, 0, 0), Point(0, 1, 0), Point(1, 1, 0), Point(0.2, -1, 0)}) {
    Point of_points[2], of_centroids[2], of_whole[2];
    Point held = Point::Zero();  // by springs that stay where they are
    for (int k = 0; k < 2; ++k) {
      const double angle = k == 0 ? -1e-3 : 1e-3;
      const std::vector<ContactPatch> patches =
          ask({table.view(), {}, 1}, {box.view(), turned(axis, angle, middle), 1}, 8);
      EXPECT_GE(patches.size(), 4u);
      of_points[k] = of_centroids[k] = Point::Zero();
      for (const ContactPatch& patch : patches) {
        const Point push = patch.volume * patch.normal;
        of_points[k] += (patch.point - middle).cross(push);
        of_centroids[k] += (patch.centroid - middle).cross(push);
        if (k == 1) continue;
        const Point turn = axis.normalized().cross(patch.point - middle);
        held += (patch.point - middle).cross(patch.area * turn.z() * Point::UnitZ());
      }
      of_whole[k] = (whole().centroid - middle).cross(whole().volume * Point::UnitZ());
    }
    const auto stiffness = [&](const Point(&moment)[2]) {
      return (moment[0] - moment[1]).dot(axis.normalized()) / 2e-3;
    };
    const double whole = stiffness(of_whole);
    EXPECT_GT(whole, 0.01);
    EXPECT_NEAR(stiffness(of_centroids), whole, 0.02 * whole);
    EXPECT_GT(stiffness(of_points), 0.7 * whole);
    EXPECT_LT(stiffness(of_points), 1.05 * whole);
    EXPECT_GT(held.dot(axis.normalized()), 0.6 * whole);
  }
}

TEST_F(ExactOctants, ARingHoldsItsShaftAllAround) {
  const Asset shaft = surface(pipe(0.5, 1.002, 3, 60));
  const Asset ring = surface(pipe(1, 1.5, 0.4, 48));
  const std::vector<ContactPatch>& patches =
      ask({shaft.view(), {}, 1}, {ring.view(), turned({0, 0, 1}, 0.1, {0, 0, 0.3}), 1});
  EXPECT_LE(whole().force.norm(), 1e-12);
  ASSERT_GE(patches.size(), 8u);
  double highest = 0;
  for (const double turn : {0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0}) {
    const Point direction(std::cos(turn), std::sin(turn), 0);
    double with = 0, against = 0;
    for (const ContactPatch& patch : patches) {
      with += std::max(0.0, patch.force.dot(direction));
      against += std::max(0.0, -patch.force.dot(direction));
      highest = std::max(highest, std::abs(patch.normal.z()));
    }
    EXPECT_GT(with, 1);  // 0.8 · 2 where all of the ring touches: its area over π
    EXPECT_NEAR(with, against, 1e-12);
  }
  EXPECT_LT(highest, 0.05);
}

TEST_F(ExactOctants, AThreadHoldsAllAround) {
  const Asset bolt = surface(make_sample("bolt")), nut = surface(make_sample("nut"));
  const std::vector<ContactPatch>& patches =
      ask({bolt.view(), {}, 1}, {nut.view(), turned({0, 0, 1}, 0, {0, 0, 10.3}), 1}, 16);
  EXPECT_GE(patches.size(), 8u);
  const Point axial(0, 0, whole().force.z() > 0 ? 1 : -1);
  for (int quarter = 0; quarter < 4; ++quarter) {
    const double turn = (quarter + 0.5) * kPi / 2;
    const Point direction(std::cos(turn), std::sin(turn), 0);
    double most = 0;  // of a patch there that pushes along the axis and away from it
    for (const ContactPatch& patch : patches)
      if (patch.point.dot(direction) > 2 && patch.normal.dot(axial) > 0.5)
        most = std::max(most, patch.normal.dot(direction));
    EXPECT_GT(most, 0.1);
  }
}

TEST_F(ExactOctants, ASmallContactIsTheWhole) {
  const Asset table = surface(box_mesh(Point(-9, -9, -1), Point(9, 9, 0)));
  const Asset ball = surface(testing::icosphere_mesh(5));
  for (int k = 0; k < 20; ++k) {
    const Pose pose = turned(Point(1, 2, k), 0.3 * k, {0.1 * k, 0, 0.998});
    const auto& patches = ask({table.view(), {}, 1}, {ball.view(), pose, 1});
    ASSERT_EQ(patches.size(), 1u);
    EXPECT_EQ(patches[0].volume, whole().volume);
    EXPECT_EQ(patches[0].force, whole().force);
    EXPECT_EQ(patches[0].torque, whole().torque);
    EXPECT_EQ(patches[0].centroid, whole().centroid);
  }
}

TEST_F(ExactOctants, AThinContactIsNotCutAlongItsFace) {
  // Aslant, so that what is above the middle is not over what is below it.
  const Asset table = surface(box_mesh(Point(-9, -9, -1), Point(9, 9, 0)));
  const Asset foot = surface(box_mesh(Point(-1, -1, 0), Point(1, 1, 1)));
  for (int k = 0; k < 12; ++k) {
    const double angle = 0.1 + k * std::numbers::pi / 6;
    const Pose pose = turned(Point(std::cos(angle), std::sin(angle), 0), 1e-3, {0, 0, -2e-3});
    EXPECT_EQ(ask({table.view(), {}, 1}, {foot.view(), pose, 1}).size(), 4u) << angle;
  }
}

TEST_F(ExactOctants, ASmallFootKeepsItsPatchWhereRoomIsShort) {
  const Asset table = surface(box_mesh(Point(-9, -9, -1), Point(9, 9, 0)));
  const Asset feet = surface(testing::joined(box_mesh(Point(-1, -1, 0), Point(1, 1, 1)),
                                             box_mesh(Point(4, -0.1, 0), Point(4.2, 0.1, 1))));
  for (const std::size_t capacity : {64, 5, 4, 2}) {
    const auto& patches =
        ask({table.view(), {}, 1}, {feet.view(), {{1, 0, 0, 0}, {0, 0, -0.01}}, 1}, capacity);
    double small = 0;
    for (const ContactPatch& patch : patches) {
      EXPECT_GE(patch.id, 8u);
      if (std::abs(patch.centroid.x() - 4.1) < 0.11) small += patch.volume;
    }
    EXPECT_NEAR(small, 0.2 * 0.2 * 0.01, 1e-14) << capacity;
  }
}

TEST_F(ExactOctants, CrumbsBesideAContactTakeNoneOfItsRoom) {
  const Asset table = surface(box_mesh(Point(-9, -9, -1), Point(9, 9, 0)));
  TriangleMesh feet = box_mesh(Point(-1, -1, 0), Point(1, 1, 1));
  for (int k = -7; k <= 7; ++k)
    feet = testing::joined(feet, box_mesh(Point(1.1, 0.1 * k, 0), Point(1.15, 0.1 * k + 0.05, 1)));
  const Asset foot = surface(feet);
  for (const std::size_t capacity : {16, 8, 5}) {
    const auto& patches =
        ask({table.view(), {}, 1}, {foot.view(), {{1, 0, 0, 0}, {0, 0, -0.01}}, 1}, capacity);
    EXPECT_EQ(patches.size(), capacity);
    const auto quarter = [](const ContactPatch& p) { return std::abs(p.volume - 0.01) < 1e-3; };
    EXPECT_EQ(std::count_if(patches.begin(), patches.end(), quarter), 4) << capacity;
  }
}

TEST_F(ExactOctants, WhatIsDeepIsOne) {
  const Asset block = surface(box_mesh(Point(-3, -3, -3), Point(3, 3, 0)));
  const Asset ball = surface(testing::icosphere_mesh(3));
  EXPECT_EQ(ask({block.view(), {}, 1}, {ball.view(), turned({0, 0, 1}, 0, {0, 0, -0.5}), 1}).size(),
            1u);
  EXPECT_EQ(ask({block.view(), {}, 1}, {ball.view(), turned({0, 0, 1}, 0, {0, 0, -1.5}), 1}).size(),
            1u);
}

/// The largest change of a patch over a step along a path, patches identified by their octants.
TEST_F(ExactOctants, AreContinuous) {
  struct Case {
    Asset a, b;
    Point axis, from, by;
    double angle;
  };
  Case cases[] = {
      {surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0))), surface(testing::cube_mesh()),
       Point(1, 2, 30), Point(0.3, 0, 0.49), Point(0.5, 0.3, 0.008), 0.4},
      {surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0))), surface(testing::cube_mesh()),
       Point(1, 1, 0), Point(0.3, 0, 0.47), Point(0.05, 0.03, 0.2), 0.6},
      // Octants whose planes lie nearly along the contact.
      {surface(tilted(box_mesh(Point(-3, -3, -1), Point(3, 3, 0)))),
       surface(tilted(testing::cube_mesh())), Point(0, 0, 1), Point(0.01, 0, 0.499),
       Point(0, 0, -0.009), 0},
      {surface(pipe(0.5, 1.002, 3, 60)), surface(pipe(1, 1.5, 0.4, 48)), Point(0.01, 0.02, 1),
       Point(0, 0, 0.3), Point(0.001, 0.0005, 0.2), 0.5},
      {surface(box_mesh(Point(-3, -3, -1), Point(3, 3, 0))), surface(testing::icosphere_mesh(3)),
       Point(1, 2, 3), Point(0, 0, 0.97), Point(0.1, 0.2, -0.8), 1.5}};
  for (const Case& c : cases) {
    double jumps[2] = {0, 0};
    for (int fine = 0; fine < 2; ++fine) {
      const int steps = fine == 0 ? 400 : 3200;
      std::map<std::uint64_t, ContactPatch> before;
      for (int i = 0; i <= steps; ++i) {
        const double t = static_cast<double>(i) / steps;
        std::map<std::uint64_t, ContactPatch> now;
        for (const ContactPatch& patch :
             ask({c.a.view(), {}, 1},
                 {c.b.view(), turned(c.axis, c.angle * t, c.from + t * c.by), 1}))
          now[patch.id % 8] = patch;
        const double size = whole().volume;
        if (i > 0)
          for (std::uint64_t octant = 0; octant < 8; ++octant) {
            const ContactPatch &x = before[octant], &y = now[octant];
            jumps[fine] = std::max(
                {jumps[fine], std::abs(x.volume - y.volume) / size, (x.force - y.force).norm()});
          }
        before = now;
      }
    }
    EXPECT_LT(jumps[1], jumps[0] / 4) << jumps[0];
  }
}

}  // namespace
}  // namespace ist
