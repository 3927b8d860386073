#include <gtest/gtest.h>
#include <ist/pose_eigen.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <new>
#include <random>
#include <set>
#include <vector>

#include "mesh/samples/samples.h"
#include "support/exact_pair.h"
#include "support/mated_rows.h"
#include "support/random_mates.h"
#include "support/turns.h"

// Exact queries where parts are mated: against the volumes of exact booleans, in every right-angled
// turn, mirrored, and copies in place and next to it, whose volumes follow from the solid alone.

namespace ist {
namespace {

using testing::MatedRow;
using Point = Eigen::Vector3d;

/// In parts of the smaller solid: the truth's own rounding, and that of the pose of its row.
constexpr double kTruth = 1e-12;

/// The mirror image in the plane x = 0.
TriangleMesh mirrored(TriangleMesh mesh) {
  for (Point& v : mesh.vertices) v.x() = -v.x();
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}
Pose mirrored(const Pose& pose) {
  return {{pose.q[0], pose.q[1], -pose.q[2], -pose.q[3]}, {-pose.t[0], pose.t[1], pose.t[2]}};
}

/// [u²] Of the faces that lie back to back on each other: all pairs of triangles.
double area_of_faces(const TriangleMesh& a, const TriangleMesh& b, const Pose& pose_b) {
  const Eigen::Isometry3d place = to_isometry(pose_b);
  double sum = 0;
  for (const auto& s : a.triangles) {
    const Point &origin = a.vertices[s[0]], along = (a.vertices[s[1]] - origin).normalized();
    const Point normal = along.cross(a.vertices[s[2]] - origin).normalized();
    const Point across = normal.cross(along);
    const auto flat = [&](const Point& p) {
      return Eigen::Vector2d(along.dot(p - origin), across.dot(p - origin));
    };
    for (const auto& t : b.triangles) {
      std::array<Point, 3> corners;
      for (int k = 0; k < 3; ++k) corners[k] = place * b.vertices[t[k]];
      if (std::any_of(corners.begin(), corners.end(),
                      [&](const Point& p) { return std::abs(normal.dot(p - origin)) > 1e-9; }) ||
          (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(normal) > 0)
        continue;
      sum += testing::common_area(
          {flat(a.vertices[s[0]]), flat(a.vertices[s[1]]), flat(a.vertices[s[2]])},
          {flat(corners[0]), flat(corners[2]), flat(corners[1])});
    }
  }
  return sum;
}

class ExactMated : public ::testing::Test {
 protected:
  static const TriangleMesh& part_mesh(const std::string& name) {
    static std::map<std::string, TriangleMesh> meshes;
    const auto [it, fresh] = meshes.try_emplace(name);
    if (fresh) it->second = load_mesh(testing::mated_mesh_path(name));
    return it->second;
  }

  static const Asset& part(const std::string& name, bool mirror) {
    static std::map<std::pair<std::string, bool>, Asset> assets;
    const auto found = assets.find({name, mirror});
    if (found != assets.end()) return found->second;
    TriangleMesh mesh = part_mesh(name);
    if (mirror) mesh = mirrored(std::move(mesh));
    return assets.emplace(std::pair{name, mirror}, testing::surface(std::move(mesh), name.c_str()))
        .first->second;
  }

  /// The row's volume, by the query of A and B.
  Penetration compare(const MatedRow& row, const PlacedAsset& a, const PlacedAsset& b) {
    const Penetration found = testing::exactly(a, b, workspace_);
    const double smaller = std::min(a.asset.volume(), b.asset.volume()),
                 tolerance = kTruth * smaller;
    EXPECT_EQ(found.status, QueryStatus::ok);
    EXPECT_NEAR(found.volume, row.volume, tolerance);
    EXPECT_LE(found.volume_min, row.volume + tolerance);
    EXPECT_GE(found.volume_max, row.volume - tolerance);
    EXPECT_LE(found.volume_min, found.volume);
    EXPECT_LE(found.volume, found.volume_max);
    EXPECT_LE(found.volume_max, smaller * (1 + 1e-12));
    // A place is known to the rounding of the larger solid's.
    const double size = std::min(testing::size_of(a), testing::size_of(b));
    const double larger = std::max(testing::size_of(a), testing::size_of(b));
    EXPECT_LE(found.volume_max - found.volume_min, 1e-12 * size * size * larger);
    // A pin moved along its hole touches it still.
    EXPECT_EQ(found.touching, row.volume == 0 && (row.moved == 0 || row.name == "pin_in_hole"));
    return found;
  }

  Workspace workspace_;
};

/// Mates whose touching faces are all perpendicular to the direction of the mate.
const std::set<std::string> kPlanar = {"bolt_in_plate",  "bracket_on_plate", "brick_beside",
                                       "brick_on_brick", "brick_shifted",    "brick_turned",
                                       "fillet_stack",   "plate_cross",      "plate_on_plate"};

TEST_F(ExactMated, EveryRow) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  const std::vector<MatedRow> rows = testing::read_mated_rows();
  ASSERT_EQ(rows.size(), 90u);
  int planar = 0;
  for (const MatedRow& row : rows) {
    SCOPED_TRACE(row.name + " moved by " + std::to_string(row.moved));
    for (const bool mirror : {false, true}) {
      const PlacedAsset a{part(row.mesh_a, mirror).view(), {}, 1},
          b{part(row.mesh_b, mirror).view(), mirror ? mirrored(row.pose) : row.pose, 1};
      const Penetration found = compare(row, a, b), exchanged = compare(row, b, a);
      EXPECT_NEAR(found.contact_area, exchanged.contact_area, 1e-12 * found.contact_area);
      EXPECT_LE((found.contact_normal + exchanged.contact_normal).norm(), 1e-9);
      if (found.contact_area > 0) {
        EXPECT_LE((found.centroid - exchanged.centroid).norm(), 1e-9 * testing::size_of(a));
      }
      const testing::ExactCheck check = testing::check_exactly(a, b, workspace_);
      EXPECT_TRUE(check.complete && check.consistent);
      EXPECT_LE(check.gap, testing::gap_bound(check));
      if (!found.touching || mirror) continue;
      const double faces = area_of_faces(part_mesh(row.mesh_a), part_mesh(row.mesh_b), row.pose);
      EXPECT_NEAR(found.contact_area, faces, 1e-9 * faces);
      // The volume that a millionth of the unit cuts off, from the area of the faces.
      const auto moved = std::find_if(rows.begin(), rows.end(), [&](const MatedRow& other) {
        return other.name == row.name && other.moved == 1e-6;
      });
      if (kPlanar.count(row.name) == 0) continue;
      const double area = moved->volume / 1e-6;
      ++planar;
      EXPECT_NEAR(found.contact_area, area, area * 1e-4);
      const Penetration deeper = testing::exactly(a, {b.asset, moved->pose, 1}, workspace_);
      EXPECT_LE((found.centroid - deeper.centroid).norm(), 1e-3 * testing::size_of(a));
      const Point direction = Point(moved->pose.t) - Point(row.pose.t);
      EXPECT_LE((found.contact_normal + direction.normalized()).norm(), 1e-6);
    }
  }
  EXPECT_EQ(planar, static_cast<int>(kPlanar.size()));
}

/// Steps by some times what a search looks around for, which a plane of a flat block may lie
/// within.
TEST_F(ExactMated, WhatIsKeptKeepsTheBits) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  Workspace kept;
  PenetrationSettings fresh;
  fresh.measure = Measure::exact;
  PenetrationSettings step = fresh;
  for (const MatedRow& row : testing::read_mated_rows()) {
    const PlacedAsset a{part(row.mesh_a, false).view(), {}, 1};
    PlacedAsset b{part(row.mesh_b, false).view(), row.pose, 1};
    ++step.pair_id;
    for (int k = 0; k < 8; ++k) {
      SCOPED_TRACE(row.name + " moved by " + std::to_string(row.moved) + ", step " +
                   std::to_string(k));
      const Penetration x = penetration(a, b, fresh, workspace_), y = penetration(a, b, step, kept);
      EXPECT_EQ(x.volume, y.volume);
      EXPECT_EQ(x.volume_min, y.volume_min);
      EXPECT_EQ(x.volume_max, y.volume_max);
      EXPECT_EQ(x.contact_area, y.contact_area);
      b.pose.t[k % 3] += 1e-9 * (k + 1);
    }
  }
}

TEST_F(ExactMated, EveryRightAngledTurnOfBoth) {
  IST_NEEDS_SHARED("oracle/mated/poses.csv");
  for (const MatedRow& row : testing::read_mated_rows())
    for (const Eigen::Quaterniond& turn : testing::right_angled_turns()) {
      SCOPED_TRACE(row.name + " moved by " + std::to_string(row.moved));
      compare(row, {part(row.mesh_a, false).view(), testing::turned(turn, {}), 1},
              {part(row.mesh_b, false).view(), testing::turned(turn, row.pose), 1});
    }
}

/// [u²] What of the solid's surface is seen from far away in a direction, all layers of it.
double shadow(const TriangleMesh& mesh, const Point& direction) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Point& a = mesh.vertices[t[0]];
    const Point normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a) / 2;
    sum += std::max(0.0, normal.dot(direction));
  }
  return sum;
}

