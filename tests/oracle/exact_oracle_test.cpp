#include <gtest/gtest.h>
#include <ist/query.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <vector>

#include "support/exact_pair.h"
#include "support/oracle_rows.h"

// Exact queries against the volumes, gradients and centroids of exact booleans, all rows there are.

namespace ist {
namespace {

using testing::OracleRow;
using Point = Eigen::Vector3d;

// The oracle's own error: two exact kernels differ by as much.
constexpr double kOracleVolume = 1.3e-12;

const Asset& surface_of(const std::filesystem::path& path) {
  static std::map<std::filesystem::path, Asset> assets;
  const auto found = assets.find(path);
  if (found != assets.end()) return found->second;
  return assets.emplace(path, testing::surface(load_mesh(path), path.filename().c_str()))
      .first->second;
}

/// A row's solids as it places them.
std::pair<PlacedAsset, PlacedAsset> placed(const OracleRow& row) {
  return {
      PlacedAsset{surface_of(testing::oracle_mesh_path(row.mesh_a)).view(), {}, 1},
      PlacedAsset{surface_of(testing::oracle_mesh_path(row.mesh_b)).view(), row.pose, row.scale_b}};
}

class ExactOracle : public ::testing::Test {
 protected:
  /// Volume, interval and the query's own checks. `precision` of the truth, relative.
  Penetration compare(const PlacedAsset& a, const PlacedAsset& b, double truth, double precision) {
    const Penetration found = testing::exactly(a, b, workspace_);
    EXPECT_EQ(found.status, QueryStatus::ok);
    EXPECT_NEAR(found.volume, truth, std::max(1e-9, precision) * truth);
    if (truth == 0) {
      EXPECT_LE(found.volume, 1e-15);
    }
    EXPECT_LE(found.volume_min, truth * (1 + precision));
    EXPECT_GE(found.volume_max, truth * (1 - precision));
    const testing::ExactCheck check = testing::check_exactly(a, b, workspace_);
    EXPECT_TRUE(check.complete && check.consistent);
    EXPECT_LE(check.gap, testing::gap_bound(check));
    const double width = found.volume_max - found.volume_min;
    ++rows_;
    if (truth > 0) {
      worst_ = std::max(worst_, std::abs(found.volume / truth - 1));
      widest_ = std::max(widest_, width / truth);
      if (width > 1e-9 * truth) ++wide_;
    } else {
      EXPECT_LE(width, 1e-11);
    }
    return found;
  }

  void TearDown() override {
    if (rows_ == 0) return;
    RecordProperty("rows", rows_);
    RecordProperty("rows_wider_than_1e-9", wide_);
    RecordProperty("worst_error", std::to_string(1e15 * worst_) + "e-15");
    RecordProperty("widest", std::to_string(1e15 * widest_) + "e-15");
  }

