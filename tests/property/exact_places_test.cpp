#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "mesh/samples/samples.h"
#include "support/baked.h"
#include "support/exact_pair.h"
#include "support/test_meshes.h"
#include "support/turns.h"

// Exact queries in places where signs vanish, and of odd sizes: what is known of the answer is
// known without a query.

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using testing::box_mesh;
using testing::surface;

Pose shifted(const Point& t) { return {{1, 0, 0, 0}, {t[0], t[1], t[2]}}; }

Pose posed(const Eigen::Quaterniond& q, const Point& t) {
  return {{q.w(), q.x(), q.y(), q.z()}, {t[0], t[1], t[2]}};
}

class ExactPlaces : public ::testing::Test {
 protected:
  Penetration ask(const PlacedAsset& a, const PlacedAsset& b) {
    const Penetration found = testing::exactly(a, b, workspace_);
    EXPECT_EQ(found.status, QueryStatus::ok);
    EXPECT_TRUE(found.centroid.allFinite() && found.force.allFinite() && found.torque.allFinite());
    EXPECT_LE(0, found.volume_min);
    EXPECT_LE(found.volume_min, found.volume);
    EXPECT_LE(found.volume, found.volume_max);
    const testing::ExactCheck check = testing::check_exactly(a, b, workspace_);
    EXPECT_TRUE(check.complete && check.consistent);
    EXPECT_LE(check.gap, testing::gap_bound(check));
    return found;
  }

  /// `truth` within `relative`, and in the interval as far as the truth itself is known.
  void expect_volume(const PlacedAsset& a, const PlacedAsset& b, double truth, double relative) {
    const Penetration found = ask(a, b);
    EXPECT_NEAR(found.volume, truth, relative * truth);
    EXPECT_LE(found.volume_min, truth * (1 + 4e-16));
    EXPECT_GE(found.volume_max, truth * (1 - 4e-16));
    if (truth == 0) {
      EXPECT_LE(found.volume_max, 1e-12 * std::pow(testing::size_of(a), 3));
    }
  }

  Workspace workspace_;
  const Asset cube_ = surface(box_mesh(Point::Zero(), Point::Ones()));
};

/// The overlap of [0, 1] and [t, 1 + t].
double common(double t) { return std::max(0.0, 1 - std::abs(t)); }

TEST_F(ExactPlaces, CubesOnALattice) {
  for (const double step : {0.5, 0.25, 1.0})
    for (int i = 0; i < 343; ++i) {
      const Point t = step * Point(i % 7 - 3, i / 7 % 7 - 3, i / 49 - 3);
      SCOPED_TRACE(::testing::Message() << t.transpose());
      expect_volume({cube_.view(), {}, 1}, {cube_.view(), shifted(t), 1},
                    common(t[0]) * common(t[1]) * common(t[2]), 1e-15);
    }
}

TEST_F(ExactPlaces, SlabsBetweenCubesWithCommonPlanesAndCorners) {
  for (const double thick : {1e-9, 3e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4})
    for (int axis = 0; axis < 3; ++axis)
      for (const double side : {-1.0, 1.0})
        for (const Point& other : {Point(0, 0, 0), Point(0.5, 0, 0), Point(0, 0.25, 0),
                                   Point(0.5, -0.5, 0), Point(1 - thick, 0, 0)}) {
          Point t = Point::Zero();
          t[axis] = side * (1 - thick);
          t[(axis + 1) % 3] = other[0];
          t[(axis + 2) % 3] = other[1];
          SCOPED_TRACE(::testing::Message() << thick << ": " << t.transpose());
          expect_volume({cube_.view(), {}, 1}, {cube_.view(), shifted(t), 1},
                        common(t[0]) * common(t[1]) * common(t[2]), 1e-13);
        }
}

