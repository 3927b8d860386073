#include <gtest/gtest.h>
#include <ist/bake.h>
#include <ist/mass_properties.h>
#include <ist/types.h>

#include <cmath>
#include <cstring>
#include <functional>

#include <ist/asset_layout.h>
#include "bake/asset/asset_writer.h"
#include "query/asset/content_hash.h"
#include "support/baked.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

namespace ist {
namespace {

ClosedMesh cube() { return testing::closed(testing::cube_mesh(), "cube"); }

std::vector<std::byte> bytes_of(const Asset& asset) {
  return {asset.bytes().begin(), asset.bytes().end()};
}

const Asset& cube_asset() {
  static const Asset asset = bake(cube(), testing::of_size(60));
  return asset;
}

void expect_all_sound(const std::vector<Invariant>& invariants) {
  EXPECT_GE(invariants.size(), 20u);
  for (const Invariant& one : invariants) {
    EXPECT_EQ(one.violations, 0u) << one.name << ": " << one.worst << " at " << one.where;
    EXPECT_LE(one.worst, 0) << one.name;
    EXPECT_TRUE(one.checked > 0 || one.name == "spheres disjoint" || one.name == "surface inside")
        << one.name;
  }
}

TEST(Check, FindsBakesSound) {
  expect_all_sound(check(cube_asset(), cube()));
  for (const std::size_t n : {1u, 16u, 17u, 400u, 1000u}) {
    const ClosedMesh torus = testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus");
    expect_all_sound(check(bake(torus, testing::of_size(n)), torus));
  }
  const ClosedMesh two = testing::closed(testing::overlapping_cubes_mesh(), "two cubes");
  expect_all_sound(check(bake(two, testing::of_size(300)), two));
}

/// Tetrahedra that fill so little of their boxes that two of the points that a check draws are
/// expected in them, and often there is none.
TEST(Check, FindsThinSolidsSound) {
  for (int i = 0; i < 60; ++i) {
    const double a = i / 60.0, b = i % 7 / 7.0, c = i % 11 / 11.0;
    TriangleMesh thin;
    thin.vertices = {{0, 0, a}, {1, b, 0}, {c, 1, 1}};
    const Eigen::Vector3d normal =
        (thin.vertices[1] - thin.vertices[0]).cross(thin.vertices[2] - thin.vertices[0]);
    thin.vertices.push_back(thin.vertices[0] + 2.4e-4 * normal / normal.squaredNorm());
    thin.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    const ClosedMesh closed = testing::closed(thin, "thin");
    for (const Invariant& one : check(bake_mesh_only(closed), closed))
      EXPECT_EQ(one.violations, 0u) << one.name << ": " << one.worst << " of " << i;
  }
}

TEST(Check, RefusesAnotherMesh) {
  const ClosedMesh other = testing::closed(testing::icosphere_mesh(1), "ball");
  EXPECT_THROW(check(cube_asset(), other), Error);
}

/// A copy of an asset with something changed and the hash made right again.
Asset tampered(const std::function<void(AssetHeader&)>& change,
               const Asset& original = cube_asset()) {
  std::vector<std::byte> bytes = bytes_of(original);
  // The header and the arrays are changed in an aligned copy.
  const std::unique_ptr<std::byte[], void (*)(std::byte*)> block(
      static_cast<std::byte*>(::operator new[](bytes.size(), std::align_val_t{kAssetAlignment})),
      [](std::byte* p) { ::operator delete[](p, std::align_val_t{kAssetAlignment}); });
  std::memcpy(block.get(), bytes.data(), bytes.size());
  change(*reinterpret_cast<AssetHeader*>(block.get()));
  std::memcpy(bytes.data(), block.get(), bytes.size());
  seal(bytes);
  return Asset(bytes, "tampered");
}

template <class T>
T* writable(AssetHeader& header, std::uint64_t offset) {
  return const_cast<T*>(at<T>(header, offset));
}

Sphere& inner(AssetHeader& h, std::size_t i) { return writable<Sphere>(h, h.inner_spheres)[i]; }
Sphere& matched(AssetHeader& h, std::size_t i) { return writable<Sphere>(h, h.matched_spheres)[i]; }
BallBlock& block(AssetHeader& h, const TreeHeader& tree, std::size_t level) {
  return *writable<BallBlock>(h, tree.level[level].blocks);
}
NodeBlock& nodes(AssetHeader& h, const TreeHeader& tree, std::size_t level) {
  return *writable<NodeBlock>(h, tree.level[level].nodes);
}

struct Tampering {
  const char* invariant;  ///< what must turn red
  std::function<void(AssetHeader&)> change;
};

// Every invariant can fail, and the one that is hurt says so.
TEST(Check, TurnsRedForEveryInvariant) {
  const std::vector<Tampering> cases = {
      {"frame", [](AssetHeader& h) { h.exponent += 1; }},
      {"frame", [](AssetHeader& h) { h.centre[1] += 1e-9; }},
      {"solid volume", [](AssetHeader& h) { h.volume *= 1 + 1e-9; }},
      {"sampled volume", [](AssetHeader& h) { h.volume *= 0.9; }},
      {"centre of mass", [](AssetHeader& h) { h.centre_of_mass[2] += 1e-9; }},
      {"centre of mass", [](AssetHeader& h) { h.centre_of_mass_error += 1e-9; }},
      {"inertia", [](AssetHeader& h) { h.inertia[1] *= 1 + 1e-9; }},
      {"inertia", [](AssetHeader& h) { h.inertia[5] += 1e-9; }},
      {"sampled mass", [](AssetHeader& h) { h.centre_of_mass[0] += 0.05; }},
      {"sampled mass", [](AssetHeader& h) { h.inertia[2] *= 1.1; }},
      {"box holds solid", [](AssetHeader& h) { h.box_lower[1] += 1e-9; }},
      {"box is tight", [](AssetHeader& h) { h.box_upper[0] += 1e-9; }},
      {"ball holds solid", [](AssetHeader& h) { h.ball_radius *= 1 - 1e-9; }},
      {"ball holds solid", [](AssetHeader& h) { h.ball_centre[0] += 1e-9; }},
      {"centre inside solid", [](AssetHeader& h) { inner(h, 7).x += 2; }},
      {"sphere clear of surface", [](AssetHeader& h) { inner(h, 3).r *= 1.01f; }},
      {"sphere clear of surface", [](AssetHeader& h) { inner(h, 0).x += 1e-6f; }},
      {"spheres disjoint", [](AssetHeader& h) { inner(h, 0).r *= 1.0001f; }},
      {"spheres disjoint", [](AssetHeader& h) { inner(h, 20) = inner(h, 21); }},
      {"coverage", [](AssetHeader& h) { h.coverage += 1e-6; }},
      {"matched volumes sum to the solid", [](AssetHeader& h) { matched(h, 0).r *= 1.001f; }},
      {"matched protrusion", [](AssetHeader& h) { h.protrusion *= 0.999; }},
      {"cover holds sphere",
       [](AssetHeader& h) { writable<float>(h, h.cover_radii)[0] = 0.9f * inner(h, 0).r; }},
      {"solid covered",
       [](AssetHeader& h) {
         for (std::size_t i = 0; i < h.sphere_count; ++i)
           writable<float>(h, h.cover_radii)[i] *= 0.9f;
       }},
      {"solid covered", [](AssetHeader& h) { writable<float>(h, h.cover_radii)[1] = 0; }},
      {"inner tree: each sphere once",
       [](AssetHeader& h) {
         auto* index = writable<std::uint32_t>(h, h.inner_tree.sphere_index);
         index[5] = index[6];
       }},
      {"inner tree: leaves are the table",
       [](AssetHeader& h) { block(h, h.inner_tree, 0).x[2] += 1e-6f; }},
      {"inner tree: leaves are the table",
       [](AssetHeader& h) { writable<float>(h, h.inner_tree.sphere_cover)[4] *= 1.000001f; }},
      {"inner tree: balls hold spheres",
       [](AssetHeader& h) { block(h, h.inner_tree, 1).r[1] *= 0.99999f; }},
      {"inner tree: balls hold spheres", [](AssetHeader& h) { h.inner_tree.root[3] *= 0.99999; }},
      {"inner tree: cover balls hold covers",
       [](AssetHeader& h) { nodes(h, h.inner_tree, 1).cover[2] *= 0.99999f; }},
      {"inner tree: cover balls hold covers",
       [](AssetHeader& h) { h.inner_tree.root_cover *= 0.99999; }},
      {"inner tree: volume sums",
       [](AssetHeader& h) { nodes(h, h.inner_tree, 1).volume[0] *= 0.99999f; }},
      {"matched tree: each sphere once",
       [](AssetHeader& h) {
         auto* index = writable<std::uint32_t>(h, h.matched_tree.sphere_index);
         index[5] = index[6];
       }},
      {"matched tree: leaves are the table",
       [](AssetHeader& h) { block(h, h.matched_tree, 0).r[2] *= 1.000001f; }},
      {"matched tree: balls hold spheres",
       [](AssetHeader& h) { block(h, h.matched_tree, 1).y[1] += 1e-5f; }},
      {"matched tree: volume sums", [](AssetHeader& h) { h.matched_tree.volume_sum *= 1.0000001; }},
      {"matched tree: overlap bounds", [](AssetHeader& h) { h.matched_tree.overlap = 1; }},
      {"matched tree: overlap bounds",
       [](AssetHeader& h) {
         for (float& kappa : nodes(h, h.matched_tree, 1).overlap) kappa = std::min(kappa, 1.0f);
       }},
      {"inner tree: overlap bounds",
       [](AssetHeader& h) {
         const auto* index = at<std::uint32_t>(h, h.inner_tree.sphere_index);
         inner(h, index[3]) = inner(h, index[2]);  // two in one place
       }},
  };
  for (const Tampering& one : cases) {
    bool red = false;
    for (const Invariant& invariant : check(tampered(one.change), cube()))
      if (invariant.name == one.invariant) red |= invariant.violations > 0;
    EXPECT_TRUE(red) << one.invariant;
  }
}

// A level of detail is checked like the finest.
TEST(Check, TurnsRedForEveryInvariantOfADetail) {
  const Asset asset = bake(cube(), testing::of_size(1000));
  ASSERT_EQ(asset.view().header().detail_count, 1u);
  const auto detail = [](AssetHeader& h) -> DetailLevel& {
    return *writable<DetailLevel>(h, h.details);
  };
  const std::vector<Tampering> cases = {
      {"detail 1: matched volumes sum to the solid",
       [&](AssetHeader& h) { writable<Sphere>(h, detail(h).matched_spheres)->r *= 1.001f; }},
      {"detail 1: matched protrusion", [&](AssetHeader& h) { detail(h).protrusion *= 0.999; }},
      {"detail 1: matched tree: leaves are the table",
       [&](AssetHeader& h) { block(h, detail(h).matched_tree, 0).r[2] *= 1.000001f; }},
      {"detail 1: matched tree: mean radius",
       [&](AssetHeader& h) { detail(h).matched_tree.mean_radius *= 1.000001; }},
      {"detail 1: matched tree: overlap bounds",
       [&](AssetHeader& h) { detail(h).matched_tree.overlap = 1; }},
  };
  for (const Tampering& one : cases) {
    bool red = false;
    for (const Invariant& invariant : check(tampered(one.change, asset), cube()))
      if (invariant.name == one.invariant) red |= invariant.violations > 0;
    EXPECT_TRUE(red) << one.invariant;
  }
}

MeshHeader& kept(AssetHeader& h) { return *writable<MeshHeader>(h, h.mesh); }
MeshBlock* kept_blocks(AssetHeader& h) { return writable<MeshBlock>(h, kept(h).level[0].blocks); }
double* kept_vertices(AssetHeader& h) { return writable<double>(h, kept(h).vertices); }

// So is the mesh.
TEST(Check, TurnsRedForEveryInvariantOfTheMesh) {
  TriangleMesh moved = testing::torus_mesh(1.0, 0.4, 40, 20);
  for (Eigen::Vector3d& v : moved.vertices) v += Eigen::Vector3d(0.1, 0.2, 0.3);
  const ClosedMesh torus = close_mesh(std::move(moved), "torus");
  const Asset asset = bake(torus, testing::of_size(60));
  ASSERT_EQ(asset.view().mesh_state(), MeshState::own);
  ASSERT_EQ(asset.view().mesh_triangles(), torus.mesh.triangles.size());
  expect_all_sound(check(asset, torus));
  const std::vector<Tampering> cases = {
      {"mesh triangles", [](AssetHeader& h) { kept_vertices(h)[4] += 1e-15; }},
      {"mesh triangles",
       [](AssetHeader& h) {
         MeshBlock& block = kept_blocks(h)[0];  // one is there twice, another not at all
         for (auto& corners : block.corner) corners[2] = corners[1];
       }},
      {"mesh triangles",
       [](AssetHeader& h) {
         std::swap(kept_blocks(h)->corner[0][2], kept_blocks(h)->corner[1][2]);
       }},
      {"mesh closed",
       [](AssetHeader& h) {
         std::swap(kept_blocks(h)->corner[0][2], kept_blocks(h)->corner[1][2]);
       }},
      {"mesh rounding", [](AssetHeader& h) { kept(h).rounding *= 0.5; }},
      {"mesh error", [](AssetHeader& h) { kept(h).error = 1e-9; }},
      {"mesh blocks",
       [](AssetHeader& h) {
         MeshBlock& block = kept_blocks(h)[0];  // all in the first corners but for one vertex
         for (std::size_t k = 0; k < 3; ++k)
           for (std::size_t l = 0; l < block.triangles; ++l)
             block.corner[k][l] = static_cast<std::uint8_t>(k);
       }},
      {"mesh boxes",
       [](AssetHeader& h) {
         float& low = writable<BoxBlock>(h, kept(h).level[1].blocks)->low[1][2];
         low = std::nextafterf(low, 16);
       }},
  };
  for (const Tampering& one : cases) {
    bool red = false;
    for (const Invariant& invariant : check(tampered(one.change, asset), torus))
      if (invariant.name == one.invariant) red |= invariant.violations > 0;
    EXPECT_TRUE(red) << one.invariant;
  }
  // Neighbours that no longer know each other are no asset.
  EXPECT_THROW(tampered(
                   [](AssetHeader& h) {
                     std::uint32_t& first = *writable<std::uint32_t>(h, kept(h).neighbours);
                     first ^= 1;
                   },
                   asset),
               Error);
}

// The whole asset, for any number of threads and in a second run.
TEST(Bake, SameBytesForAnyThreadCount) {
  const ClosedMesh meshes[] = {cube(),
                               testing::closed(testing::torus_mesh(1.0, 0.4, 40, 20), "torus")};
  for (const ClosedMesh& mesh : meshes) {
    const auto one = bytes_of(bake(mesh, testing::of_size(1000, 1)));
    for (const unsigned threads : {1u, 2u, 5u})
      EXPECT_EQ(one, bytes_of(bake(mesh, testing::of_size(1000, threads)))) << mesh.name << threads;
  }
}

TEST(Bake, SameBytesForAnyThreadCountOfAScan) {
  IST_NEEDS_SHARED("oracle/meshes/dino.off");
  const std::string path = testing::shared_path("oracle/meshes/dino.off").string();
  const ClosedMesh dino = close_mesh(load_mesh(path), path);
  const auto one = bytes_of(bake(dino, testing::of_size(200, 1)));
  for (const unsigned threads : {2u, 5u})
    EXPECT_EQ(one, bytes_of(bake(dino, testing::of_size(200, threads))));
}

/// The asset without the mesh's offset and size.
std::vector<std::byte> frameless(const Asset& asset) {
  std::vector<std::byte> bytes = bytes_of(asset);
  AssetHeader header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  header.content_hash = header.mesh_hash = 0;
  for (double& c : header.centre) c = 0;
  header.exponent = 0;
  for (int k = 0; k < 3; ++k) header.box_lower[k] = header.box_upper[k] = header.ball_centre[k] = 0;
  header.ball_radius = 0;
  std::memcpy(bytes.data(), &header, sizeof(header));
  return bytes;
}

// docs/design.md 3.1: nothing depends on the mesh's unit, and a shift by whole units costs nothing
// where doubles carry it.
TEST(Bake, SameBytesAtAnyScaleAndOffset) {
  const TriangleMesh torus = testing::torus_mesh(1.0, 0.375, 24, 12);
  TriangleMesh snapped = torus;  // on a grid that the shifts below keep
  for (auto& v : snapped.vertices) v = (v.array() * 1048576).round() / 1048576;
  const Asset first = bake(testing::closed(snapped, "torus"), testing::of_size(100));
  const auto bytes = frameless(first);
  const double radius = bounds(first.view()).radius;
  for (const double scale : {std::ldexp(1.0, -30), 1.0, 4.0, std::ldexp(1.0, 30)})
    for (const double shift : {0.0, 1e6}) {
      TriangleMesh moved = snapped;
      for (auto& v : moved.vertices) v = scale * (v + Eigen::Vector3d(shift, -shift, 2 * shift));
      const Asset asset = bake(testing::closed(moved, "torus"), testing::of_size(100));
      EXPECT_EQ(bytes, frameless(asset)) << scale << " " << shift;
      EXPECT_NEAR(bounds(asset.view()).radius / scale, radius, 1e-12 * radius);
    }
}

TEST(Bake, AViewSpeaksInTheMeshsUnit) {
  TriangleMesh torus = testing::torus_mesh(1.0, 0.375, 24, 12);
  const Asset small = bake(testing::closed(torus, "torus"), testing::of_size(100));
  for (auto& v : torus.vertices) v *= 8;
  const Asset large = bake(testing::closed(torus, "torus"), testing::of_size(100));
  EXPECT_EQ(large.view().volume(), 512 * small.view().volume());
  EXPECT_EQ(large.view().protrusion(), 8 * small.view().protrusion());
  EXPECT_EQ(large.view().coverage(), small.view().coverage());
  EXPECT_GT(small.view().coverage(), 0.5);
  EXPECT_LT(small.view().coverage(), 1);
  EXPECT_GT(small.view().protrusion(), 0);
  EXPECT_LT(small.view().protrusion(), 0.375);  // the tube's radius
}

TEST(Bake, CancelKeepsWhatIsPacked) {
  bool cancelled = false;
  const Asset asset = bake(cube(), testing::of_size(100'000), [&](const Progress& now) {
    if (std::strcmp(now.stage, "pack") != 0 || now.spheres < 100) return true;
    cancelled = true;
    return false;
  });
  ASSERT_TRUE(cancelled);
  EXPECT_LT(asset.view().sphere_count(), 100'000u);
  EXPECT_EQ(asset.view().header().stop_reason, static_cast<std::uint32_t>(StopReason::cancelled));
  EXPECT_THROW(bake(cube(), testing::of_size(50),
                    [](const Progress& now) { return std::strcmp(now.stage, "tree") != 0; }),
               Error);
}

TEST(Bake, SaysSoIfNothingFits) {
  PackingSettings settings;
  settings.min_radius = 10;
  EXPECT_THROW(bake(cube(), settings), Error);
}

}  // namespace
}  // namespace ist
