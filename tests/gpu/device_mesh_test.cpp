#include "cuda/packing/mesh/device_mesh.h"

#include <ist/mesh.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "mesh/geometry/closest_point.h"
#include "mesh/hierarchy/winding.h"
#include "mesh/mesh_solid.h"
#include "support/gpu_mesh_queries.h"
#include "support/gpu_test.h"
#include "support/host_wide_tree.h"
#include "support/scarce_memory.h"
#include "support/shared_data.h"
#include "support/test_meshes.h"

// The device's answers about a mesh equal those of the CPU's hierarchy, bit for bit.

namespace ist {
namespace {

using namespace testing;
using Eigen::Vector3d;
using gpu::DeviceArray;
using gpu::DeviceMesh;
using gpu::Queue;

/// The card's answers.
template <class Answer, class Question>
std::vector<Answer> answers(Queue& queue, const WideTree& tree,
                            const std::vector<Question>& questions) {
  DeviceArray<Question> asked(queue, questions.size());
  DeviceArray<Answer> found(queue, questions.size());
  asked.upload(questions);
  ask(queue, tree, asked, found);
  return found.to_host(questions.size());
}

/// The tree with its arrays copied to host memory.
struct Download {
  std::vector<double> vertices;
  std::vector<WideBlock> blocks;
  std::vector<WideNode> nodes;

  Download(Queue& queue, const WideTree& tree)
      : vertices(3 * std::size_t{tree.vertex_count}),
        blocks(tree.block_count),
        nodes(tree.first_leaf) {
    // The last level of nodes ends with the node of the last block.
    const std::size_t last = (tree.first_leaf + tree.block_count - 2) / kWideWidth;
    nodes.resize(last + 1);
    const auto copy = [&](auto& to, const auto* from) {
      gpu::check(cudaMemcpyAsync(to.data(), from, to.size() * sizeof to[0], cudaMemcpyDeviceToHost,
                                 queue.stream()),
                 "copying");
    };
    copy(vertices, tree.vertices);
    copy(blocks, tree.blocks);
    copy(nodes, tree.nodes);
    queue.wait();
  }
};

/// Random points, lattice points, and corners, edges and faces of the mesh itself, nudged or not.
std::vector<Vector3d> points_about(const MeshView& mesh, int count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> coordinate(-1.1, 1.1);
  std::vector<Vector3d> points = {Vector3d::Zero(), {3, 4, -5}, {1e6, 0, 0}, {0.25, -1e3, 2}};
  for (int i = 0; i < count; ++i) {
    const Vector3d away(coordinate(random), coordinate(random), coordinate(random));
    if (i % 2 == 0) {
      points.push_back(i % 8 == 0 ? Vector3d((4 * away).array().round() / 4) : away);
      continue;
    }
    const std::uint32_t* t = mesh.triangles + 3 * (random() % mesh.triangle_count);
    const auto corner = [&](int k) { return Vector3d(mesh.vertices + 3 * std::size_t{t[k]}); };
    Vector3d p = corner(0);
    if (i % 3 == 1) p = (p + corner(1)) / 2;
    if (i % 3 == 2) p = (p + corner(1) + corner(2)) / 3;
    if (i % 4 == 1) p += std::ldexp(1, -(i / 4) % 50) * away;
    points.push_back(p);
  }
  return points;
}

class DeviceMeshTest : public GpuTest {
 protected:
  /// Builds on the card and compares the arrays and all queries' answers with the CPU's.
  static void compare(const ClosedMesh& mesh, int point_count) {
    const MeshSolid solid(mesh);
    const MeshView& view = solid.view();
    Queue queue{GpuSettings{}};
    const DeviceMesh device(queue, view);
    const WideTree& tree = device.tree();
    const Download copy(queue, tree);
    EXPECT_EQ(queue.bytes_in_use(), device.bytes());  // no scratch is left

    // In whatever order it took the triangles, but every one once, and in blocks as tight as by
    // cutting one part after the other.
    HostWideTree::Order order;
    for (const WideBlock& block : copy.blocks)
      for (const std::uint32_t triangle : block.triangle)
        if (triangle != kNoTriangle) order.push_back(triangle);
    HostWideTree::Order sorted = order;
    std::sort(sorted.begin(), sorted.end());
    ASSERT_EQ(sorted.size(), tree.triangle_count);
    for (std::uint32_t t = 0; t < tree.triangle_count; ++t) ASSERT_EQ(sorted[t], t);
    const HostWideTree expected(view, order);
    EXPECT_LE(expected.area_of_boxes(), 1.15 * HostWideTree(view).area_of_boxes());
    ASSERT_EQ(tree.first_leaf, expected.tree().first_leaf);
    ASSERT_EQ(tree.block_count, expected.tree().block_count);
    for (std::uint32_t b = 0; b < tree.block_count; ++b)
      ASSERT_EQ(std::memcmp(&copy.blocks[b], expected.tree().blocks + b, sizeof(WideBlock)), 0)
          << b;
    std::uint32_t level_size = tree.block_count;
    for (int level = wide_depth(tree.block_count) - 1; level >= 0; --level) {
      level_size = (level_size + kWideWidth - 1) / kWideWidth;
      const std::size_t first = first_wide_node(level);
      ASSERT_EQ(std::memcmp(copy.nodes.data() + first, expected.tree().nodes + first,
                            level_size * sizeof(WideNode)),
                0)
          << level;
    }

    const std::vector<Vector3d> points = points_about(view, point_count);
    nearest(queue, tree, copy, view, points);
    exact(queue, tree, solid, points);
    lines(queue, tree, solid, points);
  }