// A thin plate whose faces and edges lie in the planes of a cube.
TEST_F(ExactPlaces, PlatesFlushWithACube) {
  for (const double thick : {1e-9, 1e-7, 1e-5, 1e-3})
    for (const double width : {0.5, 1.0, 2.0}) {
      const Asset plate = surface(box_mesh(Point::Zero(), Point(width, width, thick)));
      for (const double z : {0.0, 1 - thick, 1.0, -thick, 0.5})
        for (const double x : {0.0, 0.25, 0.5, -0.5, 1.0}) {
          const double top = std::min(1.0, z + thick), low = std::max(0.0, z);
          const double along = std::min(1.0, x + width) - std::max(0.0, x);
          // The pose and the plate's own thickness are added in double.
          const double truth = std::max(0.0, along) * std::min(width, 1.0) *
                               (z >= 0 && z + thick <= 1 ? thick : std::max(0.0, top - low));
          SCOPED_TRACE(::testing::Message() << thick << ' ' << width << ' ' << z << ' ' << x);
          const Penetration found =
              ask({cube_.view(), {}, 1}, {plate.view(), shifted({x, 0, z}), 1});
          // If the plate's frame rounds its place, its thickness has that error.
          EXPECT_NEAR(found.volume, truth, 1e-13 * truth + 4e-16 * width * width);
          EXPECT_LE(found.volume_min, truth + 1e-16 * width * width);
          EXPECT_GE(found.volume_max, truth - 1e-16 * width * width);
        }
    }
}

TEST_F(ExactPlaces, NutOnABoltWhoseVerticesLieInCommonPlanes) {
  const Asset bolt = surface(make_sample("bolt"), "bolt"), nut = surface(make_sample("nut"), "nut");
  const std::pair<double, double> truths[] = {
      {9, 52.6749949144343}, {8.5, 34.7409603139359}, {4.25, 12.6758778865385}, {0, 0}};
  for (const auto& [z, truth] : truths) {
    SCOPED_TRACE(z);
    const Penetration found = ask({bolt.view(), {}, 1}, {nut.view(), shifted({0, 0, z}), 1});
    EXPECT_NEAR(found.volume, truth, 2e-14 * truth);
    EXPECT_LE(found.volume_min, truth + 1e-13);
    EXPECT_GE(found.volume_max, truth - 1e-13);
    if (truth == 0) {
      EXPECT_LE(found.volume_max, 1e-10);
    }
  }
}

TEST_F(ExactPlaces, NeedlesThroughAPlate) {
  const Asset plate = surface(box_mesh({-1, -1, -0.0625}, {1, 1, 0.0625}));
  for (int k = 4; k <= 40; k += 6) {
    const double w = std::ldexp(1, -k);
    const Asset needle = surface(box_mesh({-w, -w, -1}, {w, w, 1}));
    for (const Point& t : {Point(0, 0, 0), Point(0.25, 0.125, 0.5), Point(1, 0, 0),
                           Point(1, 1, 0.25), Point(0, 0, 1)}) {
      double truth = t.z() == 1 ? 0.0625 : 0.125;
      for (int axis = 0; axis < 2; ++axis) truth *= t[axis] == 1 ? w : 2 * w;
      SCOPED_TRACE(::testing::Message() << k << ": " << t.transpose());
      // Sums about a point of size 1 away from an overlap of width w keep w's digits, no more.
      const double precision = 1e-13 + 1e-16 / w;
      expect_volume({plate.view(), {}, 1}, {needle.view(), shifted(t), 1}, truth, precision);
      expect_volume({needle.view(), shifted(t), 1}, {plate.view(), {}, 1}, truth, precision);
    }
  }
}

// A blade: a tetrahedron with two edges of length 1 that are 2⁻ᵏ apart. The plane between them
// leaves half of it.
TEST_F(ExactPlaces, SliversInHalves) {
  const Asset cube = surface(box_mesh({-2, -2, 0}, {2, 2, 4}));
  for (int k = 1; k <= 40; k += 3) {
    const double w = std::ldexp(1, -k);
    TriangleMesh sliver;
    sliver.vertices = {{-0.5, 0, -w}, {0.5, 0, -w}, {0, -0.5, w}, {0, 0.5, w}};
    sliver.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    const Asset asset = surface(sliver);
    const double whole = asset.view().volume();
    EXPECT_NEAR(whole, w / 3, 1e-15 * w);
    SCOPED_TRACE(k);
    expect_volume({cube.view(), {}, 1}, {asset.view(), {}, 1}, w / 6, 1e-13);
    expect_volume({cube.view(), {}, 1}, {asset.view(), shifted({0, 0, -w}), 1}, 0, 0);
    expect_volume({cube.view(), {}, 1}, {asset.view(), shifted({0, 0, w}), 1}, w / 3, 1e-13);
  }
}

