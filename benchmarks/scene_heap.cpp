// A whole step of a heap of mixed meshes: ist::Scene finds the pairs and answers them by the exact
// measure; Bullet's collision world does its broad and narrow phase with GImpact, and with convex
// hulls. One thread.

#include <BulletCollision/CollisionShapes/btShapeHull.h>
#include <btBulletDynamicsCommon.h>
#include <ist/bake.h>
#include <ist/mesh.h>
#include <ist/scene.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "report.h"
#include "support/bullet_mesh.h"
#include "support/shared_data.h"
#include "timing.h"

namespace {

using ist::Pose;
using ist::benchmark::quantile;
using ist::benchmark::Report;
using ist::benchmark::thread_seconds;
using ist::testing::bullet_transform;

/// A mesh of size 1 as each of them has it. The meshes lie inside their hulls, which meet first:
/// where solids are asked they are 5 % larger, so that they overlap.
struct Solid {
  static constexpr double kLarger = 1.05;

  explicit Solid(ist::TriangleMesh mesh, const std::string& name)
      : asset(baked(mesh, name)), surface(mesh, kLarger) {
    btConvexHullShape all;
    for (const Eigen::Vector3d& v : mesh.vertices) all.addPoint({v.x(), v.y(), v.z()}, false);
    all.recalcLocalAabb();
    all.setMargin(0);
    btShapeHull few(&all);
    few.buildHull(0);
    for (int i = 0; i < few.numVertices(); ++i) {
      small.addPoint(few.getVertexPointer()[i], false);
      large.addPoint(kLarger * few.getVertexPointer()[i], false);
    }
    for (btConvexHullShape* const hull : {&small, &large}) {
      hull->recalcLocalAabb();
      hull->setMargin(0);
    }
  }

  /// The mesh becomes of size 1.
  static ist::Asset baked(ist::TriangleMesh& mesh, const std::string& name) {
    Eigen::Vector3d low = mesh.vertices[0], high = low;
    for (const Eigen::Vector3d& v : mesh.vertices) low = low.cwiseMin(v), high = high.cwiseMax(v);
    const double size = (high - low).maxCoeff();
    const Eigen::Vector3d middle = (low + high) / 2;
    for (Eigen::Vector3d& v : mesh.vertices) v = (v - middle) / size;
    return ist::bake_mesh_only(ist::close_mesh(mesh, name));
  }