 private:
  static void nearest(Queue& queue, const WideTree& tree, const Download& copy,
                      const MeshView& view, const std::vector<Vector3d>& points) {
    std::vector<gpu::NearestQuestion> questions;
    for (const Vector3d& x : points) {
      gpu::NearestQuestion q = {{float(x.x()), float(x.y()), float(x.z())}, 1e30f};
      questions.push_back(q);
      const float least2 = nearest_triangle(view, q.p).distance2;
      for (const float factor : {0.5f, 1.0f, 2.25f}) {
        q.limit2 = factor * least2;
        questions.push_back(q);
      }
    }
    const auto found = answers<WideNearest>(queue, tree, questions);
    for (std::size_t i = 0; i < questions.size(); ++i) {
      const NearestTriangle expected = nearest_triangle(view, questions[i].p, questions[i].limit2);
      ASSERT_EQ(found[i].distance2, expected.distance2) << i;
      ASSERT_EQ(found[i].triangle, expected.triangle) << i;
      if (found[i].slot == kNoSlot) continue;
      ASSERT_EQ(copy.blocks[found[i].slot / kWideWidth].triangle[found[i].slot % kWideWidth],
                expected.triangle);
    }

    const auto within = answers<gpu::TrianglesWithin>(queue, tree, questions);
    for (std::size_t i = 0; i < questions.size(); i += 7) {
      if (questions[i].limit2 > 1) continue;  // nearly all of them
      std::set<std::uint32_t> expected, met;
      for_triangles_near(view, questions[i].p, questions[i].limit2, [&](const NearTriangle& near) {
        expected.insert(near.triangle);
        return questions[i].limit2;
      });
      if (expected.size() > gpu::TrianglesWithin::kCapacity) {
        ASSERT_GT(within[i].count, gpu::TrianglesWithin::kCapacity);
        continue;
      }
      for (int k = 0; k < within[i].count; ++k)
        met.insert(
            copy.blocks[within[i].slot[k] / kWideWidth].triangle[within[i].slot[k] % kWideWidth]);
      ASSERT_EQ(met, expected);
      ASSERT_EQ(std::size_t(within[i].count), expected.size());
    }
  }

  static void exact(Queue& queue, const WideTree& tree, const MeshSolid& solid,
                    const std::vector<Vector3d>& points) {
    std::vector<gpu::ExactQuestion> questions;
    for (const Vector3d& x : points) {
      const double distance = solid.closest_point(x).distance;
      for (const double limit : {HUGE_VAL, 0.5 * distance, distance, 1.5 * distance})
        questions.push_back({{x.x(), x.y(), x.z()}, limit});
    }
    const auto found = answers<WideExact>(queue, tree, questions);
    const auto winding = answers<int>(queue, tree, questions);
    for (std::size_t i = 0; i < questions.size(); ++i) {
      const Vector3d x(questions[i].p);
      const ClosestPoint expected = solid.closest_point(x, questions[i].limit);
      ASSERT_EQ(found[i].distance, expected.distance) << i;
      ASSERT_EQ(found[i].triangle, expected.triangle) << i;
      ASSERT_EQ(winding[i], solid.winding_number(x)) << i;
    }
  }