TEST_F(ExactPlaces, SizesFromTheTinyToTheHuge) {
  for (const double size : {1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9}) {
    const Asset own = surface(box_mesh(Point::Zero(), size * Point::Ones()));
    for (const bool by_scale : {false, true}) {
      const PlacedAsset a =
          by_scale ? PlacedAsset{cube_.view(), {}, size} : PlacedAsset{own.view(), {}, 1};
      PlacedAsset b = a;
      b.pose = shifted(size * Point(0.5, 0.25, 0.75));
      SCOPED_TRACE(::testing::Message() << size << ' ' << by_scale);
      const double truth = 0.5 * 0.75 * 0.25 * size * size * size;
      const Penetration found = ask(a, b);
      EXPECT_NEAR(found.volume, truth, 4e-15 * truth);
      EXPECT_LE(found.volume_min, truth * (1 + 1e-15));
      EXPECT_GE(found.volume_max, truth * (1 - 1e-15));
      EXPECT_NEAR(found.force.x() / (size * size), 0.75 * 0.25, 1e-14);
    }
  }
}

// Corners of a small cube in the faces of a large one.
TEST_F(ExactPlaces, RatiosToAMillionth) {
  for (int k = 2; k <= 20; k += 3) {
    const double s = std::ldexp(1, -k);
    for (int i = 0; i < 27; ++i) {
      const double at[3] = {-s / 2, 0.5, 1 - s / 4};
      const double inside[3] = {s / 2, s, s / 4};
      const int cell[3] = {i % 3, i / 3 % 3, i / 9};
      double truth = 1;
      Point t;
      for (int axis = 0; axis < 3; ++axis) {
        t[axis] = at[cell[axis]];
        truth *= inside[cell[axis]];
      }
      SCOPED_TRACE(::testing::Message() << k << ": " << t.transpose());
      expect_volume({cube_.view(), {}, 1}, {cube_.view(), shifted(t), s}, truth, 1e-13);
      expect_volume({cube_.view(), shifted(t), s}, {cube_.view(), {}, 1}, truth, 1e-13);
    }
  }
}

// Coordinates of 2²⁰ and poses that bring them back, all without a rounding.
TEST_F(ExactPlaces, FarFromTheOrigin) {
  const Point far(0x1p20, -0x1p21, 0x1p19);
  const Asset moved = surface(box_mesh(far, far + Point::Ones()));
  const Point t(0.5, -0.25, 0.125);
  const double truth = 0.5 * 0.75 * 0.875;
  for (const auto& [a, b] : {std::pair(PlacedAsset{moved.view(), shifted(-far), 1},
                                       PlacedAsset{cube_.view(), shifted(t), 1}),
                             std::pair(PlacedAsset{cube_.view(), shifted(far), 1},
                                       PlacedAsset{moved.view(), shifted(t), 1}),
                             std::pair(PlacedAsset{moved.view(), shifted(far), 1},
                                       PlacedAsset{cube_.view(), shifted(2 * far + t), 1})}) {
    const Penetration found = ask(a, b);
    EXPECT_NEAR(found.volume, truth, 1e-14);
    EXPECT_LE(found.volume_min, truth);
    EXPECT_GE(found.volume_max, truth);
  }
}

struct Pair {
  PlacedAsset a, b;
};

/// Torus and ball, ball and box, bolt and nut in random poses in which they meet.
class ExactMotions : public ExactPlaces {
 protected:
  std::vector<Pair> pairs() {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto draw = [&] { return Point(unit(random), unit(random), unit(random)); };
    std::vector<Pair> made;
    for (int i = 0; i < 60; ++i) {
      const Asset& a = assets_[static_cast<std::size_t>(i) % assets_.size()];
      const Asset& b = assets_[static_cast<std::size_t>(i / 2) % assets_.size()];
      made.push_back(
          {{a.view(), posed(testing::random_turn(random), draw()), 1},
           {b.view(), posed(testing::random_turn(random), draw()), std::pow(2, unit(random))}});
    }
    return made;
  }

  const std::vector<Asset> assets_ = [] {
    std::vector<Asset> made;
    made.push_back(surface(testing::torus_mesh(1, 0.4, 40, 20)));
    made.push_back(surface(testing::icosphere_mesh(3)));
    made.push_back(surface(box_mesh({-1, -0.5, -0.7}, {0.8, 0.6, 0.9})));
    return made;
  }();
};

