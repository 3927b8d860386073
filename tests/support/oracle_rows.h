#pragma once

#include <Eigen/Core>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <ist/types.h>

#include "support/shared_data.h"

namespace ist::testing {

/// The pair keys of the oracle: oracle/poses/poses_<key>.csv with truth_<key>.csv.
inline const std::vector<std::string> kPairKeys = {"eledino", "big200k", "ico1k", "ico20k"};

/// Two placed solids and the exact answers about them. Gradients are with respect to B.
struct OracleRow {
  int id = 0;
  std::string pose_class;      ///< sep | pen | deep | contain
  std::string mesh_a, mesh_b;  ///< file names without .off
  Pose pose;                   ///< x_A = R (scale_b · x_B) + t
  double scale_b = 1;
  double volume = 0;
  double fraction_of_smaller = 0;
  double surface_distance = 0;  ///< of the surfaces: > 0 for `contain`
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();

  /// The solids' distance: 0 if they meet or one contains the other.
  double solid_distance() const { return volume > 0 ? 0 : surface_distance; }
};

/// A CSV file as one map of column to text a row.
inline std::vector<std::map<std::string, std::string>> read_csv(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  const auto fields = [](const std::string& text) {
    std::vector<std::string> out;
    std::istringstream stream(text);
    for (std::string field; std::getline(stream, field, ',');) out.push_back(field);
    if (!out.empty() && out.back().ends_with('\r')) out.back().pop_back();
    return out;
  };
  if (!std::getline(file, line)) throw std::runtime_error("cannot read " + path);
  const std::vector<std::string> header = fields(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(file, line)) {
    const std::vector<std::string> values = fields(line);
    if (values.size() != header.size()) throw std::runtime_error("ragged row in " + path);
    rows.emplace_back();
    for (std::size_t i = 0; i < header.size(); ++i) rows.back()[header[i]] = values[i];
  }
  return rows;
}

/// The mesh of a row. `X_small` is X under the row's scale_b: the scale is in the row already.
inline std::string oracle_mesh_path(std::string name) {
  const std::string suffix = "_small";
  if (name.ends_with(suffix)) name.resize(name.size() - suffix.size());
  return shared_path("oracle/meshes/" + name + ".off").string();
}

inline std::vector<OracleRow> read_oracle_rows(const std::string& key) {
  const std::string folder = shared_path("oracle/poses").string();
  const auto poses = read_csv(folder + "/poses_" + key + ".csv");
  const auto truths = read_csv(folder + "/truth_" + key + ".csv");
  if (poses.size() != truths.size()) throw std::runtime_error("poses and truth differ: " + key);
  std::vector<OracleRow> rows;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto pose = [&](const char* column) { return std::stod(poses[i].at(column)); };
    const auto truth = [&](const char* column) { return std::stod(truths[i].at(column)); };
    OracleRow row;
    row.id = std::stoi(poses[i].at("id"));
    if (row.id != std::stoi(truths[i].at("id"))) throw std::runtime_error("ids differ: " + key);
    row.pose_class = poses[i].at("class");
    row.mesh_a = poses[i].at("meshA");
    row.mesh_b = poses[i].at("meshB");
    row.pose = {{pose("qw"), pose("qx"), pose("qy"), pose("qz")},
                {pose("tx"), pose("ty"), pose("tz")}};
    row.scale_b = pose("scale_b");
    row.volume = truth("volume");
    row.fraction_of_smaller = truth("frac_of_smaller");
    row.surface_distance = truth("surface_distance");
    row.centroid = {truth("cx"), truth("cy"), truth("cz")};
    row.force = -Eigen::Vector3d(truth("dVdtx"), truth("dVdty"), truth("dVdtz"));
    row.torque = -Eigen::Vector3d(truth("dVdrx"), truth("dVdry"), truth("dVdrz"));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace ist::testing