  int rows_ = 0, wide_ = 0;
  double worst_ = 0, widest_ = 0;
  Workspace workspace_;
};

/// The oracle's gradients and centroids have as many digits as their file, of numbers of size 1.
void expect_rest(const Penetration& found, const OracleRow& row) {
  EXPECT_LE((found.force - row.force).norm(), 2e-9);
  EXPECT_LE((found.torque - row.torque).norm(), 2e-9);
  if (row.volume > 0) {
    EXPECT_LE((found.centroid - row.centroid).norm(), 2e-9);
  }
}

class ExactOracleOfPairs : public ExactOracle, public ::testing::WithParamInterface<const char*> {};

TEST_P(ExactOracleOfPairs, EveryRow) {
  IST_NEEDS_SHARED(std::string("oracle/poses/poses_") + GetParam() + ".csv");
  for (const OracleRow& row : testing::read_oracle_rows(GetParam())) {
    SCOPED_TRACE(row.pose_class + ' ' + std::to_string(row.id));
    const auto [a, b] = placed(row);
    expect_rest(compare(a, b, row.volume, kOracleVolume), row);
    // Likewise from B's side.
    compare(b, a, row.volume, kOracleVolume);
  }
  EXPECT_GE(rows_, 400);
  EXPECT_EQ(wide_, 0);
}

INSTANTIATE_TEST_SUITE_P(Keys, ExactOracleOfPairs,
                         ::testing::Values("eledino", "big200k", "ico1k", "ico20k"),
                         [](const auto& key) { return std::string(key.param); });

/// Poses and truths of two files; columns that a truth lacks are zero.
std::vector<OracleRow> rows_of(const std::string& poses, const std::string& truths) {
  const auto pose_rows = testing::read_csv(testing::shared_path("oracle/" + poses).string());
  const auto truth_rows = testing::read_csv(testing::shared_path("oracle/" + truths).string());
  std::vector<OracleRow> rows;
  for (std::size_t i = 0; i < pose_rows.size(); ++i) {
    const auto pose = [&](const char* column) { return std::stod(pose_rows[i].at(column)); };
    const auto truth = [&](const char* column) {
      const auto found = truth_rows.at(i).find(column);
      return found == truth_rows[i].end() ? 0.0 : std::stod(found->second);
    };
    OracleRow row;
    row.id = std::stoi(pose_rows[i].at("id"));
    row.pose_class = pose_rows[i].at("class");
    row.mesh_a = pose_rows[i].at("meshA");
    row.mesh_b = pose_rows[i].at("meshB");
    row.pose = {{pose("qw"), pose("qx"), pose("qy"), pose("qz")},
                {pose("tx"), pose("ty"), pose("tz")}};
    row.scale_b = pose("scale_b");
    row.volume = truth("volume");
    row.centroid = {truth("cx"), truth("cy"), truth("cz")};
    row.force = -Eigen::Vector3d(truth("dVdtx"), truth("dVdty"), truth("dVdtz"));
    row.torque = -Eigen::Vector3d(truth("dVdrx"), truth("dVdry"), truth("dVdrz"));
    rows.push_back(row);
  }
  return rows;
}

TEST_F(ExactOracle, EveryStepOfTheTrajectory) {
  IST_NEEDS_SHARED("oracle/poses/traj_eledino.csv");
  for (const OracleRow& row : rows_of("poses/traj_eledino.csv", "poses/truth_traj_eledino.csv")) {
    SCOPED_TRACE(row.id);
    const auto [a, b] = placed(row);
    expect_rest(compare(a, b, row.volume, kOracleVolume), row);
  }
  EXPECT_EQ(rows_, 1000);
  EXPECT_LE(wide_, 40);  // first touches
}

/// The path of a mesh of oracle/small.
std::filesystem::path mesh_path(const std::string& name) {
  for (const char* const place :
       {"oracle/meshes/%.off", "meshes/dev/%.off", "meshes/dev/%.stl", "meshes/dev/%.ply"}) {
    std::string path = place;
    path.replace(path.find('%'), 1, name);
    if (std::filesystem::exists(testing::shared_path(path))) return testing::shared_path(path);
  }
  return testing::shared_path(name);
}

class ExactOracleOfSmall : public ExactOracle, public ::testing::WithParamInterface<const char*> {};

TEST_P(ExactOracleOfSmall, EveryRow) {
  const std::string name = GetParam();
  // On the tray's vertices as they are loaded, other exact booleans give the query's digits.
  const double precision = name.find("tray") != std::string::npos ? 2e-7 : kOracleVolume;
  IST_NEEDS_SHARED("oracle/small/" + name + ".csv");
  for (const OracleRow& row : rows_of("small/" + name + ".csv", "small/truth_" + name + ".csv")) {
    SCOPED_TRACE(row.pose_class + ' ' + std::to_string(row.id));
    const PlacedAsset a{surface_of(mesh_path(row.mesh_a)).view(), {}, 1};
    const PlacedAsset b{surface_of(mesh_path(row.mesh_b)).view(), row.pose, row.scale_b};
    const Penetration found = compare(a, b, row.volume, precision);
    // Compares with differences of volumes.
    const double force = row.force.norm(), torque = row.torque.norm();
    EXPECT_LE((found.force - row.force).norm(), 1e-3 * force);
    EXPECT_LE((found.torque - row.torque).norm(), 1e-3 * (torque + force * row.scale_b));
  }
  EXPECT_GE(rows_, 20);
}

INSTANTIATE_TEST_SUITE_P(Pairs, ExactOracleOfSmall,
                         ::testing::Values("small_elephant_dino", "small_mug_ico1k",
                                           "small_table_dino", "thin_mug_torus",
                                           "thin_tray_perforated_sword",
                                           "thin_tray_perforated_torus"),
                         [](const auto& pair) { return std::string(pair.param); });

/// Solids that meet themselves, resolved by the bake: what they count twice counts once.
TEST_F(ExactOracle, EveryPairOfSolidsThatMeetThemselves) {
  IST_NEEDS_SHARED("oracle/wild/poses_wild.csv");
  for (const OracleRow& row : rows_of("wild/poses_wild.csv", "wild/truth_wild.csv")) {
    SCOPED_TRACE(row.mesh_a + ' ' + row.mesh_b);
    const PlacedAsset a{
        surface_of(testing::shared_path("meshes/wild/" + row.mesh_a)).view(), {}, 1};
    const PlacedAsset b{surface_of(testing::shared_path("meshes/wild/" + row.mesh_b)).view(),
                        row.pose, row.scale_b};
    const auto is_dae = [](const std::string& name) { return name.find(".dae") != name.npos; };
    // The oracle has vertices of these files that are 1e-8 off the files' own.
    compare(a, b, row.volume, is_dae(row.mesh_a) || is_dae(row.mesh_b) ? 1e-6 : 1e-9);
  }
  EXPECT_EQ(rows_, 141);
}

}  // namespace
}  // namespace ist
