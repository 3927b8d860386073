#include "app/bake_robot.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/error.h>

#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/link_meshes.h"
#include "app/progress_line.h"
#include "library/text.h"
#include "robot/link_mesh.h"

namespace ist::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Asset bake_shape(const ClosedMesh& mesh, const RobotBake& what) {
  constexpr double kPatience = 0.15;  // [s]
  const InterruptGuard guard(kPatience);
  ProgressLine line(what.quiet, what.settings.target.relative_error > 0);
  try {
    const auto show = [&](const Progress& progress) {
      line.show(progress);
      return !interrupted();
    };
    const PackingSettings& packing = what.settings.packing;
    Asset asset = what.settings.surface_only
                      ? bake_surface(mesh, packing.surface, packing.threads, show)
                  : what.settings.target.relative_error > 0
                      ? bake_to_error(mesh, what.settings.target, packing, show).asset
                      : bake(mesh, packing, show);
    exit_if_interrupted();
    return asset;
  } catch (const Error&) {
    exit_if_interrupted();
    throw;
  }
}

/// The folder, made if it is not there. Throws Error.
void require_folder(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw Error(folder + ": is a file; name a folder for the robot's assets");
  fs::create_directories(folder, error);
  if (error) throw Error(folder + ": cannot create the folder: " + error.message());
}

}  // namespace

void bake_robot(const RobotBake& what) {
  if (what.quiet) spdlog::set_level(spdlog::level::err);
  const auto start = std::chrono::steady_clock::now();
  const RobotModel robot = read_robot_for(what.options, what.robot);
  Job like;
  like.settings = what.settings;
  const RobotAssets all = robot_assets(robot, what.options.shapes(), "", like);
  const PackagePaths paths = package_paths(what.robot, what.options);
  LinkMeshes meshes(what.robot, what.settings.mesh);
  std::vector<std::optional<ClosedMesh>> closed;
  for (std::size_t i = 0; i < all.jobs.size(); ++i) {
    closed.emplace_back();
    for (const std::string& link : all.links[i])
      closed[i] =
          meshes.close(link, [&] { return mesh_of(*all.jobs[i].shape, paths, what.robot).mesh; });
  }
  meshes.finish();
  std::vector<Asset> assets;
  for (const auto& mesh : closed) assets.push_back(bake_shape(*mesh, what));
  require_folder(what.folder);
  const std::string index_file = (fs::path(what.folder) / (all.name + ".json")).string();
  const auto file_of = [&](std::size_t i) { return all.jobs[i].name + ".ist"; };
  {
    const InterruptGuard guard;
    for (std::size_t i = 0; i < assets.size(); ++i)
      assets[i].save(fs::path(what.folder) / file_of(i));
    write_text(index_file, json_text(all.index) + "\n");
  }
  exit_if_interrupted();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (what.json) {
    Json result = {{"index", index_file}};
    result.update(all.index);
    result["seconds"] = seconds;
    fmt::print("{}\n", json_text(result));
  } else if (!what.quiet) {
    fmt::print("{}\n", index_file);
    for (std::size_t i = 0; i < assets.size(); ++i)
      fmt::print("  {:<32} {:>6} spheres, coverage {:.1f} %\n", file_of(i),
                 assets[i].view().header().sphere_count, 100 * assets[i].view().header().coverage);
    fmt::print("  assets {}, time {:.2f} s\n", assets.size(), seconds);
  }
}

}  // namespace ist::app
