// Bakes every row of a table and compares two hashes with the table's: the same mesh and settings
// give the same bytes on any machine, for any number of threads, on CPU and GPU alike
// (docs/design.md 3.3).
// `./dev soak` runs it.

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <ist/bake.h>
#include <ist/types.h>

#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include <ist/asset_layout.h>
#include "mesh/samples/samples.h"
#include "support/shared_data.h"

namespace {

constexpr const char* kUsage =
    "usage: bake_hashes TABLE [--device auto|cpu|cuda] [--write] [--only TEXT]\n"
    "TABLE: CSV with the columns mesh (a path under IST_SHARED, or sample:NAME), grid, count, "
    "seed,\n"
    "spheres (XXH3-64 of the inner spheres), asset (the asset's content hash). A missing mesh and "
    "an\n"
    "empty hash are passed over. --write puts what was found into the table instead of comparing;\n"
    "--only takes the rows that contain TEXT. Exit code 0: all equal, 1: not, or an error, 2: "
    "wrong\n"
    "usage.\n";

struct Hashes {
  std::string spheres, asset;
};

struct Row {
  std::string mesh, grid;
  std::size_t count = 0;
  std::uint64_t seed = 0;
  Hashes hashes;

  std::string settings() const {
    return mesh + "," + grid + "," + std::to_string(count) + "," + std::to_string(seed);
  }
};

struct Options {
  std::string table, only;
  ist::Device device = ist::Device::automatic;
  bool write = false;
};

std::vector<Row> read_table(const std::string& path, std::string& head) {
  std::ifstream file(path);
  if (!file) throw ist::Error(path + ": cannot be read");
  std::getline(file, head);
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    std::istringstream fields(line);
    Row row;
    std::string count, seed;
    std::getline(fields, row.mesh, ',');
    std::getline(fields, row.grid, ',');
    std::getline(fields, count, ',');
    std::getline(fields, seed, ',');
    std::getline(fields, row.hashes.spheres, ',');
    std::getline(fields, row.hashes.asset, ',');
    row.count = std::stoull(count);
    row.seed = std::stoull(seed);
    rows.push_back(row);
  }
  return rows;
}

ist::GridMode grid_named(const std::string& name) {
  if (name == "banded") return ist::GridMode::banded;
  if (name == "uniform") return ist::GridMode::uniform;
  if (name == "explicit") return ist::GridMode::explicit_refinement;
  if (name == "implicit") return ist::GridMode::implicit_refinement;
  if (name == "hybrid") return ist::GridMode::hybrid;
  throw ist::Error(name + ": no such grid");
}

/// Null if the file is not there.
const ist::ClosedMesh* mesh_named(const std::string& name) {
  static std::map<std::string, ist::ClosedMesh> meshes;  // rows of one mesh share its import
  const auto known = meshes.find(name);
  if (known != meshes.end()) return &known->second;
  const std::string sample = "sample:";
  const bool is_sample = name.rfind(sample, 0) == 0;
  const std::filesystem::path path = ist::testing::shared_path(name);
  if (!is_sample && !std::filesystem::exists(path)) return nullptr;
  const ist::TriangleMesh mesh =
      is_sample ? ist::make_sample(name.substr(sample.size())) : ist::load_mesh(path.string());
  return &meshes.emplace(name, ist::close_mesh(mesh, name)).first->second;
}

std::string hex(std::uint64_t hash) {
  char text[17];
  std::snprintf(text, sizeof text, "%016" PRIx64, hash);
  return text;
}

Hashes bake_and_hash(const Row& row, const ist::ClosedMesh& mesh, ist::Device device) {
  ist::PackingSettings settings;
  settings.max_spheres = row.count;
  settings.seed = row.seed;
  settings.device = device;
  settings.grid = grid_named(row.grid);
  const ist::Asset asset = ist::bake(mesh, settings);
  ist::AssetHeader header;
  std::memcpy(&header, asset.bytes().data(), sizeof header);
  const std::byte* const spheres = asset.bytes().data() + header.inner_spheres;
  return {hex(XXH3_64bits(spheres, header.sphere_count * sizeof(ist::Sphere))),
          hex(header.content_hash)};
}

Options parse(const std::vector<std::string>& arguments) {
  Options options;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string& argument = arguments[i];
    if (argument == "--write") {
      options.write = true;
    } else if (argument == "--only" && i + 1 < arguments.size()) {
      options.only = arguments[++i];
    } else if (argument == "--device" && i + 1 < arguments.size()) {
      const std::string& name = arguments[++i];
      options.device = name == "cuda" ? ist::Device::cuda
                                      : (name == "cpu" ? ist::Device::cpu : ist::Device::automatic);
    } else if (options.table.empty() && argument[0] != '-') {
      options.table = argument;
    } else {
      options.table.clear();
      break;
    }
  }
  return options;
}

int run(const Options& options) {
  std::string head;
  std::vector<Row> rows = read_table(options.table, head);
  std::size_t compared = 0, different = 0;
  for (Row& row : rows) {
    if (row.settings().find(options.only) == std::string::npos) continue;
    const ist::ClosedMesh* const mesh = mesh_named(row.mesh);
    if (mesh == nullptr) {
      std::printf("missing    %s\n", row.settings().c_str());
      continue;
    }
    const auto start = std::chrono::steady_clock::now();
    const Hashes found = bake_and_hash(row, *mesh, options.device);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    bool same = true;
    const auto compare = [&](const std::string& expected, const std::string& hash) {
      if (expected.empty()) return;
      ++compared;
      if (expected != hash) same = false, ++different;
    };
    compare(row.hashes.spheres, found.spheres);
    compare(row.hashes.asset, found.asset);
    std::printf("%s %s  spheres %s  asset %s  %.2f s\n", same ? "same      " : "DIFFERENT ",
                row.settings().c_str(), found.spheres.c_str(), found.asset.c_str(),
                elapsed.count());
    std::fflush(stdout);
    row.hashes = found;
  }
  std::printf("%zu hashes compared, %zu different\n", compared, different);
  if (!options.write) return different == 0 && compared > 0 ? 0 : 1;
  std::ofstream file(options.table);
  file << head << "\n";
  for (const Row& row : rows)
    file << row.settings() << "," << row.hashes.spheres << "," << row.hashes.asset << "\n";
  file.close();
  if (!file) throw ist::Error(options.table + ": cannot be written");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const Options options = parse({argv + 1, argv + argc});
  if (options.table.empty()) {
    std::cerr << kUsage;
    return 2;
  }
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::cerr << "bake_hashes: " << error.what() << "\n";
    return 1;
  }
}