  static void lines(Queue& queue, const WideTree& tree, const MeshSolid& solid,
                    const std::vector<Vector3d>& points) {
    std::vector<gpu::LineQuestion> questions;
    for (const Vector3d& x : points) questions.push_back({x.y(), x.z()});
    const auto found = answers<gpu::LineCrossings>(queue, tree, questions);
    std::vector<Crossing> expected, met;
    for (std::size_t i = 0; i < questions.size(); ++i) {
      line_crossings(solid.view(), questions[i].y, questions[i].z, expected);
      ASSERT_EQ(std::size_t(found[i].count), expected.size());
      if (found[i].count > gpu::LineCrossings::kCapacity) continue;
      met.clear();
      for (int k = 0; k < found[i].count; ++k) met.push_back({found[i].x[k], found[i].sign[k]});
      std::sort(met.begin(), met.end(), [](const Crossing& a, const Crossing& b) {
        return a.x != b.x ? a.x < b.x : a.sign > b.sign;
      });
      for (std::size_t k = 0; k < met.size(); ++k) {
        ASSERT_EQ(met[k].x, expected[k].x);
        ASSERT_EQ(met[k].sign, expected[k].sign);
      }
    }
  }
};

ClosedMesh shared_mesh(const std::string& path) {
  return close_mesh(load_mesh(shared_path(path).string()), path);
}

TEST_F(DeviceMeshTest, Cube) { compare(closed(cube_mesh(), "cube"), 2000); }

TEST_F(DeviceMeshTest, CoincidentTriangles) {
  compare(closed(joined(cube_mesh(), cube_mesh()), "twice the same cube"), 500);
}

TEST_F(DeviceMeshTest, ShiftedScaledAndWithStrayVertices) {
  TriangleMesh mesh = torus_mesh(1, 0.2, 60, 30);
  for (auto& v : mesh.vertices) v = 37 * v + Vector3d(1e5, -3e4, 11);
  mesh.vertices.insert(mesh.vertices.begin() + 5, Vector3d::Constant(NAN));
  for (auto& t : mesh.triangles)
    for (auto& v : t) v += v >= 5;
  compare(closed(mesh, "torus"), 1000);
}

TEST_F(DeviceMeshTest, ManyEquallyFar) { compare(closed(icosphere_mesh(5), "sphere"), 500); }

TEST_F(DeviceMeshTest, Dino) {
  IST_NEEDS_SHARED("oracle/meshes/dino.off");
  compare(shared_mesh("oracle/meshes/dino.off"), 10000);
}

TEST_F(DeviceMeshTest, Bolt) {
  IST_NEEDS_SHARED("meshes/dev/bolt_gen.ply");
  compare(shared_mesh("meshes/dev/bolt_gen.ply"), 4000);
}

TEST_F(DeviceMeshTest, Dragon) {
  IST_NEEDS_SHARED("meshes/dev/dragon_871k.ply");
  compare(shared_mesh("meshes/dev/dragon_871k.ply"), 4000);
}

TEST_F(DeviceMeshTest, AnEndOfMemoryLeaksNothing) {
  const MeshSolid solid(closed(icosphere_mesh(4), "sphere"));
  int failures = 0;
  for (std::size_t available = 0;; available += 50000) {
    ScarceMemory memory(available);
    GpuSettings settings;
    settings.memory = &memory;
    Queue queue(settings);
    bool built = false;
    try {
      const DeviceMesh device(queue, solid.arrays());
      built = true;
    } catch (const Error&) {
      ++failures;
    }
    queue.wait();
    EXPECT_EQ(memory.left(), available);
    if (built) break;
  }
  EXPECT_GT(failures, 3);
}

}  // namespace
}  // namespace ist
