// Contact or no contact, against FCL and Bullet on the same meshes and poses. A mesh library sees
// surfaces; whether one solid holds the other comes from the oracle or from solid angles here.
//
// What must hold, without any band:
//   inner overlap > 0      ⇒ the solids meet                       (inner spheres are inside)
//   the solids meet        ⇒ distance_min = 0                      (cover balls hold the solids)
//   they are d > 0 apart   ⇒ distance_min ≤ d ≤ distance_max
//   one holds the other    ⇒ matched overlap > 0
// and with a band that follows from the assets:
//   matched overlap > 0    ⇒ the solids meet or d ≤ p_A + p_B      (p: largest protrusion)
//   the solids meet deeper ⇒ matched overlap > 0                   (than the layer w below)
// w = g_A + g_B + p_A + p_B, g the largest cover radius less its sphere's: no point of a solid is
// further than g from its inner spheres. Deeper than w: moving B by w along the exact force (the
// mean contact normal where that is unknown) leaves the surfaces crossing.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/query.h>

#include "query/asset_layout.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"

namespace {

using Eigen::Vector3d;
using ist::Pose;
using ist::testing::BulletMesh;
using ist::testing::FclMesh;
using ist::testing::MeshContacts;

constexpr std::size_t kSpheres = 1000;

/// A mesh under one uniform scale, as each of the three libraries sees it.
struct Body {
  Body(std::shared_ptr<const ist::ClosedMesh> closed_mesh, std::shared_ptr<const ist::Asset> baked,
       double uniform_scale)
      : closed(std::move(closed_mesh)),
        asset(std::move(baked)),
        scale(uniform_scale),
        fcl(closed->mesh, scale),
        bullet(closed->mesh, scale) {
    const ist::AssetHeader& header = asset->view().header();
    const auto* spheres = ist::at<ist::Sphere4>(header, header.inner_spheres);
    const auto* cover = ist::at<float>(header, header.cover_radii);
    double missed = 0;
    for (std::uint64_t i = 0; i < header.sphere_count; ++i) {
      missed = std::max(missed, double(cover[i]) - double(spheres[i].r));
    }
    missed_layer = scale * std::ldexp(missed, header.exponent);
    protrusion = scale * std::ldexp(header.protrusion, header.exponent);
  }

  ist::PlacedTree at(const Pose& pose) const { return {asset->view(), pose, scale}; }

  std::shared_ptr<const ist::ClosedMesh> closed;
  std::shared_ptr<const ist::Asset> asset;
  double scale;
  FclMesh fcl;
  BulletMesh bullet;
  double missed_layer = 0;  ///< [u] g: the solid lies within this of the inner spheres
  double protrusion = 0;    ///< [u] p: no effective sphere sticks out further
};

/// A mesh at full size and at the scale of the rows where it is held.
struct Model {
  Model(const std::string& path, double small_scale) {
    const auto closed = std::make_shared<const ist::ClosedMesh>(
        ist::close_mesh(ist::load_mesh(path), std::filesystem::path(path).filename().string()));
    const auto asset =
        std::make_shared<const ist::Asset>(ist::bake(*closed, {.max_spheres = kSpheres}));
    full = std::make_unique<Body>(closed, asset, 1.0);
    if (small_scale != 1) small = std::make_unique<Body>(closed, asset, small_scale);
  }
  std::unique_ptr<Body> full, small;
};

/// Two placed solids and what is known of them. A rests at the identity.
struct Case {
  std::string name;
  Body* a = nullptr;
  Body* b = nullptr;
  Pose pose_b;
  bool held = false;                 ///< one solid holds the other: no surface crosses
  double surface_distance = 0;       ///< [u]
  Vector3d exit = Vector3d::Zero();  ///< unit: the way B leaves A; zero where they do not cross

