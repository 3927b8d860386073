#pragma once

#include <string>
#include <vector>

#include <ist/types.h>

#include "support/oracle_rows.h"

namespace ist::testing {

/// Two CAD parts at a mate, or moved from it.
struct MatedRow {
  int id = 0;
  std::string name;            ///< of the mate
  double moved = 0;            ///< [u] along the mate's direction
  std::string mesh_a, mesh_b;  ///< file names without .off
  Pose pose;                   ///< of B, A at the origin
  double volume = 0;           ///< [u³] truth
};

inline std::string mated_mesh_path(const std::string& name) {
  return shared_path("oracle/mated/" + name + ".off").string();
}

/// All rows of oracle/mated: the five of a mate, by how far it is moved, follow each other.
inline std::vector<MatedRow> read_mated_rows() {
  const auto poses = read_csv(shared_path("oracle/mated/poses.csv").string());
  const auto truths = read_csv(shared_path("oracle/mated/truth.csv").string());
  if (poses.size() != truths.size()) throw std::runtime_error("poses and truth differ: mated");
  std::vector<MatedRow> rows;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto number = [&](const char* column) { return std::stod(poses[i].at(column)); };
    if (poses[i].at("id") != truths[i].at("id")) throw std::runtime_error("ids differ: mated");
    rows.push_back({std::stoi(poses[i].at("id")),
                    truths[i].at("name"),
                    std::stod(truths[i].at("moved")),
                    poses[i].at("meshA"),
                    poses[i].at("meshB"),
                    {{number("qw"), number("qx"), number("qy"), number("qz")},
                     {number("tx"), number("ty"), number("tz")}},
                    std::stod(truths[i].at("volume"))});
  }
  return rows;
}

}  // namespace ist::testing
