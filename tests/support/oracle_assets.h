#pragma once

#include <map>
#include <string>

#include <ist/bake.h>
#include <ist/query.h>

#include "support/oracle_rows.h"

namespace ist::testing {

/// The bake of an oracle mesh, made once a program.
inline const Asset& oracle_asset(const std::string& mesh, std::size_t spheres) {
  static std::map<std::pair<std::string, std::size_t>, Asset> assets;
  const std::string path = oracle_mesh_path(mesh);
  const auto key = std::pair(path, spheres);
  const auto found = assets.find(key);
  if (found != assets.end()) return found->second;
  PackingSettings settings;
  settings.max_spheres = spheres;
  return assets.emplace(key, bake(close_mesh(load_mesh(path), path), settings)).first->second;
}

/// A row's solids as it places them.
inline std::pair<PlacedAsset, PlacedAsset> placed(const OracleRow& row, std::size_t spheres) {
  return {PlacedAsset{oracle_asset(row.mesh_a, spheres).view(), Pose{}, 1.0},
          PlacedAsset{oracle_asset(row.mesh_b, spheres).view(), row.pose, row.scale_b}};
}

}  // namespace ist::testing