  bool cross() const { return surface_distance == 0; }
  bool meet() const { return cross() || held; }
};

/// Counts over all cases, for the reader of the log.
struct Tally {
  std::size_t cases = 0, meet = 0, held = 0, shallow = 0, shallow_unfound = 0, soft_skin = 0;
  std::size_t bullet_false = 0, bullet_missed = 0;
  double held_low = 1, held_high = 1;  ///< matched overlap of held solids / their own volume
};

double degrees(const Vector3d& u, const Vector3d& v) {
  return std::acos(std::clamp(u.normalized().dot(v.normalized()), -1.0, 1.0)) * 180 /
         std::numbers::pi;
}

Pose moved(Pose pose, const Vector3d& by) {
  for (int k = 0; k < 3; ++k) pose.t[k] += by[k];
  return pose;
}

/// Angles between the force and the exact gradient; what the mean contact normals reach.
struct ForceAngles {
  std::vector<double> ist, fcl, bullet;  ///< [degrees] a row each

  /// ist must point better than either, in the median and in the tail.
  void judge(const std::string& name) {
    for (auto* angles : {&ist, &fcl, &bullet}) std::sort(angles->begin(), angles->end());
    const std::size_t middle = ist.size() / 2, tail = ist.size() * 95 / 100;
    std::printf(
        "%s: angle to the exact force, median / p95 of %zu rows: ist %.2f / %.2f degrees, "
        "FCL normals %.2f / %.2f, Bullet normals %.2f / %.2f\n",
        name.c_str(), ist.size(), ist[middle], ist[tail], fcl[middle], fcl[tail], bullet[middle],
        bullet[tail]);
    EXPECT_LT(ist[middle], fcl[middle]);
    EXPECT_LT(ist[tail], fcl[tail]);
    EXPECT_LT(ist[middle], bullet[middle]);
    EXPECT_LT(ist[tail], bullet[tail]);
  }
};

class ContactOracle {
 public:
  /// Judges one case; every false statement fails the test, with its reason.
  void judge(const Case& c) {
    SCOPED_TRACE(c.name);
    const Body& a = *c.a;
    const Body& b = *c.b;
    const ist::PlacedTree place_a = a.at({}), place_b = b.at(c.pose_b);
    const ist::Penetration inner =
        ist::penetration(place_a, place_b, {.measure = ist::Measure::inner}, workspace_);
    const ist::Penetration matched = ist::penetration(place_a, place_b, {}, workspace_);
    const ist::Separation gap = ist::separation(place_a, place_b, {}, workspace_);
    const double d = c.surface_distance;

    ++tally.cases;
    tally.meet += c.meet();
    tally.held += c.held;
    judge_bullet(c);

    if (!c.meet()) {
      EXPECT_EQ(inner.volume, 0) << "inner spheres overlap, solids are " << d << " apart";
      EXPECT_LE(gap.distance_min, d) << "the solids are closer than distance_min";
      EXPECT_GE(gap.distance_max, d) << "the solids are further apart than distance_max";
      if (matched.volume > 0) {
        ++tally.soft_skin;
        EXPECT_LE(d, a.protrusion + b.protrusion)
            << "matched overlap " << matched.volume << " beyond both protrusions";
      }
      return;
    }
    EXPECT_EQ(gap.distance_min, 0) << "the solids meet, the interval says they do not";
    if (c.held) {
      EXPECT_GT(matched.volume, 0) << "a held solid was missed";
      const double smaller = std::min(place_a.tree.volume() * std::pow(a.scale, 3),
                                      place_b.tree.volume() * std::pow(b.scale, 3));
      tally.held_low = std::min(tally.held_low, matched.volume / smaller);
      tally.held_high = std::max(tally.held_high, matched.volume / smaller);
    } else if (shallow(c)) {
      ++tally.shallow;
      tally.shallow_unfound += matched.volume == 0;
    } else {
      EXPECT_GT(matched.volume, 0) << "crossing surfaces were missed, deeper than the band";
    }
  }

