#pragma once

// Contact or no contact, against FCL and Bullet on the same meshes and poses. A mesh library sees
// surfaces; whether one solid holds the other comes from the oracle or from solid angles here.
//
// The required relations, without tolerance:
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

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <ist/bake.h>
#include <ist/query.h>

#include <ist/asset_layout.h>
#include "mesh/mesh_solid.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "support/turns.h"

namespace ist::testing {

/// A mesh under one uniform scale, as each of the three libraries sees it.
struct Body {
  Body(std::shared_ptr<const ClosedMesh> closed_mesh, std::shared_ptr<const MeshSolid> of_mesh,
       std::shared_ptr<const Asset> baked, double uniform_scale)
      : closed(std::move(closed_mesh)),
        solid(std::move(of_mesh)),
        asset(std::move(baked)),
        scale(uniform_scale),
        fcl(closed->mesh, scale),
        bullet(closed->mesh, scale) {
    const AssetHeader& header = asset->view().header();
    const auto* spheres = ist::at<Sphere>(header, header.inner_spheres);
    const auto* cover = ist::at<float>(header, header.cover_radii);
    double missed = 0;
    for (std::uint64_t i = 0; i < header.sphere_count; ++i)
      missed = std::max(missed, double(cover[i]) - double(spheres[i].r));
    missed_layer = scale * std::ldexp(missed, header.exponent);
    protrusion = scale * std::ldexp(header.protrusion, header.exponent);
  }

  PlacedAsset at(const Pose& pose) const { return {asset->view(), pose, scale}; }
  double volume() const { return asset->view().volume() * std::pow(scale, 3); }
  /// [u] of a ball with the mean volume of the matched spheres
  double leaf_radius() const {
    const auto spheres = static_cast<double>(asset->view().sphere_count());
    return std::cbrt(3 * volume() / (4 * std::numbers::pi * spheres));
  }
  bool holds(const Eigen::Vector3d& x) const {
    return solid->inside(solid->frame().to_unit(x / scale));
  }

  std::shared_ptr<const ClosedMesh> closed;
  std::shared_ptr<const MeshSolid> solid;
  std::shared_ptr<const Asset> asset;
  double scale;
  FclMesh fcl;
  BulletMesh bullet;
  double missed_layer = 0;  ///< [u] g: the solid lies within this of the inner spheres
  double protrusion = 0;    ///< [u] p: no matched sphere sticks out further
};

/// A mesh, baked once, at every requested scale.
class Model {
 public:
  Model(const std::string& path, std::size_t spheres)
      : closed_(std::make_shared<const ClosedMesh>(
            close_mesh(load_mesh(path), std::filesystem::path(path).filename().string()))),
        solid_(std::make_shared<const MeshSolid>(*closed_)),
        asset_(std::make_shared<const Asset>(bake(*closed_, {.max_spheres = spheres}))) {}

  Body& at(double scale) {
    std::unique_ptr<Body>& body = bodies_[scale];
    if (!body) body = std::make_unique<Body>(closed_, solid_, asset_, scale);
    return *body;
  }
  const Eigen::AlignedBox3d& bounds() const { return closed_->report.bounds; }

 private:
  std::shared_ptr<const ClosedMesh> closed_;
  std::shared_ptr<const MeshSolid> solid_;
  std::shared_ptr<const Asset> asset_;
  std::map<double, std::unique_ptr<Body>> bodies_;
};

/// Two placed solids and their known properties. A rests at the identity.
struct ContactCase {
  std::string name;
  Body* a = nullptr;
  Body* b = nullptr;
  Pose pose_b;
  bool held = false;            ///< one solid holds the other: no surface crosses
  double surface_distance = 0;  ///< [u]
  /// Unit: the direction in which B leaves A, against the exact gradient of the volume (FCL's mean
  /// normal where the crossing is too small to integrate over); zero where they do not cross.
  Eigen::Vector3d exit = Eigen::Vector3d::Zero();

