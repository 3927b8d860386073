#include <ist/bake.h>
#include <ist/types.h>

#include <cstring>
#include <string>
#include <vector>

#include "packing/calibrate/calibration.h"
#include "packing/cover/cover.h"
#include "support/gpu_test.h"
#include "support/on_host.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

// Calibration, cover radii and whole bakes on the card, against the CPU: the same bytes.

namespace ist {
namespace {

using Eigen::Vector3d;
using testing::closed;

class GpuBake : public testing::GpuTest {};

std::vector<Sphere> packed_on_cpu(const MeshSolid& solid, std::size_t count) {
  PackingSettings settings;
  settings.max_spheres = count;
  settings.device = Device::cpu;
  return pack(solid, settings).spheres;
}

void expect_same(const ClosedMesh& mesh, std::size_t count) {
  SCOPED_TRACE(mesh.name + ", " + std::to_string(count));
  const MeshSolid solid(mesh);
  const std::vector<Sphere> inner = packed_on_cpu(solid, count);
  const auto on_gpu = make_backend(solid, Device::cuda);
  const Calibration host = testing::calibrate_on_host(solid, inner);
  const Calibration card = testing::calibrate(solid, *on_gpu, inner, {});
  EXPECT_EQ(
      std::memcmp(host.matched.data(), card.matched.data(), host.matched.size() * sizeof(Sphere)),
      0);
  EXPECT_EQ(host.protrusion, card.protrusion);
  EXPECT_EQ(testing::cover_on_host(solid, inner), cover_radii(solid, *on_gpu, inner, {}));
}

TEST_F(GpuBake, CalibrationAndCoverAreThoseOfTheCpu) {
  const TriangleMesh plate = testing::box_mesh(Vector3d(0, 0, 0), Vector3d(1, 1, 1e-2));
  for (const std::size_t count : {1, 40, 700}) {
    expect_same(closed(testing::cube_mesh(), "cube"), count);
    expect_same(closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"), count);
    expect_same(closed(testing::overlapping_cubes_mesh(), "overlapping cubes"), count);
    expect_same(closed(plate, "plate"), count);
  }
}

/// A plate across x is turned before it is cut into columns, a slanted needle too.
TEST_F(GpuBake, TurnedSolidsAreThoseOfTheCpu) {
  TriangleMesh needle = testing::box_mesh(Vector3d(-1, -5e-3, -5e-3), Vector3d(1, 5e-3, 5e-3));
  for (Vector3d& v : needle.vertices) v = Vector3d(v.x() - v.y(), v.x() + v.y(), v.z() + v.x());
  expect_same(closed(needle, "needle"), 30);
  expect_same(closed(testing::box_mesh(Vector3d(0, 0, 0), Vector3d(1, 1e-2, 1)), "plate"), 30);
}

TEST_F(GpuBake, RealMeshesAreThoseOfTheCpu) {
  IST_NEEDS_SHARED("oracle/meshes/dino.off");
  for (const char* file : {"oracle/meshes/dino.off", "oracle/meshes/elephant.off"}) {
    const std::string path = testing::shared_path(file).string();
    expect_same(close_mesh(load_mesh(path), file), 3000);
  }
}

/// Without levels of detail and with two, which are made beside the finest; the plate is turned.
TEST_F(GpuBake, AssetsAreThoseOfTheCpu) {
  for (const ClosedMesh& mesh :
       {closed(testing::torus_mesh(1, 0.3, 64, 32), "torus"),
        closed(testing::box_mesh(Vector3d(0, 0, 0), Vector3d(1, 1e-2, 1)), "plate")})
    for (const std::size_t spheres : {500, 4200}) {
      SCOPED_TRACE(mesh.name + ", " + std::to_string(spheres));
      PackingSettings settings;
      settings.max_spheres = spheres;
      settings.device = Device::cpu;
      const Asset host = bake(mesh, settings);
      settings.device = Device::cuda;
      const Asset card = bake(mesh, settings);
      ASSERT_EQ(host.bytes().size(), card.bytes().size());
      EXPECT_EQ(std::memcmp(host.bytes().data(), card.bytes().data(), host.bytes().size()), 0);
    }
}

TEST_F(GpuBake, CancellingEndsAWholeBake) {
  const ClosedMesh torus = closed(testing::torus_mesh(1, 0.3, 64, 32), "torus");
  PackingSettings settings;
  settings.max_spheres = 4200;
  settings.device = Device::cuda;
  for (const std::string stage : {"calibrate", "cover", "tree"})
    EXPECT_THROW(bake(torus, settings, [&](const Progress& now) { return now.stage != stage; }),
                 Error)
        << stage;
  EXPECT_FALSE(bake(torus, settings).bytes().empty());
}

TEST_F(GpuBake, CancellingEndsIt) {
  const MeshSolid solid(closed(testing::cube_mesh(), "cube"));
  const auto on_gpu = make_backend(solid, Device::cuda);
  const Sphere ball = {0, 0, 0, 0.5f};
  const auto cancel = [](const Progress&) { return false; };
  EXPECT_THROW(testing::calibrate(solid, *on_gpu, {&ball, 1}, cancel), Error);
  EXPECT_THROW(cover_radii(solid, *on_gpu, {&ball, 1}, cancel), Error);
}

}  // namespace
}  // namespace ist