  /// For crossing surfaces whose exact force is known.
  void judge_force(const Case& c, ForceAngles& angles) {
    const ist::Penetration found = ist::penetration(c.a->at({}), c.b->at(c.pose_b), {}, workspace_);
    angles.ist.push_back(degrees(-found.translation_gradient, c.exit));
    EXPECT_LT(angles.ist.back(), 90) << "the force pulls B in";
    angles.fcl.push_back(
        degrees(ist::testing::fcl_contacts(c.a->fcl, {}, c.b->fcl, c.pose_b).push_b, c.exit));
    angles.bullet.push_back(
        degrees(bullet_.contacts(c.a->bullet, {}, c.b->bullet, c.pose_b).push_b, c.exit));
  }

  Tally tally;

 private:
  /// Does moving B out by w end the contact?
  static bool shallow(const Case& c) {
    const double w = c.a->missed_layer + c.b->missed_layer + c.a->protrusion + c.b->protrusion;
    return !ist::testing::fcl_in_contact(c.a->fcl, {}, c.b->fcl, moved(c.pose_b, w * c.exit));
  }

  /// Bullet's triangle test passes pairs that cross each other's planes without touching, so it
  /// finds contacts at small gaps too. Those and the contacts it misses are counted; FCL, whose
  /// distance is exact, decides.
  void judge_bullet(const Case& c) {
    const bool contact = bullet_.contacts(c.a->bullet, {}, c.b->bullet, c.pose_b).any();
    tally.bullet_false += contact && !c.cross();
    tally.bullet_missed += !contact && c.cross();
  }