  bool cross() const { return surface_distance == 0; }
  bool meet() const { return cross() || held; }
};

/// The verdict of the three libraries on a case.
struct ContactVerdict {
  std::vector<std::string> wrong;  ///< statements above that are false: none may be
  bool matched = false;            ///< overlap > 0 in that measure
  bool protrusion = false;         ///< matched, though the solids are apart
  bool shallow = false;            ///< crossing, within the band
  bool fcl = false, bullet = false;
  double interval_width = 0;  ///< [u] of the certified distances
  double held_share = 0;      ///< of a held solid: matched overlap / its volume
};

/// Angles to the exit direction [degrees].
struct ForceAngles {
  double ist = 0, fcl = 0, bullet = 0;
  Penetration found;  ///< by ist
};

/// Asks all three libraries.
class ContactJudge {
 public:
  ContactVerdict judge(const ContactCase& c) {
    const Body &a = *c.a, &b = *c.b;
    const PlacedAsset place_a = a.at({}), place_b = b.at(c.pose_b);
    const Penetration inner =
        penetration(place_a, place_b, {.measure = Measure::inner}, workspace_);
    const Penetration matched = penetration(place_a, place_b, {}, workspace_);
    const Separation gap = separation(place_a, place_b, {}, workspace_);
    const double d = c.surface_distance;
    constexpr double kDigits = 1e-11;  // that it has
    ContactVerdict verdict;
    const auto require = [&](bool holds, const std::string& otherwise) {
      if (!holds) verdict.wrong.push_back(otherwise);
    };
    verdict.fcl = fcl_in_contact(a.fcl, {}, b.fcl, c.pose_b);
    verdict.bullet = bullet_.contacts(c.a->bullet, {}, c.b->bullet, c.pose_b).any();
    verdict.matched = matched.volume > 0;
    verdict.interval_width = gap.distance_max - gap.distance_min;
    if (!c.meet()) {
      require(inner.volume == 0, "inner spheres overlap, the solids are apart");
      require(gap.distance_min <= d + kDigits, "the solids are closer than distance_min");
      require(gap.distance_max >= d - kDigits, "the solids are further apart than distance_max");
      verdict.protrusion = verdict.matched;
      require(!verdict.matched || d <= a.protrusion + b.protrusion,
              "matched overlap beyond both protrusions");
      return verdict;
    }
    require(gap.distance_min == 0, "the solids meet, the interval says that they do not");
    if (c.held) {
      require(verdict.matched, "a held solid was missed");
      verdict.held_share = matched.volume / std::min(a.volume(), b.volume());
    } else {
      verdict.shallow = shallow(c);
      require(verdict.matched || verdict.shallow, "crossing deeper than the band was missed");
    }
    return verdict;
  }

  /// For crossing surfaces.
  ForceAngles angles(const ContactCase& c) {
    const Penetration found = penetration(c.a->at({}), c.b->at(c.pose_b), {}, workspace_);
    return {
        degrees_between(found.force, c.exit),
        degrees_between(fcl_contacts(c.a->fcl, {}, c.b->fcl, c.pose_b).push_b, c.exit),
        degrees_between(bullet_.contacts(c.a->bullet, {}, c.b->bullet, c.pose_b).push_b, c.exit),
        found};
  }

 private:
  /// Does moving B out by w end the contact?
  static bool shallow(const ContactCase& c) {
    const double w = c.a->missed_layer + c.b->missed_layer + c.a->protrusion + c.b->protrusion;
    Pose out = c.pose_b;
    for (int k = 0; k < 3; ++k) out.t[k] += w * c.exit[k];
    return !fcl_in_contact(c.a->fcl, {}, c.b->fcl, out);
  }

  Workspace workspace_;
  BulletNarrowPhase bullet_;
};

/// A row of the oracle, whose distances and forces are exact.
inline ContactCase case_of(const OracleRow& row, Model& a, Model& b) {
  ContactCase c;
  c.name = "row " + std::to_string(row.id) + " (" + row.pose_class + ")";
  c.a = &a.at(1);
  c.b = &b.at(row.scale_b);
  c.pose_b = row.pose;
  c.held = row.volume > 0 && row.surface_distance > 0;
  c.surface_distance = row.surface_distance;
  if (c.cross()) c.exit = row.force.normalized();
  return c;
}

constexpr double kSurfacePoints = 50'000;

/// Gradient of the overlap's volume by the divergence theorem: B's outward normal, integrated over
/// the part of B's surface that lies in A. Midpoints of some `points` equal parts of the triangles;
/// zero where a hundred or less of them lie in A.
inline Eigen::Vector3d gradient_by_surface(const ContactCase& c, double points) {
  const Eigen::Isometry3d b_to_a = to_isometry(c.pose_b);
  const TriangleMesh& mesh = c.b->closed->mesh;
  std::vector<Eigen::Vector3d> placed;
  for (const Eigen::Vector3d& v : mesh.vertices) placed.push_back(b_to_a * (c.b->scale * v));
  const auto area_of = [&](const auto& t) -> Eigen::Vector3d {
    return (placed[t[1]] - placed[t[0]]).cross(placed[t[2]] - placed[t[0]]) / 2;
  };
  double total = 0;
  for (const auto& t : mesh.triangles) total += area_of(t).norm();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int all_inside = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d area = area_of(t), &o = placed[t[0]];
    const int n = std::max(1, static_cast<int>(std::ceil(std::sqrt(area.norm() / total * points))));
    const Eigen::Vector3d u = (placed[t[1]] - o) / n, v = (placed[t[2]] - o) / n;
    int inside = 0;  // of n² small triangles
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        inside += c.a->holds(o + (i + 1.0 / 3) * u + (j + 1.0 / 3) * v);
        if (i + j + 1 < n) inside += c.a->holds(o + (i + 2.0 / 3) * u + (j + 2.0 / 3) * v);
      }
    sum += area * (static_cast<double>(inside) / n / n);
    all_inside += inside;
  }
  return all_inside > 100 ? sum : Eigen::Vector3d::Zero();
}