/// A solid and its copy d away have the volume V − d · shadow + O(d²) in common, never less, and
/// the same if the copy moves in the opposite direction.
class ExactCopies : public ::testing::TestWithParam<const char*> {
 protected:
  static bool is_sample() { return path().string() == "gear"; }
  static std::filesystem::path path() {
    const std::string name = GetParam();
    if (name == "gear") return name;
    return name.find('/') != std::string::npos
               ? testing::shared_path(name)
               : std::filesystem::path(testing::oracle_mesh_path(name));
  }
};

/// [bytes] What a workspace took.
struct Taken {
  std::size_t bytes = 0;
  MemoryHooks hooks() {
    return {[](void* context, std::size_t bytes, std::size_t alignment) {
              static_cast<Taken*>(context)->bytes += bytes;
              return ::operator new(bytes, std::align_val_t(alignment));
            },
            [](void*, void* memory, std::size_t, std::size_t alignment) {
              ::operator delete(memory, std::align_val_t(alignment));
            },
            this};
  }
};

TEST_P(ExactCopies, InPlaceAndAside) {
  if (!is_sample()) {
    IST_NEEDS_SHARED(std::filesystem::relative(path(), testing::shared_path("")).string());
  }
  const TriangleMesh mesh =
      close_mesh(is_sample() ? make_sample(GetParam()) : load_mesh(path()), GetParam()).mesh;
  const Asset asset = testing::surface(mesh, GetParam());
  const double whole = asset.view().volume();
  const double size = testing::size_of({asset.view(), {}, 1});
  Taken taken;
  constexpr std::size_t kCapacity = 1u << 20;  // the default
  Workspace workspace(kCapacity, taken.hooks());
  const std::size_t reserved = taken.bytes;
  EXPECT_LE(static_cast<double>(reserved), 9e6 + 173.0 * kCapacity);
  const PlacedAsset still{asset.view(), {}, 1};
  const Penetration in_place = testing::exactly(still, still, workspace);
  EXPECT_EQ(in_place.status, QueryStatus::ok);
  EXPECT_NEAR(in_place.volume, whole, 1e-12 * whole);
  EXPECT_FALSE(in_place.touching);
  std::mt19937_64 random(5);
  for (const double aside : {1e-9, 1e-6, 1e-3})
    for (const Point& direction : {Point(Point::UnitX()), Point(Point::UnitZ()),
                                   Point(testing::random_turn(random) * Point::UnitX())}) {
      SCOPED_TRACE(aside);
      const double d = aside * size;
      const auto moved = [&](double by) {
        const Point t = by * direction;
        return testing::exactly(still, {asset.view(), {{1, 0, 0, 0}, {t.x(), t.y(), t.z()}}, 1},
                                workspace);
      };
      const Penetration there = moved(d), back = moved(-d);
      const double least = whole - d * shadow(mesh, direction), tolerance = 1e-12 * whole;
      for (const Penetration& found : {there, back}) {
        EXPECT_EQ(found.status, QueryStatus::ok);
        EXPECT_FALSE(found.touching);
        EXPECT_GE(found.volume, least - tolerance);
        EXPECT_LE(found.volume, whole + tolerance);
        if (aside < 1e-8) {
          EXPECT_NEAR(found.volume, least, tolerance);
        }
        EXPECT_LE(found.volume_max - found.volume_min, 1e-10 * whole);
      }
      EXPECT_NEAR(there.volume, back.volume, tolerance);
      EXPECT_LE((there.force + back.force).norm(), 1e-9 * size * size);
    }
  EXPECT_EQ(taken.bytes, reserved);
}

INSTANTIATE_TEST_SUITE_P(
    Meshes, ExactCopies,
    ::testing::Values("gear", "ico20k", "elephant", "dino", "elephant200k",
                      "meshes/dev/unit_cube.stl", "meshes/dev/spot.obj", "meshes/dev/torus.off",
                      "meshes/dev/bunny_60k.ply", "meshes/dev/dragon_174k.ply",
                      "meshes/dev/sword.ply", "meshes/dev/tray_perforated.stl",
                      "meshes/dev/adis16480.stl", "meshes/dev/mug.ply",
                      "meshes/dev/menger_sponge3.glb", "meshes/dev/bolt_gen.ply",
                      "meshes/dev/nut_gen.ply",
                      "meshes/dev/robots/ur_description/meshes/ur5/collision/base.stl",
                      "meshes/dev/robots/solo_description/meshes/stl/solo12/solo_12_base.stl"),
    [](const auto& name) { return std::filesystem::path(name.param).stem().string(); });

}  // namespace
}  // namespace ist