  ist::Asset asset;
  ist::testing::BulletMesh surface;
  btConvexHullShape small, large;  ///< as the heap is moved, and as it is asked
};

/// Bullet's collision world over shapes of its own.
struct World {
  World() : dispatcher(&configuration), world(&dispatcher, &broadphase, &configuration) {
    btGImpactCollisionAlgorithm::registerAlgorithm(&dispatcher);
  }
  void add(btCollisionShape* shape, const Pose& pose) {
    objects.push_back(std::make_unique<btCollisionObject>());
    objects.back()->setCollisionShape(shape);
    objects.back()->setWorldTransform(bullet_transform(pose));
    world.addCollisionObject(objects.back().get());
  }
  /// Returns the pairs with contacts.
  int step(const std::vector<Pose>& poses) {
    for (std::size_t i = 0; i < poses.size(); ++i)
      objects[i]->setWorldTransform(bullet_transform(poses[i]));
    world.performDiscreteCollisionDetection();
    int pairs = 0;
    for (int i = 0; i < dispatcher.getNumManifolds(); ++i)
      pairs += dispatcher.getManifoldByIndexInternal(i)->getNumContacts() > 0;
    return pairs;
  }
  ~World() {
    for (const auto& object : objects) world.removeCollisionObject(object.get());
  }
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher;
  btDbvtBroadphase broadphase;
  btCollisionWorld world;
  std::vector<std::unique_ptr<btCollisionObject>> objects;
};

/// Hulls that fall into a box without a lid, step by step.
class Heap {
 public:
  Heap(std::vector<std::unique_ptr<Solid>>& solids, std::size_t count)
      : dispatcher_(&configuration_),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> turns(-1, 1);
    const auto row = static_cast<std::size_t>(std::cbrt(static_cast<double>(count)));
    for (std::size_t i = 0; i < count; ++i) {
      Pose pose = {{turns(random), turns(random), turns(random), turns(random)},
                   {1.1 * static_cast<double>(i % row), 1.1 * static_cast<double>(i / row % row),
                    1 + 1.1 * static_cast<double>(i / row / row)}};
      add(&solids[i % solids.size()]->small, 1, bullet_transform(pose));
    }
    const double wide = 1.1 * static_cast<double>(row);
    const btVector3 normals[] = {{0, 0, 1}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
    for (const btVector3& normal : normals) {
      const bool far = normal.x() + normal.y() < 0;
      planes_.push_back(std::make_unique<btStaticPlaneShape>(normal, far ? -wide : -0.6));
      add(planes_.back().get(), 0, btTransform::getIdentity());
    }
  }
  ~Heap() {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  std::vector<Pose> step(std::size_t count) {
    world_.stepSimulation(1.0 / 60, 0);
    std::vector<Pose> now(count);
    for (std::size_t i = 0; i < count; ++i) {
      const btTransform& at = bodies_[i]->getWorldTransform();
      const btQuaternion q = at.getRotation();
      now[i] = {{q.w(), q.x(), q.y(), q.z()},
                {at.getOrigin().x(), at.getOrigin().y(), at.getOrigin().z()}};
    }
    return now;
  }

 private:
  void add(btCollisionShape* shape, btScalar mass, const btTransform& at) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    bodies_.push_back(std::make_unique<btRigidBody>(mass, nullptr, shape, inertia));
    bodies_.back()->setWorldTransform(at);
    world_.addRigidBody(bodies_.back().get());
  }
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::vector<std::unique_ptr<btCollisionShape>> planes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

template <class Step>
double timed_ms(const Step& step) {
  const double start = thread_seconds();
  step();
  return 1e3 * (thread_seconds() - start);
}

}  // namespace

int main(int argc, char** argv) {
  Report report("scene_heap", argc, argv);
  report.page("A heap of mixed meshes");
  std::vector<std::unique_ptr<Solid>> solids;
  std::size_t triangles = 0;
  for (const char* name : {"spot.obj", "torus.off", "mug.ply", "adis16480.stl",
                           "hole_tray_round_16mm.obj", "bolt_gen.ply", "nut_gen.ply"}) {
    const std::filesystem::path path = ist::testing::shared_path(std::string("meshes/dev/") + name);
    if (!std::filesystem::exists(path)) {
      std::cerr << "scene_heap: no " << path << " (IST_SHARED)\n";
      return 1;
    }
    ist::TriangleMesh mesh = ist::load_mesh(path.string());
    triangles += mesh.triangles.size();
    solids.push_back(std::make_unique<Solid>(std::move(mesh), name));
  }
  const std::size_t count = report.quick() ? 100 : 2'000;
  report.remark(
      "Seven meshes (spot, torus, mug, a sensor's housing, a tray with a hole, bolt, nut) of " +
      std::to_string(triangles / solids.size()) +
      " triangles on average, scaled to size 1, fell as convex hulls into a box for four seconds; "
      "then steps of 1/60 s are asked, the meshes 5 % larger so that they overlap. ist::Scene "
      "finds the pairs and their exact penetrations; Bullet's collision world does its broad and "
      "narrow phase. One thread, thread CPU time, medians. Walls and floor are in none.");
  Heap heap(solids, count);
  std::vector<Pose> poses;
  for (int k = 0; k < 240; ++k) poses = heap.step(count);

  ist::Scene scene({.max_bodies = count, .max_pairs = 64 * count, .patches_per_pair = 1});
  ist::SceneRule rule;
  rule.penetration.measure = ist::Measure::exact;
  for (std::uint32_t a = 0; a < ist::kSceneGroups; ++a)
    for (std::uint32_t b = a; b < ist::kSceneGroups; ++b) scene.set_rule(a, b, rule);
  World surfaces, hulls;
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < count; ++i) {
    Solid& solid = *solids[i % solids.size()];
    ist::SceneBody body;
    body.number = i;
    body.solid = ist::PlacedSolid(solid.asset.view(), poses[i], Solid::kLarger);
    scene.add(body);
    numbers.push_back(i);
    surfaces.add(solid.surface.shape(), poses[i]);
    hulls.add(&solid.large, poses[i]);
  }
  scene.step();
  hulls.step(poses);
  std::vector<double> ours, gimpacts, convex;
  std::size_t boxes = 0, overlaps = 0;
  int touched = 0, pairs = 0;
  for (int k = 0; k < (report.quick() ? 2 : 5); ++k) {
    poses = heap.step(count);
    ours.push_back(timed_ms([&] {
      scene.set_poses(numbers, poses);
      const ist::SceneStep step = scene.step();
      boxes = step.boxes_met;
      overlaps = step.pairs.size();
    }));
    convex.push_back(timed_ms([&] { pairs = hulls.step(poses); }));
    gimpacts.push_back(timed_ms([&] { touched = surfaces.step(poses); }));
  }
  report.row("Steps", {{"bodies", count},
                       {"pairs of boxes", boxes},
                       {"solids that overlap", overlaps},
                       {"ist ms", quantile(ours, 0.5)},
                       {"GImpact's pairs", touched},
                       {"GImpact ms", quantile(gimpacts, 0.5)},
                       {"hulls' pairs", pairs},
                       {"hulls ms", quantile(convex, 0.5)},
                       {"GImpact / ist", quantile(gimpacts, 0.5) / quantile(ours, 0.5)},
                       {"hulls / ist", quantile(convex, 0.5) / quantile(ours, 0.5)}});
  return report.write();
}