  ist::Workspace workspace_;
  ist::testing::BulletNarrowPhase bullet_;
};

void print(const std::string& name, const Tally& t) {
  std::printf(
      "%s: %zu cases, %zu meet (%zu held, overlap %.3f .. %.3f of their volume); matched > 0 in "
      "the "
      "soft skin of %zu gaps; %zu contacts in the shallow band, %zu of them not found. Bullet: "
      "contact at a gap %zu, missed %zu.\n",
      name.c_str(), t.cases, t.meet, t.held, t.held_low, t.held_high, t.soft_skin, t.shallow,
      t.shallow_unfound, t.bullet_false, t.bullet_missed);
}

class OracleRows : public ::testing::TestWithParam<std::string> {};

TEST_P(OracleRows, AgreeWithFclBulletAndExactDistances) {
  const std::string key = GetParam();
  IST_NEEDS_SHARED("oracle/poses/truth_" + key + ".csv");
  const auto rows = ist::testing::read_oracle_rows(key);
  const double small = rows.back().scale_b;
  Model a(ist::testing::oracle_mesh_path(rows.front().mesh_a), 1);
  Model b(ist::testing::oracle_mesh_path(rows.front().mesh_b), small);
  ContactOracle oracle;
  ForceAngles angles;
  for (const ist::testing::OracleRow& row : rows) {
    ASSERT_TRUE(row.scale_b == 1 || row.scale_b == small);
    Case c;
    c.name = key + " row " + std::to_string(row.id) + " (" + row.pose_class + ")";
    c.a = a.full.get();
    c.b = row.scale_b == 1 ? b.full.get() : b.small.get();
    c.pose_b = row.pose;
    c.held = row.volume > 0 && row.surface_distance > 0;
    c.surface_distance = row.surface_distance;
    if (c.cross()) c.exit = -row.translation_gradient.normalized();
    // FCL, the judge of the random poses below, must know the exact answers itself.
    SCOPED_TRACE(c.name);
    EXPECT_EQ(ist::testing::fcl_in_contact(c.a->fcl, {}, c.b->fcl, c.pose_b), c.cross());
    EXPECT_NEAR(ist::testing::fcl_distance(c.a->fcl, {}, c.b->fcl, c.pose_b), c.surface_distance,
                1e-6);
    oracle.judge(c);
    if (row.pose_class == "pen" && row.fraction_of_smaller >= 1e-3) oracle.judge_force(c, angles);
  }
  print(key, oracle.tally);
  angles.judge(key);
}

INSTANTIATE_TEST_SUITE_P(Contact, OracleRows, ::testing::ValuesIn(ist::testing::kPairKeys),
                         [](const auto& info) { return info.param; });

/// Winding number by solid angles over all triangles: slow, and independent of the library.
double winding_number(const ist::TriangleMesh& mesh, const Vector3d& x) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices[t[0]] - x, b = mesh.vertices[t[1]] - x,
                   c = mesh.vertices[t[2]] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// For surfaces that do not cross and meshes of one component: does either solid hold the other?
bool one_holds_the_other(const Case& c) {
  const Eigen::Isometry3d b_to_a = ist::to_isometry(c.pose_b);
  const Vector3d of_b = b_to_a * (c.b->scale * c.b->closed->mesh.vertices.front());
  const Vector3d of_a =
      b_to_a.inverse() * (c.a->scale * c.a->closed->mesh.vertices.front()) / c.b->scale;
  return winding_number(c.a->closed->mesh, of_b / c.a->scale) > 0.5 ||
         winding_number(c.b->closed->mesh, of_a) > 0.5;
}

struct MeshPair {
  std::string name, a, b;
};

class RandomPoses : public ::testing::TestWithParam<MeshPair> {};

TEST_P(RandomPoses, AgreeWithFclAndBullet) {
  const MeshPair pair = GetParam();
  IST_NEEDS_SHARED(pair.a);
  IST_NEEDS_SHARED(pair.b);
  constexpr int kPoses = 90;
  constexpr double kSmall = 0.1;
  Model a(ist::testing::shared_path(pair.a).string(), 1);
  Model b(ist::testing::shared_path(pair.b).string(), kSmall);
  const Eigen::AlignedBox3d box_a = a.full->closed->report.bounds;
  const Eigen::AlignedBox3d box_b = b.full->closed->report.bounds;

  std::mt19937_64 random(20240917);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
  const auto vector = [&] { return Vector3d(uniform(), uniform(), uniform()); };
  ContactOracle oracle;
  for (int i = 0; i < kPoses; ++i) {
    Case c;
    c.name = pair.name + " pose " + std::to_string(i);
    c.a = a.full.get();
    c.b = i % 3 == 0 ? b.small.get() : b.full.get();  // a third of the poses: B small, perhaps held
    // B's box centre falls somewhere in A's box, grown by half of B's diagonal unless B is small.
    const Eigen::Quaterniond q = Eigen::Quaterniond(2 * uniform() - 1, 2 * uniform() - 1,
                                                    2 * uniform() - 1, 2 * uniform() - 1)
                                     .normalized();
    const double grow = i % 3 == 0 ? 0 : 0.5 * box_b.diagonal().norm();
    const Vector3d target = box_a.min() - Vector3d::Constant(grow) +
                            vector().cwiseProduct(box_a.sizes() + Vector3d::Constant(2 * grow));
    const Vector3d t = target - q * (c.b->scale * box_b.center());
    c.pose_b = {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
    const MeshContacts contacts = ist::testing::fcl_contacts(c.a->fcl, {}, c.b->fcl, c.pose_b);
    if (contacts.any()) {
      c.exit = contacts.push_b.normalized();
    } else {
      c.surface_distance = ist::testing::fcl_distance(c.a->fcl, {}, c.b->fcl, c.pose_b);
      SCOPED_TRACE(c.name);
      ASSERT_GT(c.surface_distance, 0) << "FCL disagrees with itself";
      c.held = one_holds_the_other(c);
    }
    oracle.judge(c);
  }
  print(pair.name, oracle.tally);
  EXPECT_GT(oracle.tally.meet, 10u) << "the poses must try something";
  EXPECT_LT(oracle.tally.meet + 10, oracle.tally.cases);
}

INSTANTIATE_TEST_SUITE_P(
    Contact, RandomPoses,
    ::testing::Values(MeshPair{"spot_torus", "meshes/dev/spot.obj", "meshes/dev/torus.off"},
                      MeshPair{"mug_spot", "meshes/dev/mug.ply", "meshes/dev/spot.obj"},
                      MeshPair{"tray_peg", "meshes/dev/hole_tray_round_16mm.obj",
                               "meshes/dev/peg_round_16mm.obj"}),
    [](const auto& info) { return info.param.name; });

}  // namespace
