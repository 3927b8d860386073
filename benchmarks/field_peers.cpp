// A tree against planes and boxes beside FCL and Bullet, which have these shapes too: volume and
// direction of the force against exact answers, and time.

#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/halfspace.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <ist/shapes.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "report.h"
#include "support/bullet_mesh.h"
#include "support/fcl_mesh.h"
#include "support/oracle_rows.h"
#include "support/turns.h"
#include "timing.h"

namespace {

using Eigen::Vector3d;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::testing::degrees_between;
using ist::testing::MeshContacts;

/// The corner of planes n · (x − apex) ≤ 0, up to three.
struct Wedge {
  Vector3d apex;
  std::vector<Vector3d> normals;
};

struct Exact {
  double volume = 0;
  Vector3d gradient = Vector3d::Zero();  ///< of the volume by the mesh's translation
};

/// Of a closed mesh inside a wedge: what its planes cut lies in cones of no height from the apex.
Exact exact_overlap(const ist::TriangleMesh& mesh, const ist::Pose& pose, const Wedge& wedge) {
  const Eigen::Isometry3d placed = ist::to_isometry(pose);
  Exact sum;
  std::vector<Vector3d> polygon, kept;
  for (const auto& t : mesh.triangles) {
    polygon.clear();
    for (const std::uint32_t v : t) polygon.push_back(placed * mesh.vertices[v] - wedge.apex);
    for (const Vector3d& n : wedge.normals) {
      kept.clear();
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector3d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
        const double dp = n.dot(p), dq = n.dot(q);
        if (dp <= 0) kept.push_back(p);
        if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
      }
      polygon.swap(kept);
      if (polygon.size() < 3) break;
    }
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      const Vector3d area = (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]) / 2;
      sum.volume += polygon[0].dot(area) / 3;
      sum.gradient += area;
    }
  }
  return sum;
}

/// Errors and times of one shape.
struct Rows {
  std::vector<double> volume_error, fraction;
  std::vector<double> angle[3], time[3];  ///< [°] and [µs] of ist, FCL, Bullet
  std::size_t none[3] = {};               ///< rows without a contact
};

class Scene {
 public:
  Scene(const std::string& mesh, std::size_t spheres)
      : closed_(ist::close_mesh(ist::load_mesh(ist::testing::oracle_mesh_path(mesh)), mesh)),
        asset_(bake(closed_, spheres)),
        fcl_(closed_.mesh),
        bullet_(closed_.mesh),
        size_(closed_.report.bounds.diagonal().norm()) {}

  /// Poses at which the mesh shares `fraction` of itself with a plane, or a box's face, edge or
  /// corner.
  void run(bool box, int poses, Rows& rows) {
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> normal;
    for (int i = 0; i < poses; ++i) {
      Eigen::Quaterniond q(normal(random), normal(random), normal(random), normal(random));
      q.normalize();
      const double half = 2 * size_;
      Wedge wedge;
      Vector3d out;
      if (box) {
        wedge.apex = Vector3d::Constant(half);
        const int faces = 1 + i % 3;
        Vector3d from = Vector3d::Zero();
        for (int k = 0; k < 3; ++k) {
          wedge.normals.push_back(Vector3d::Unit(k));
          from[k] = k < faces ? half : 0;
        }
        out = Vector3d::Zero();
        for (int k = 0; k < faces; ++k) out[k] = 0.2 + uniform(random);
        out.normalize();
        from_ = from;
      } else {
        wedge.apex = from_ = Vector3d::Zero();
        wedge.normals = {Vector3d::UnitZ()};
        out = Vector3d::UnitZ();
      }
      const double wanted = std::pow(10.0, -4 + 3.5 * uniform(random)) * closed_.report.volume;
      double near = -size_, far = 2 * size_;
      for (int step = 0; step < 40; ++step) {
        const double middle = (near + far) / 2;
        const Exact at = exact_overlap(closed_.mesh, pose(q, from_ + middle * out), wedge);
        (at.volume > wanted ? near : far) = middle;
      }
      measure(pose(q, from_ + near * out), box, half, wedge, rows);
    }
  }

 private:
  static ist::Asset bake(const ist::ClosedMesh& mesh, std::size_t spheres) {
    ist::PackingSettings settings;
    settings.max_spheres = spheres;
    return ist::bake(mesh, settings);
  }

  static ist::Pose pose(const Eigen::Quaterniond& q, const Vector3d& t) {
    return {{q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}};
  }

  template <class Ask>
  static double least_time(const Ask& ask) {
    double least = 1e9;
    for (int i = 0; i < 5; ++i) {
      const double start = ist::benchmark::thread_seconds();
      ask();
      least = std::min(least, ist::benchmark::thread_seconds() - start);
    }
    return 1e6 * least;
  }