/// Winding number by solid angles over all triangles: slow, and independent of the library.
inline double winding_number(const TriangleMesh& mesh, const Eigen::Vector3d& x) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]] - x, b = mesh.vertices[t[1]] - x,
                          c = mesh.vertices[t[2]] - x;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum +=
        std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (2 * std::numbers::pi);
}

/// For surfaces that do not cross and meshes of one component: does either solid contain the other?
inline bool one_holds_the_other(const ContactCase& c) {
  const Eigen::Isometry3d b_to_a = to_isometry(c.pose_b);
  const Eigen::Vector3d of_b = b_to_a * (c.b->scale * c.b->closed->mesh.vertices.front());
  const Eigen::Vector3d of_a =
      b_to_a.inverse() * (c.a->scale * c.a->closed->mesh.vertices.front()) / c.b->scale;
  return winding_number(c.a->closed->mesh, of_b / c.a->scale) > 0.5 ||
         winding_number(c.b->closed->mesh, of_a) > 0.5;
}

/// Random places of B about A. A third of them has B small, perhaps held. For meshes of one
/// component that do not cross themselves; FCL's distance, a winding number and the surface
/// integral above decide what is true.
class RandomContacts {
 public:
  /// `size_b`: B's diagonal over A's.
  RandomContacts(Model& a, Model& b, double size_b, unsigned seed)
      : a_(a),
        b_(b),
        scale_(size_b * a.bounds().diagonal().norm() / b.bounds().diagonal().norm()),
        random_(seed) {}

  ContactCase next() {
    ContactCase c;
    const bool is_small = count_ % 3 == 0;
    c.name = "pose " + std::to_string(count_++);
    c.a = &a_.at(1);
    c.b = &b_.at(is_small ? 0.1 * scale_ : scale_);
    const Eigen::AlignedBox3d &box_a = a_.bounds(), &box_b = b_.bounds();
    const double w = around(), x = around(), y = around(), z = around();
    const Eigen::Quaterniond q = Eigen::Quaterniond(w, x, y, z).normalized();
    // B's box centre falls somewhere in A's box, grown by half of B's diagonal unless B is small.
    const double grow = is_small ? 0 : 0.5 * scale_ * box_b.diagonal().norm();
    const Eigen::Vector3d share(uniform(), uniform(), uniform());
    const Eigen::Vector3d target =
        box_a.min() - Eigen::Vector3d::Constant(grow) +
        share.cwiseProduct(box_a.sizes() + Eigen::Vector3d::Constant(2 * grow));
    const Eigen::Vector3d t = target - q * (c.b->scale * box_b.center());
    c.pose_b = {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
    if (fcl_in_contact(c.a->fcl, {}, c.b->fcl, c.pose_b)) {
      const Eigen::Vector3d gradient = gradient_by_surface(c, kSurfacePoints);
      c.exit = gradient.isZero(0) ? fcl_contacts(c.a->fcl, {}, c.b->fcl, c.pose_b).push_b
                                  : Eigen::Vector3d(-gradient);
      c.exit.normalize();
    } else {
      c.surface_distance = fcl_distance(c.a->fcl, {}, c.b->fcl, c.pose_b);
      c.held = one_holds_the_other(c);
    }
    return c;
  }

 private:
  double uniform() { return double(random_() >> 11) * 0x1p-53; }
  double around() { return 2 * uniform() - 1; }

  Model &a_, &b_;
  double scale_;
  std::mt19937_64 random_;
  int count_ = 0;
};

}  // namespace ist::testing
