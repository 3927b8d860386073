#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/exact_pair.h"
#include "support/integer_meshes.h"
#include "support/rational_overlap.h"

// Exact queries against rational arithmetic: small meshes of integer coordinates in poses that
// round nothing, so that the rational volume is the query's own question's.

namespace ist {
namespace {

using testing::IntegerMeshes;
using testing::Rational;
using Point = Eigen::Vector3d;

/// The turns of the cube: twelve by quaternions that are exact, twelve more after a quarter turn of
/// the mesh itself.
struct CubeTurn {
  double q[4];
  bool quarter;
};

std::vector<CubeTurn> cube_turns() {
  std::vector<CubeTurn> turns;
  for (const bool quarter : {false, true}) {
    for (int k = 0; k < 4; ++k) {
      CubeTurn turn{{0, 0, 0, 0}, quarter};
      turn.q[k] = 1;
      turns.push_back(turn);
    }
    for (int signs = 0; signs < 8; ++signs)
      turns.push_back(
          {{0.5, signs & 1 ? 0.5 : -0.5, signs & 2 ? 0.5 : -0.5, signs & 4 ? 0.5 : -0.5}, quarter});
  }
  return turns;
}

TriangleMesh quarter_turned(TriangleMesh mesh) {
  for (Point& v : mesh.vertices) v = Point(-v.y(), v.x(), v.z());
  return mesh;
}

TriangleMesh moved(TriangleMesh mesh, const Pose& pose) {
  const Eigen::Quaterniond turn(pose.q[0], pose.q[1], pose.q[2], pose.q[3]);
  const Eigen::Matrix3d matrix = turn.toRotationMatrix();
  for (Point& v : mesh.vertices) v = matrix * v + Point(pose.t[0], pose.t[1], pose.t[2]);
  return mesh;
}

class ExactRational : public ::testing::Test {
 protected:
  /// `b` as it lies before its pose.
  void compare(const TriangleMesh& a, const Asset& asset_a, const TriangleMesh& b,
               const Asset& asset_b, const Pose& pose, const std::string& what) {
    // If faces of one mesh cross, its points are only rounded.
    ASSERT_LE(asset_a.view().mesh_error() + asset_b.view().mesh_error(), 1e-14) << what;
    const Rational truth = testing::rational_overlap(a, moved(b, pose));
    const PlacedAsset placed_a{asset_a.view(), {}, 1}, placed_b{asset_b.view(), pose, 1};
    const Penetration found = testing::exactly(placed_a, placed_b, workspace_);
    const auto number = truth.convert_to<double>();
    ASSERT_EQ(found.status, QueryStatus::ok) << what;
    EXPECT_TRUE(Rational(found.volume_min) <= truth && truth <= Rational(found.volume_max))
        << what << ": " << number << " not in " << found.volume_min << " … " << found.volume_max;
    const double size = std::min(testing::size_of(placed_a), testing::size_of(placed_b));
    const double whole = size * size * size, width = found.volume_max - found.volume_min;
    const double error = std::abs(Rational(Rational(found.volume) - truth).convert_to<double>());
    EXPECT_LE(error, 1e-14 * number + 1e-16 * whole) << what << ": " << number;
    // A place is known to the rounding of the larger solid's.
    const double larger = std::max(testing::size_of(placed_a), testing::size_of(placed_b));
    EXPECT_LE(width, 1e-12 * size * size * larger) << what;
    const testing::ExactCheck check = testing::check_exactly(placed_a, placed_b, workspace_);
    EXPECT_TRUE(check.complete && check.consistent) << what;
    // The running bound alone, without what poses round in general.
    EXPECT_TRUE(abs(Rational(Rational(check.volume) - truth)) <= Rational(check.error))
        << what << ": " << number << " is not " << check.volume << " ± " << check.error;
    EXPECT_LE(check.error, 1e-13 * size * size * larger) << what;
    EXPECT_LE(check.gap, testing::gap_bound(check)) << what;
    ++poses_;
    empty_ += truth == 0 ? 1 : 0;
  }

  int poses_ = 0, empty_ = 0;
  Workspace workspace_;
};

TEST_F(ExactRational, RandomMeshesInCubeTurns) {
  IntegerMeshes random(1);
  const std::vector<CubeTurn> turns = cube_turns();
  for (int i = 0; i < 3 * IntegerMeshes::kKinds; ++i) {
    const TriangleMesh a = random.make(i % IntegerMeshes::kKinds);
    TriangleMesh b = random.make(random.whole(0, IntegerMeshes::kKinds - 1));
    const Asset asset_a = testing::surface(a);
    for (int k = 0; k < 4; ++k) {
      const CubeTurn& turn = turns[static_cast<std::size_t>(random.whole(0, 23))];
      const TriangleMesh mesh_b = turn.quarter ? quarter_turned(b) : b;
      Pose pose;
      std::copy(turn.q, turn.q + 4, pose.q);
      // Displacements by integers, sixteenths and 2⁻²⁰.
      const double step = k > 0 ? 0 : i % 4 == 0 ? 0x1p-20 : 0.0625;
      for (double& t : pose.t) t = random.whole(-4, 4) + step * random.whole(-9, 9);
      compare(a, asset_a, mesh_b, testing::surface(mesh_b), pose,
              "meshes " + std::to_string(i) + ", pose " + std::to_string(k));
    }
  }
  EXPECT_EQ(poses_, 108);
  EXPECT_GE(poses_ - empty_, 50);
}

// On copies of themselves, and on what shares faces, edges or corners with them.
TEST_F(ExactRational, CopiesAndNeighboursOfTheSameMesh) {
  IntegerMeshes random(2);
  for (int i = 0; i < 5 * IntegerMeshes::kKinds; ++i) {
    const TriangleMesh a = random.make(i % IntegerMeshes::kKinds);
    const Asset asset = testing::surface(a);
    Pose pose;
    compare(a, asset, a, asset, pose, "in place " + std::to_string(i));
    Eigen::AlignedBox3d box;
    for (const Point& v : a.vertices) box.extend(v);
    for (int k = 0; k < 4; ++k) {
      // Displacements by sides of its box and differences of its corners.
      for (double& t : pose.t) t = 0;
      if (k < 2) {
        const int axis = random.whole(0, 2);
        pose.t[axis] = (random.whole(0, 1) ? 1 : -1) * box.sizes()[axis];
        if (k == 1) pose.t[(axis + 1) % 3] = random.whole(-2, 2);
      } else {
        const int last = static_cast<int>(a.vertices.size()) - 1;
        const Point between = a.vertices[static_cast<std::size_t>(random.whole(0, last))] -
                              a.vertices[static_cast<std::size_t>(random.whole(0, last))];
        std::copy(between.data(), between.data() + 3, pose.t);
      }
      compare(a, asset, a, asset, pose, "neighbour " + std::to_string(i) + ' ' + std::to_string(k));
    }
  }
  EXPECT_EQ(poses_, 225);
  EXPECT_GE(poses_ - empty_, 80);
}

}  // namespace
}  // namespace ist
