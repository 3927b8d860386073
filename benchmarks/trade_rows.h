#pragma once

// What benchmarks/trade.cpp asks about: pairs of solids, rows with the truth, kept assets.

#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <ist/bake.h>
#include <ist/types.h>

#include "bake/predict/trial_poses.h"
#include "mesh/mesh_solid.h"
#include "support/oracle_rows.h"

namespace ist::benchmark {

/// Two solids that overlap, and by how much.
struct Row {
  Pose pose;
  double scale_b = 1;
  double volume = 0;  ///< [u³]
  std::size_t overlap_class = 0;
  bool pen = false;  ///< one of the oracle's `pen` rows
};

struct Body {
  std::string name;
  ClosedMesh closed;
  MeshSolid solid;

  Body(const std::string& body_name, const std::string& path)
      : name(body_name), closed(close_mesh(load_mesh(path), path)), solid(closed) {}
};

struct PairOfBodies {
  std::string key;
  std::unique_ptr<Body> a, b;
  std::vector<Row> rows;
};

/// Baked; or, where a folder of kept ones is named, the asset of that name in it if it is of this
/// mesh and `same(header)`, else baked and kept. Which library baked it nobody can tell.
template <class Same, class Bake>
Asset kept_or_baked(const Body& body, const std::string& label, Same same, Bake bake) {
  const char* const asked = std::getenv("IST_TRADE_ASSETS");
  if (asked == nullptr) return bake();
  const std::filesystem::path folder = asked;
  std::filesystem::create_directories(folder);
  const std::filesystem::path path = folder / (body.name + "_" + label + ".ist");
  try {
    Asset kept = Asset::load(path);
    const AssetHeader& header = kept.view().header();
    if (header.mesh_hash == body.solid.hash() && same(header)) return kept;
  } catch (const Error&) {  // not there, or of another format
  }
  std::cerr << "baking " << path << "\n";
  Asset asset = bake();
  asset.save(path);
  return asset;
}

inline Asset asset_of(const Body& body, std::size_t spheres, bool keep) {
  const auto bake = [&] {
    return ist::bake(body.closed, {.max_spheres = spheres, .device = Device::cpu});
  };
  if (!keep) return bake();
  return kept_or_baked(
      body, std::to_string(spheres),
      [&](const AssetHeader& header) { return header.asked_spheres == spheres; }, bake);
}

/// The oracle's rows that overlap, with exact volumes.
inline PairOfBodies oracle_pair(const std::string& key) {
  PairOfBodies pair;
  pair.key = key;
  const auto rows = testing::read_oracle_rows(key);
  pair.a =
      std::make_unique<Body>(rows.front().mesh_a, testing::oracle_mesh_path(rows.front().mesh_a));
  pair.b =
      std::make_unique<Body>(rows.front().mesh_b, testing::oracle_mesh_path(rows.front().mesh_b));
  for (const auto& row : rows) {
    if (!(row.volume > 0)) continue;
    std::size_t k = 0;
    if (row.pose_class != "contain")
      for (k = 1; k + 1 < kOverlapClasses && row.fraction_of_smaller < kOverlapClassFloor[k];) ++k;
    pair.rows.push_back({row.pose, row.scale_b, row.volume, k, row.pose_class == "pen"});
  }
  return pair;
}

/// Two development meshes: trial poses with their exact volumes.
inline PairOfBodies development_pair(const std::string& a, const std::string& b,
                                     std::uint32_t per_class) {
  const auto path = [](const std::string& file) {
    return testing::shared_path("meshes/dev/" + file).string();
  };
  const auto stem = [](const std::string& file) {
    return std::filesystem::path(file).stem().string();
  };
  PairOfBodies pair;
  pair.key = stem(a) + ", " + stem(b);
  pair.a = std::make_unique<Body>(stem(a), path(a));
  pair.b = std::make_unique<Body>(stem(b), path(b));
  const Asset asset_a = asset_of(*pair.a, 3'000, true), asset_b = asset_of(*pair.b, 3'000, true);
  for (const TrialPose& trial :
       trial_poses({pair.a->solid, asset_a.view()}, {pair.b->solid, asset_b.view()}, per_class, 1))
    pair.rows.push_back({trial.b_in_a, trial.scale_b, trial.volume, trial.overlap_class, false});
  return pair;
}

}  // namespace ist::benchmark