  void measure(const ist::Pose& at, bool box, double half, const Wedge& wedge, Rows& rows) {
    const Exact exact = exact_overlap(closed_.mesh, at, wedge);
    ist::PlacedShape field;
    if (box) {
      field.shape = ist::BoxShape{Vector3d::Constant(half)};
    } else {
      field.shape = ist::HalfSpaceShape{};
    }
    const ist::PlacedAsset tree{asset_.view(), at, 1};
    ist::Penetration found;
    rows.time[0].push_back(
        least_time([&] { found = ist::penetration(field, tree, {}, workspace_); }));
    MeshContacts by_fcl, by_bullet;
    rows.time[1].push_back(least_time([&] { by_fcl = ask_fcl(at, box, half); }));
    rows.time[2].push_back(least_time([&] { by_bullet = ask_bullet(at, box, half); }));
    rows.volume_error.push_back(std::abs(found.volume / exact.volume - 1));
    rows.fraction.push_back(exact.volume / closed_.report.volume);
    const Vector3d truth = -exact.gradient;
    const Vector3d pushes[3] = {found.force, by_fcl.push_b, by_bullet.push_b};
    for (int k = 0; k < 3; ++k) {
      const bool none = !(pushes[k].norm() > 0);
      rows.none[k] += none ? 1 : 0;
      rows.angle[k].push_back(none ? 180 : degrees_between(pushes[k], truth));
    }
  }

  MeshContacts ask_fcl(const ist::Pose& at, bool box, double half) {
    const fcl::Boxd shape(2 * half, 2 * half, 2 * half);
    const fcl::Halfspaced plane(Vector3d::UnitZ(), 0);
    fcl::CollisionResultd result;
    const fcl::CollisionRequestd all(std::numeric_limits<int>::max(), true);
    const fcl::CollisionGeometryd* const other =
        box ? static_cast<const fcl::CollisionGeometryd*>(&shape) : &plane;
    fcl::collide(fcl_.model(), ist::to_isometry(at), other, fcl::Transform3d::Identity(), all,
                 result);
    MeshContacts sum;
    sum.count = result.numContacts();
    for (std::size_t i = 0; i < sum.count; ++i) {
      const fcl::Contactd& contact = result.getContact(i);
      const double depth = std::max(0.0, contact.penetration_depth);
      sum.push_b -= depth * contact.normal;  // from the mesh to the shape
    }
    return sum;
  }

  MeshContacts ask_bullet(const ist::Pose& at, bool box, double half) {
    btStaticPlaneShape plane(btVector3(0, 0, 1), 0);
    btBoxShape shape(btVector3(half, half, half));
    plane.setMargin(0);
    shape.setMargin(0);
    btCollisionObject other;
    other.setCollisionShape(box ? static_cast<btCollisionShape*>(&shape) : &plane);
    return bullet_phase_.contacts(other, bullet_.at(at));
  }

  const ist::ClosedMesh closed_;
  const ist::Asset asset_;
  const ist::testing::FclMesh fcl_;
  ist::testing::BulletMesh bullet_;
  ist::testing::BulletNarrowPhase bullet_phase_;
  const double size_;
  ist::Workspace workspace_;
  Vector3d from_ = Vector3d::Zero();
};

void write(Report& report, const std::string& name, const Rows& rows) {
  const char* const peers[3] = {"ist", "FCL", "Bullet"};
  Report::Json row = {{"shape", name},
                      {"rows", rows.volume_error.size()},
                      {"volume error median", quantile(rows.volume_error, 0.5)},
                      {"p95", quantile(rows.volume_error, 0.95)}};
  for (int k = 0; k < 3; ++k) {
    const std::string peer = peers[k];
    row[peer + " force median °"] = quantile(rows.angle[k], 0.5);
    row[peer + " p95 °"] = quantile(rows.angle[k], 0.95);
    row[peer + " no contact"] = rows.none[k];
    row[peer + " median µs"] = quantile(rows.time[k], 0.5);
    row[peer + " p99 µs"] = quantile(rows.time[k], 0.99);
  }
  report.row("Meshes on planes and boxes", row);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("field_peers", argc, argv);
  report.page("Planes and boxes, beside FCL and Bullet");
  const std::size_t spheres = report.quick() ? 1'000 : 4'000;
  const int poses = report.quick() ? 30 : 300;
  report.remark(
      "Assets of " + std::to_string(spheres) +
      " spheres against a half-space and a box of four times the solid's diagonal, at its "
      "faces, edges and corners in turn; random rotations, overlaps of 0.01 to 30 % of the "
      "solid. Exact: the mesh, clipped by the planes.");
  report.remark(
      "Force: angle to the exact gradient; FCL, Bullet: of the depth-weighted mean of their "
      "contact "
      "normals, 180° without a contact. Only ist tells a volume. Times are of one thread, the "
      "least "
      "of five asks of a pose.");
  for (const char* mesh : {"dino", "elephant"}) {
    Scene scene(mesh, spheres);
    for (const bool box : {false, true}) {
      Rows rows;
      scene.run(box, poses, rows);
      write(report, std::string(mesh) + (box ? " on a box" : " on a plane"), rows);
    }
  }
  return report.write();
}
