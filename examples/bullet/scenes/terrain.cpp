#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include <algorithm>
#include <cmath>

#include "meshes.h"
#include "scene_tools.h"

// m, kg, s. Toys roll and slide down the sides of a hollow with bumps and come to rest about a
// boulder in its middle. The ground is heights that Bullet and ist cut into the same triangles, the
// boulder one of Bullet's balls.

namespace {

constexpr std::uint32_t kPoints = 41;
constexpr double kSpacing = 0.1, kHalf = 0.5 * kSpacing * (kPoints - 1), kBoulder = 0.25;

double height(double x, double y) {
  return 0.25 * (x * x + y * y) + 0.02 * std::sin(5 * x) * std::cos(4 * y);
}

/// Of heights, or of the same triangles as a mesh.
SceneResult run(const SceneOptions& options, bool mesh) {
  constexpr double kTube = 0.04, kRing = 0.11, kBall = 0.08;
  std::vector<std::pair<double, double>> tube;
  for (int i = 0; i < 24; ++i) {
    const double a = 2 * std::numbers::pi * i / 24;
    tube.emplace_back(kRing + kTube * std::cos(a), kTube * std::sin(a));
  }
  const Part torus("torus", make_turned(tube, 48), 1000);
  const Part ball("ball", make_ball(kBall, 48), 1000);
  const Part cube("cube", make_box(Eigen::Vector3d::Constant(0.07)), 1000);

  WorldSettings settings = world_settings(options);
  settings.margin = 0.001;
  set_law(settings, kWood * torus.volume(), 0.0005, 0.0005, 1);

  std::vector<float> heights;
  for (std::uint32_t j = 0; j < kPoints; ++j)
    for (std::uint32_t i = 0; i < kPoints; ++i)
      heights.push_back(static_cast<float>(height(i * kSpacing - kHalf, j * kSpacing - kHalf)));
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  // Bullet's shape is centred. Its cells are cut as ist's are.
  auto terrain = std::make_unique<btHeightfieldTerrainShape>(kPoints, kPoints, heights.data(),
                                                             *lowest, *highest, 2, true);
  terrain->setLocalScaling({kSpacing, kSpacing, 1});
  btTriangleMesh triangles;
  if (mesh) {
    struct : btTriangleCallback {
      btTriangleMesh* mesh;
      void processTriangle(btVector3* c, int, int) override {
        mesh->addTriangle(c[0], c[2], c[1]);  // the heights' are clockwise from above
      }
    } copy;
    copy.mesh = &triangles;
    terrain->processAllTriangles(&copy, {-kHalf, -kHalf, -kHalf}, {kHalf, kHalf, kHalf});
  }
  SceneWorld world(settings);
  std::unique_ptr<btCollisionShape> shape = std::move(terrain);
  if (mesh) shape = std::make_unique<btBvhTriangleMeshShape>(&triangles, true);
  btRigidBody& ground =
      world.add_still(std::move(shape), place({0, 0, 0.5 * (*lowest + *highest)}), kFriction);
  btRigidBody& boulder = world.add_still(std::make_unique<btSphereShape>(kBoulder),
                                         place({0, 0, 0.5 * kBoulder}), kFriction);
  const Part* const parts[] = {&torus, &ball, &cube};
  constexpr int kBodies = 9;
  for (int i = 0; i < kBodies; ++i) {
    const double angle = 2 * std::numbers::pi * i / kBodies, out = 0.7 + 0.1 * i;
    const double x = out * std::cos(angle), y = out * std::sin(angle);
    btRigidBody& body = world.add(
        *parts[i % 3], kWood, place({x, y, height(x, y) + 0.25}, turn(i, {1, 2, 3})), kFriction);
    body.setDamping(0.1, 0.6);  // what rolls rolls for long: grass takes some of it
  }

  Run run(world, options);
  const double seconds = options.seconds > 0 ? options.seconds : 8;
  run.go(0.8 * seconds);
  WeightOn weight(world, {&ground, &boulder});
  run.go(0.2 * seconds, [&] { weight.look(); });
  int above = 0;
  for (const SceneWorld::Body& body : world.bodies()) {
    if (body.rigid->getInvMass() == 0) continue;
    const Eigen::Vector3d at = to_eigen(body.rigid->getCenterOfMassPosition());
    above += at.head<2>().norm() < kHalf && at.z() > height(at.x(), at.y());
  }
  SceneResult result = run.finish(
      2 * kBall,
      {{"bodies in the hollow, over the ground", static_cast<double>(above), kBodies, kBodies},
       {"force over weight", weight.along(), 0.99, 1.01},
       {"sideways force over weight", weight.across(), 0, 0.01}});
  result.truths.push_back({"deepest penetration, of a ball", result.deepest / result.size, 0, 0.1});
  result.truths.push_back({"kinetic energy, of weight times ball",
                           result.kinetic_energy / (total_mass(world) * kGravity * 2 * kBall), 0,
                           1e-4});
  return result;
}

}  // namespace

SceneResult run_terrain(const SceneOptions& options) { return run(options, false); }
SceneResult run_level(const SceneOptions& options) { return run(options, true); }
