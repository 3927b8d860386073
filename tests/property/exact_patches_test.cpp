#include <gtest/gtest.h>
#include <ist/query.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "mesh/samples/samples.h"
#include "support/exact_pair.h"
#include "support/test_meshes.h"

// Contact patches by Measure::exact: the connected parts of an overlap, and their outlines.

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using testing::box_mesh;
using testing::surface;

TriangleMesh joined(const std::vector<TriangleMesh>& meshes) {
  TriangleMesh all;
  for (const TriangleMesh& mesh : meshes) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& t : mesh.triangles)
      all.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  return all;
}

/// Four legs of 0.2 × 0.2, 1 high, at the corners of a square.
TriangleMesh legs() {
  std::vector<TriangleMesh> all;
  for (const double x : {-1.0, 0.8})
    for (const double y : {-1.0, 0.8})
      all.push_back(box_mesh(Point(x, y, 0), Point(x + 0.2, y + 0.2, 1)));
  return joined(all);
}

class ExactPatches : public ::testing::Test {
 protected:
  OverlapOutline ask(const PlacedAsset& a, const PlacedAsset& b, std::size_t capacity = 64) {
    patches_.assign(capacity, {});
    segments_.assign(5000, {});
    OverlapOutline found = overlap_outline(a, b, {}, workspace_, patches_, segments_);
    EXPECT_LE(found.segments, segments_.size());
    segments_.resize(std::min(found.segments, segments_.size()));
    patches_.resize(found.contact.count);
    expect_whole(a, b, found, capacity);
    expect_outlines(b.pose);
    return found;
  }

  const std::vector<ContactPatch>& patches() const { return patches_; }

 private:
  /// The patches sum to a penetration's answer.
  void expect_whole(const PlacedAsset& a, const PlacedAsset& b, const OverlapOutline& found,
                    std::size_t capacity) {
    const Penetration whole = testing::exactly(a, b, workspace_);
    EXPECT_EQ(found.contact.penetration.volume, whole.volume);
    double volume = 0;
    Point force = Point::Zero(), torque = Point::Zero(), moment = Point::Zero();
    for (const ContactPatch& patch : patches_) {
      EXPECT_GT(patch.volume, 0);
      EXPECT_EQ(patch.id == 0, found.segments == 0);
      volume += patch.volume;
      force += patch.force;
      torque += patch.torque;
      moment += patch.volume * patch.centroid;
    }
    const double size = testing::size_of(a) + testing::size_of(b), area = size * size;
    EXPECT_NEAR(volume, whole.volume, 1e-15 * area * size);
    EXPECT_LE((force - whole.force).norm(), 1e-14 * area);
    EXPECT_LE((torque - whole.torque).norm(), 1e-14 * area * size);
    EXPECT_LE((moment - whole.volume * whole.centroid).norm(), 1e-14 * area * area);
    // contact_patches() divides them.
    std::vector<ContactPatch> same(capacity);
    ContactSettings settings;
    settings.measure = Measure::exact;
    EXPECT_GE(contact_patches(a, b, settings, workspace_, same).count, patches_.size());
  }

  /// Each patch's outline is closed, and its force and torque follow from it alone (Stokes).
  void expect_outlines(const Pose& pose_b) {
    const Point origin(pose_b.t[0], pose_b.t[1], pose_b.t[2]);
    for (std::size_t p = 0; p < patches_.size(); ++p) {
      Point round = Point::Zero(), force = Point::Zero();
      double length = 0;
      for (const OutlineSegment& segment : segments_) {
        if (segment.patch != p) continue;
        round += segment.to - segment.from;
        length += (segment.to - segment.from).norm();
        force += 0.5 * (segment.from - origin).cross(segment.to - origin);
      }
      EXPECT_LE(round.norm(), 1e-13 * (1 + length));
      EXPECT_LE((force - patches_[p].force).norm(), 1e-13 * (1 + length * length));
    }
  }

  Workspace workspace_;
  std::vector<ContactPatch> patches_;
  std::vector<OutlineSegment> segments_;
};

TEST_F(ExactPatches, FourLegsOnAPlate) {
  const Asset plate = surface(box_mesh(Point(-2, -2, -1), Point(2, 2, 0)));
  const Asset table = surface(legs());
  ask({plate.view(), {}, 1}, {table.view(), {{1, 0, 0, 0}, {0.1, 0.05, -0.1}}, 1});
  ASSERT_EQ(patches().size(), 4u);
  for (const ContactPatch& patch : patches()) {
    EXPECT_NEAR(patch.volume, 0.004, 1e-16);
    EXPECT_LE((patch.force - Point(0, 0, 0.04)).norm(), 1e-15);
    EXPECT_LE((patch.normal - Point::UnitZ()).norm(), 1e-13);
    EXPECT_NEAR(patch.depth, 0.1, 1e-13);
    EXPECT_NEAR(patch.centroid.z(), -0.05, 1e-14);
  }
  // In the other order, and with memory for only two.
  ask({table.view(), {}, 1}, {plate.view(), {{1, 0, 0, 0}, {0.1, 0.05, 0.1}}, 1});
  EXPECT_EQ(patches().size(), 4u);
  ask({plate.view(), {}, 1}, {table.view(), {{1, 0, 0, 0}, {0.1, 0.05, -0.1}}, 1}, 2);
  EXPECT_EQ(patches().size(), 2u);
}

TEST_F(ExactPatches, ARingOnAPlateIsOne) {
  const Asset plate = surface(box_mesh(Point(-20, -20, -5), Point(20, 20, 0)));
  const Asset nut = surface(make_sample("nut"));
  const Pose pose{{1, 0, 0, 0}, {0.3, 0.2, -0.05}};
  ask({plate.view(), {}, 1}, {nut.view(), pose, 1});
  EXPECT_EQ(patches().size(), 1u);
  ask({nut.view(), {}, 1}, {plate.view(), pose, 1});
  EXPECT_EQ(patches().size(), 1u);
}

TEST_F(ExactPatches, ACavityBelongsToThePartAroundIt) {
  TriangleMesh inner = box_mesh(Point::Constant(-0.3), Point::Constant(0.3));
  for (auto& t : inner.triangles) std::swap(t[0], t[1]);
  const Asset hollow = surface(joined({testing::cube_mesh(), inner}));
  const Asset large = surface(box_mesh(Point::Constant(-3), Point::Constant(3)));
  for (const double z : {0.3, 2.9}) {
    const OverlapOutline found =
        ask({large.view(), {}, 1}, {hollow.view(), {{1, 0, 0, 0}, {0.1, 0.2, z}}, 1});
    ASSERT_EQ(patches().size(), 1u);
    EXPECT_EQ(found.segments == 0, z == 0.3);
  }
  EXPECT_NEAR(patches()[0].volume, 0.6 - 0.36 * 0.4, 1e-14);
}

TEST_F(ExactPatches, NothingWhereNothingMeets) {
  const Asset cube = surface(testing::cube_mesh());
  const OverlapOutline found =
      ask({cube.view(), {}, 1}, {cube.view(), {{1, 0, 0, 0}, {2, 0, 0}}, 1});
  EXPECT_EQ(found.contact.count, 0u);
  EXPECT_EQ(found.segments, 0u);
}

}  // namespace
}  // namespace ist
