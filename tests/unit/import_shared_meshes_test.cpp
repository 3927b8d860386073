#include <gtest/gtest.h>

#include <string>

#include <ist/mesh.h>
#include <ist/types.h>

#include "support/mesh_table.h"
#include "support/shared_data.h"

// Real and broken meshes, held against the tables that come with them.

namespace ist {
namespace {

using namespace testing;

/// Coordinates that pass through node transforms are rounded differently there and here: triangles
/// that just touch may count or not.
bool has_node_transforms(const MeshRow& row) {
  return row.at("format") == "dae" || row.at("format") == "glb";
}

/// The table's tool turned DAE to y up and read it through float, ours does neither: its triangles
/// that just touch are these only once they are turned and rounded likewise.
TriangleMesh load_as_the_table_did(const MeshRow& row, const std::string& path) {
  TriangleMesh mesh = load_mesh(path);
  if (row.at("format") == "dae")
    for (Eigen::Vector3d& v : mesh.vertices) {
      if (mesh.declared.up_axis == 'Z') v = Eigen::Vector3d(v.x(), v.z(), -v.y());
      for (double& x : v) x = static_cast<float>(x);
    }
  return mesh;
}

void expect_counts(const MeshRow& row, const MeshReport& report) {
  EXPECT_EQ(report.triangles, number(row, "triangles"));
  EXPECT_EQ(report.vertices, number(row, "vertices_welded"));
  EXPECT_EQ(report.components, number(row, "components"));
  EXPECT_EQ(report.boundary_edges, number(row, "boundary_edges"));
  EXPECT_EQ(report.nonmanifold_edges, number(row, "nonmanifold_edges"));
  EXPECT_EQ(report.nonmanifold_vertices, number(row, "nonmanifold_vertices"));
  EXPECT_EQ(report.inconsistent_edges, number(row, "inconsistent_edges"));
  EXPECT_EQ(report.degenerate_triangles, number(row, "degenerate_triangles"));
  EXPECT_TRUE(report.self_intersections_counted);
  // The table fans polygons, so that its concave one folds over itself.
  const bool fanned = row.at("name") == "ok_concave_ngon";
  const double pairs = fanned ? 0 : number(row, "self_intersecting_pairs");
  EXPECT_NEAR(static_cast<double>(report.self_intersections), pairs,
              has_node_transforms(row) ? 0.003 * pairs : 0);
}

/// The table has six digits.
void expect_volume(const MeshRow& row, const MeshReport& report) {
  EXPECT_NEAR(report.volume, number(row, "volume"), 5e-6 * report.volume);
}

void expect_bounds(const MeshRow& row, const MeshReport& report) {
  double low[3], high[3];
  ASSERT_EQ(std::sscanf(row.at("bbox_min").c_str(), "%lf %lf %lf", low, low + 1, low + 2), 3);
  ASSERT_EQ(std::sscanf(row.at("bbox_max").c_str(), "%lf %lf %lf", high, high + 1, high + 2), 3);
  const double tolerance = 2e-6 * (report.bounds.min().norm() + report.bounds.max().norm());
  for (int k = 0; k < 3; ++k) {
    EXPECT_NEAR(report.bounds.min()[k], low[k], tolerance);
    EXPECT_NEAR(report.bounds.max()[k], high[k], tolerance);
  }
}

TEST(SharedMeshes, ReportMatchesTheTable) {
  IST_NEEDS_SHARED("meshes/dev/MESHES.csv");
  for (const MeshRow& row : read_mesh_table(shared_path("meshes/dev/MESHES.csv").string())) {
    if (row.at("format") == "urdf" || row.at("format") == "md") continue;
    SCOPED_TRACE(row.at("file"));
    const std::string path = shared_path("meshes/dev/" + row.at("file")).string();
    const ClosedMesh mesh =
        close_mesh(load_as_the_table_did(row, path), path, OpenMeshPolicy::repair);
    expect_counts(row, mesh.report);
    expect_bounds(row, mesh.report);
    const bool watertight = row.at("watertight") == "yes";
    EXPECT_EQ(mesh.report.repaired, !watertight);
    if (!watertight) {
      EXPECT_THROW(close_mesh(load_mesh(path), path), Error);
      continue;
    }
    // The table's volume is that of the faces as they stand; none of these has shells to turn.
    EXPECT_EQ(mesh.report.flipped_components, 0u);
    EXPECT_EQ(mesh.report.cavities, number(row, "inward_components"));
    expect_volume(row, mesh.report);
  }
}

/// A robot's description puts both at the same place.
TEST(SharedMeshes, ALinksVisualDaeStandsAsItsCollisionStl) {
  IST_NEEDS_SHARED("meshes/dev/robots/ur_description/meshes/ur5");
  const std::filesystem::path robot = shared_path("meshes/dev/robots/ur_description/meshes/ur5");
  std::size_t links = 0;
  for (const auto& entry : std::filesystem::directory_iterator(robot / "visual")) {
    SCOPED_TRACE(entry.path().filename());
    const auto bounds = [](const std::filesystem::path& path) {
      Eigen::AlignedBox3d box;
      for (const Eigen::Vector3d& v : load_mesh(path.string()).vertices) box.extend(v);
      return box;
    };
    const Eigen::AlignedBox3d visual = bounds(entry.path());
    const Eigen::AlignedBox3d collision =
        bounds(robot / "collision" / (entry.path().stem().string() + ".stl"));
    const double tolerance = 0.01 * collision.diagonal().norm();  // two models of one part
    EXPECT_LT((visual.min() - collision.min()).norm(), tolerance);
    EXPECT_LT((visual.max() - collision.max()).norm(), tolerance);
    ++links;
  }
  EXPECT_EQ(links, 7u);
}

TEST(SharedMeshes, BrokenOnesMeetTheExpectation) {
  IST_NEEDS_SHARED("meshes/bad/MESHES.csv");
  for (const MeshRow& row : read_mesh_table(shared_path("meshes/bad/MESHES.csv").string())) {
    if (row.at("format") == "urdf") continue;  // robots, not meshes
    SCOPED_TRACE(row.at("file"));
    const std::string path = shared_path("meshes/bad/" + row.at("file")).string();
    const std::string& expectation = row.at("expect");
    try {
      const ClosedMesh mesh = close_mesh(load_mesh(path), path);
      EXPECT_NE(expectation, "reject");
      if (expectation == "report") {
        EXPECT_FALSE(mesh.report.notes.empty());
      }
      if (expectation == "accept" && !row.at("volume").empty()) {
        expect_counts(row, mesh.report);
        expect_volume(row, mesh.report);
      }
    } catch (const Error& error) {
      EXPECT_NE(expectation, "accept") << error.what();
      const std::string message = error.what();
      EXPECT_EQ(message.find(path), 0u) << message;
      for (const char c : message.substr(path.size())) EXPECT_NE(c & 0xe0, 0) << message;
    }
  }
}

TEST(SharedMeshes, BrokenOnesRepairOrSayWhyNot) {
  IST_NEEDS_SHARED("meshes/bad/MESHES.csv");
  for (const MeshRow& row : read_mesh_table(shared_path("meshes/bad/MESHES.csv").string())) {
    if (row.at("expect") != "report") continue;
    SCOPED_TRACE(row.at("file"));
    const std::string path = shared_path("meshes/bad/" + row.at("file")).string();
    try {
      const ClosedMesh mesh = close_mesh(load_mesh(path), path, OpenMeshPolicy::repair);
      EXPECT_FALSE(mesh.report.notes.empty());
      // The result is closed: it needs no repair.
      const ClosedMesh again = close_mesh(mesh.mesh, path);
      EXPECT_FALSE(again.report.repaired);
      EXPECT_NEAR(again.report.volume, mesh.report.volume, 1e-9 * mesh.report.volume);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find(path), 0u) << error.what();
    }
  }
}

}  // namespace
}  // namespace ist
