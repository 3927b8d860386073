// Every mesh of the shared data, baked: the asset loads, `check` finds it sound, and its volume is
// that of the union of the mesh's parts by Manifold (unions.csv), to the asset's stated error.
// `./dev soak corpus` runs it. Exits 1 at any that fails, 2 for data that is missing.

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/mesh.h>
#include <ist/types.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/shells.h"
#include "mesh/mesh_files.h"
#include "support/mesh_table.h"
#include "support/shared_data.h"

namespace {

using namespace ist;
namespace fs = std::filesystem;

/// The mesh as it is, or repaired if it is open; empty if it is refused.
std::optional<ClosedMesh> closed_mesh(const fs::path& path) {
  for (const OpenMeshPolicy policy : {OpenMeshPolicy::refuse, OpenMeshPolicy::repair}) {
    try {
      return close_mesh(load_mesh(path.string()), path.filename().string(), policy);
    } catch (const OpenMeshError&) {
    } catch (const Error&) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

/// The fault of an asset; empty if there is none.
std::string wrong(const Asset& asset, const ClosedMesh& mesh,
                  const std::optional<testing::MeshRow>& truth) {
  std::string text;
  for (const Invariant& one : check(asset, mesh))
    if (one.violations > 0) text += " [" + one.name + ' ' + std::to_string(one.worst) + "]";
  if (!truth) return text;
  const AssetHeader& header = asset.view().header();
  const double stated = std::ldexp(header.volume_error, 3 * header.exponent);
  const double off = std::abs(asset.view().volume() - testing::number(*truth, "volume"));
  const double allowed = stated + testing::number(*truth, "tolerance");
  if (!(off <= allowed)) {
    char volumes[100];
    std::snprintf(volumes, sizeof volumes, " [volume off by %.2g, not %.2g, of %.2g]", off, allowed,
                  asset.view().volume());
    text += volumes;
  }
  return text;
}

/// Whether Manifold, which takes every part as it is, can unite a mesh: none meets itself, and
/// where there are cavities no part meets another.
bool is_of_whole_parts(const ClosedMesh& mesh) {
  if (!mesh.meeting_pairs) return false;
  if (mesh.report.cavities > 0) return mesh.meeting_pairs->empty();
  DisjointSets parts = connected_pieces(EdgeTable(mesh.mesh.triangles));
  return std::all_of(mesh.meeting_pairs->begin(), mesh.meeting_pairs->end(),
                     [&](const auto& pair) { return parts.find(pair[0]) != parts.find(pair[1]); });
}

/// With all digits, for unions.py.
void write(const ClosedMesh& mesh, const fs::path& path) {
  std::FILE* const file = std::fopen(path.c_str(), "w");
  if (file == nullptr) throw Error(path.string() + ": cannot be written");
  for (const Eigen::Vector3d& v : mesh.mesh.vertices)
    std::fprintf(file, "v %.17g %.17g %.17g\n", v[0], v[1], v[2]);
  for (const auto& t : mesh.mesh.triangles)
    std::fprintf(file, "f %u %u %u\n", t[0] + 1, t[1] + 1, t[2] + 1);
  std::fclose(file);
}

std::vector<fs::path> meshes_below(const fs::path& root) {
  std::vector<fs::path> found;
  for (const auto& entry : fs::recursive_directory_iterator(root))
    if (entry.is_regular_file() && is_mesh_format(entry.path().string()))
      found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

int main(int argc, char** argv) {
  bool quick = false;
  std::string folder;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "--quick") {
      quick = true;
    } else if (argument == "--write" && i + 1 < argc) {
      folder = argv[++i];
    } else {
      std::fprintf(stderr,
                   "usage: corpus_soak [--quick | --write FOLDER]\n"
                   "--quick: meshes of a few thousand triangles, without spheres\n"
                   "--write: the closed meshes as .obj files, and nothing else\n");
      return 2;
    }
  }
  const fs::path root = testing::shared_path("");
  if (!fs::exists(root / "meshes")) {
    std::fprintf(stderr, "no shared data (IST_SHARED)\n");
    return testing::shared_required() ? 2 : 0;
  }
  std::map<std::string, testing::MeshRow> truths;
  for (testing::MeshRow& row :
       testing::read_mesh_table(std::string(IST_SOURCE_DIR) + "/tests/soak/unions.csv"))
    truths.emplace(row.at("file"), row);
  std::size_t baked = 0, refused = 0, compared = 0, failed = 0;
  for (const fs::path& path : meshes_below(root)) {
    const std::string name = fs::relative(path, root).string();
    constexpr std::uintmax_t kSmall = 150'000;  // bytes
    if (quick && fs::file_size(path) > kSmall) continue;
    std::string bad;
    try {
      const auto closed = closed_mesh(path);
      if (!closed) {
        ++refused;
        continue;
      }
      if (!folder.empty()) {
        if (!is_of_whole_parts(*closed)) continue;
        std::string flat = name;
        std::replace(flat.begin(), flat.end(), '/', '+');
        write(*closed, fs::path(folder) / (flat + ".obj"));
        continue;
      }
      const auto found = truths.find(name);
      const auto truth = found == truths.end() ? std::nullopt : std::optional(found->second);
      bad = wrong(bake_mesh_only(*closed), *closed, truth);
      if (!quick) bad += wrong(bake(*closed, {.max_spheres = 200}), *closed, truth);
      ++baked;
      compared += truth ? 1 : 0;
    } catch (const Error& error) {
      bad = std::string(" [") + error.what() + "]";
    }
    if (bad.empty()) continue;
    ++failed;
    std::printf("%s:%s\n", name.c_str(), bad.c_str());
  }
  std::printf("%zu meshes baked, %zu compared with Manifold's union, %zu refused, %zu failed\n",
              baked, compared, refused, failed);
  return failed == 0 ? 0 : 1;
}