Point origin(const PlacedAsset& placed) {
  return {placed.pose.t[0], placed.pose.t[1], placed.pose.t[2]};
}

Eigen::Quaterniond turn_of(const PlacedAsset& placed) {
  const double* q = placed.pose.q;
  return {q[0], q[1], q[2], q[3]};
}

TEST_F(ExactMotions, TheSameWithAAndBExchanged) {
  int meeting = 0;
  for (const auto& [a, b] : pairs()) {
    const Penetration found = ask(a, b), other = ask(b, a);
    meeting += found.volume > 0 ? 1 : 0;
    EXPECT_NEAR(found.volume, other.volume, 1e-14 * (1 + found.volume));
    EXPECT_LE(std::max(found.volume_min, other.volume_min),
              std::min(found.volume_max, other.volume_max));
    EXPECT_TRUE(found.force.isApprox(other.force, 1e-12) ||
                (found.force + other.force).norm() < 1e-13);
    // The wrench on the other solid, about the other origin.
    const Point torque = other.torque + (origin(a) - origin(b)).cross(other.force);
    EXPECT_LE((found.torque + torque).norm(), 1e-13);
    EXPECT_LE((found.centroid - other.centroid).norm() * found.volume, 1e-13);
  }
  EXPECT_GE(meeting, 40);
}

TEST_F(ExactMotions, TheSameInACommonMotion) {
  std::mt19937_64 random(6);
  for (const auto& [a, b] : pairs()) {
    const Eigen::Quaterniond turn = testing::random_turn(random);
    const Point shift(3, -1, 2);
    const auto carried = [&](PlacedAsset placed) {
      placed.pose = posed(turn * turn_of(placed), turn * origin(placed) + shift);
      return placed;
    };
    const Penetration found = ask(a, b), other = ask(carried(a), carried(b));
    // The poses round, so that B is elsewhere by some 1e-15.
    EXPECT_NEAR(found.volume, other.volume, 2e-14);
    EXPECT_LE(std::max(found.volume_min, other.volume_min),
              std::min(found.volume_max, other.volume_max));
    EXPECT_LE((turn * found.force - other.force).norm(), 2e-13);
    EXPECT_LE((turn * found.torque - other.torque).norm(), 2e-13);
    if (found.volume > 1e-3) {
      EXPECT_LE((turn * found.centroid + shift - other.centroid).norm(), 1e-11);
    }
  }
}

// A polyhedron's volume has a gradient that jumps nowhere: differences of second order see it.
TEST_F(ExactMotions, GradientsAreThoseOfTheVolume) {
  constexpr double kStep = 1e-5;
  for (const auto& [a, b] : pairs()) {
    const Penetration found = ask(a, b);
    for (int axis = 0; axis < 3; ++axis) {
      const Point unit = Point::Unit(axis);
      const auto volume = [&](double shift, double turn) {
        PlacedAsset moved = b;
        moved.pose = posed(Eigen::Quaterniond(Eigen::AngleAxisd(turn, unit)) * turn_of(b),
                           origin(b) + shift * unit);
        return testing::exactly(a, moved, workspace_).volume;
      };
      const double by_shift = (volume(kStep, 0) - volume(-kStep, 0)) / (2 * kStep);
      const double by_turn = (volume(0, kStep) - volume(0, -kStep)) / (2 * kStep);
      EXPECT_NEAR(found.force[axis], -by_shift, 2e-7);
      EXPECT_NEAR(found.torque[axis], -by_turn, 2e-7);
    }
  }
}

TEST_F(ExactMotions, CentroidIsThatOfTheOverlap) {
  // Known for boxes; for a contained solid, its own volume.
  const Penetration found =
      ask({cube_.view(), {}, 1}, {cube_.view(), shifted({0.5, 0.25, -0.75}), 1});
  EXPECT_LE((found.centroid - Point(0.75, 0.625, 0.125)).norm(), 1e-15);
  const Asset large = surface(box_mesh({-3, -3, -3}, {3, 3, 3}));
  for (const Asset& asset : assets_) {
    const PlacedAsset inside{asset.view(), shifted({0.3, -0.2, 0.1}), 1};
    const Penetration all = ask({large.view(), {}, 1}, inside);
    const double volume = asset.view().volume();
    EXPECT_NEAR(all.volume, volume, 1e-13 * volume);
    EXPECT_LE(all.force.norm(), 1e-13);
    EXPECT_LE(all.torque.norm(), 1e-13);
    const Penetration round = ask(inside, {large.view(), {}, 1});
    EXPECT_NEAR(round.volume, volume, 1e-13 * volume);
    EXPECT_LE((round.centroid - all.centroid).norm(), 1e-14);
  }
}

class ExactLimits : public ExactPlaces {
 protected:
  const Asset ball_ = testing::baked(testing::icosphere_mesh(4), "ball", 200);
  const Asset alone_ = surface(testing::icosphere_mesh(4), "ball alone");
  const Pose near_ = shifted({0.9, 0.2, -0.1});
};

TEST_F(ExactLimits, GiveTheAnswerOfTheSpheres) {
  const PlacedAsset a{ball_.view(), {}, 1}, b{ball_.view(), near_, 1};
  Workspace small(16);
  PenetrationSettings exact, spheres;
  exact.measure = Measure::exact;
  const Penetration truth = penetration(a, b, exact, workspace_);
  ASSERT_EQ(truth.status, QueryStatus::ok);
  PenetrationSettings limited = exact;
  limited.max_visits = 3;
  const Penetration of_capacity = penetration(a, b, exact, small);
  const Penetration of_visits = penetration(a, b, limited, workspace_);
  for (const auto& [found, asked, workspace] : {std::tuple(&of_capacity, &spheres, &small),
                                                std::tuple(&of_visits, &spheres, &workspace_)}) {
    EXPECT_EQ(found->status, QueryStatus::budget_exhausted);
    PenetrationSettings same = *asked;
    same.max_visits = found == &of_visits ? 3 : 0;
    const Penetration matched = penetration(a, b, same, *workspace);
    EXPECT_EQ(found->volume, matched.volume);
    EXPECT_EQ(found->force, matched.force);
    EXPECT_EQ(found->torque, matched.torque);
    EXPECT_EQ(found->centroid, matched.centroid);
    // Certain bounds of the true volume.
    EXPECT_LE(found->volume_min, truth.volume);
    EXPECT_GE(found->volume_max, truth.volume);
  }
}

TEST_F(ExactLimits, OfSurfacesAloneHaveOnlyBounds) {
  const PlacedAsset a{alone_.view(), {}, 1}, b{alone_.view(), near_, 1};
  const PlacedAsset whole{ball_.view(), near_, 1};
  const Penetration truth = ask(a, b);
  EXPECT_EQ(truth.volume, ask(a, whole).volume);
  Workspace small(16);
  for (const PlacedAsset& other : {b, whole}) {
    const Penetration found = testing::exactly(a, other, small);
    EXPECT_EQ(found.status, QueryStatus::budget_exhausted);
    EXPECT_TRUE(std::isnan(found.volume));
    EXPECT_EQ(found.volume_min, 0);
    EXPECT_GE(found.volume_max, truth.volume);
    EXPECT_LE(found.volume_max, alone_.view().volume() * (1 + 1e-9));
  }
}

TEST_F(ExactLimits, WithoutAMeshNothingIsHeld) {
  const Asset bare = testing::baked(testing::icosphere_mesh(2), "bare", 50, false);
  const PlacedAsset a{bare.view(), {}, 1}, b{ball_.view(), near_, 1};
  EXPECT_EQ(testing::exactly(a, b, workspace_).status, QueryStatus::missing_data);
  EXPECT_EQ(testing::exactly(b, a, workspace_).status, QueryStatus::missing_data);
}

// The amount of memory does not matter once it is enough.
TEST_F(ExactLimits, MemoryNeverChangesAnAnswer) {
  const PlacedAsset a{ball_.view(), {}, 1}, b{ball_.view(), near_, 1};
  const Penetration truth = ask(a, b);
  int enough = 0;
  for (std::size_t capacity = 1; capacity < 1u << 16; capacity *= 2) {
    Workspace memory(capacity);
    const Penetration found = testing::exactly(a, b, memory);
    if (found.status == QueryStatus::budget_exhausted) {
      EXPECT_EQ(enough, 0);
      continue;
    }
    ++enough;
    EXPECT_EQ(found.volume, truth.volume);
    EXPECT_EQ(found.volume_max, truth.volume_max);
    EXPECT_EQ(found.torque, truth.torque);
  }
  EXPECT_GE(enough, 2);
}

}  // namespace
}  // namespace ist
