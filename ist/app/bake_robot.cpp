#include "app/bake_robot.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <system_error>
#include <vector>

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/error.h>

#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/mesh_notes.h"
#include "app/progress_line.h"
#include "robot/link_mesh.h"

namespace ist::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// A name that a file may have.
std::string file_name(const std::string& name) {
  std::string out;
  for (const char c : name)
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                   c == '-' || (c == '.' && !out.empty())
               ? c
               : '_';
  return out.empty() ? "robot" : out;
}

/// The description of a primitive, as parse_field() takes it.
std::string field_spec_of(const Shape& shape) {
  if (const auto* box = std::get_if<LinkBox>(&shape))
    return fmt::format("box:{:.17g},{:.17g},{:.17g}", box->half_extents.x(), box->half_extents.y(),
                       box->half_extents.z());
  if (const auto* cylinder = std::get_if<LinkCylinder>(&shape))
    return fmt::format("cylinder:{:.17g},{:.17g}", cylinder->radius, cylinder->half_height);
  return fmt::format("ball:{:.17g}", std::get<LinkBall>(shape).radius);
}

Json pose_json(const Eigen::Quaterniond& q, const Eigen::Vector3d& t) {
  return {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
}

Asset bake_shape(const ClosedMesh& mesh, const RobotBake& what) {
  constexpr double kPatience = 0.15;  // [s]
  const InterruptGuard guard(kPatience);
  ProgressLine line(what.quiet);
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

struct Baked {
  std::string file;
  Asset asset;
};

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
  const RobotModel robot = read_robot(what.robot);
  const PackagePaths paths = package_paths(what.robot, what.options);
  std::vector<Baked> assets;
  std::set<std::string> taken;
  Json links = Json::object();
  std::size_t fields = 0;
  for (const RobotLink& link : robot.links) {
    Json shapes = Json::array();
    for (const PlacedShape& placed : link.shapes(what.options.shapes())) {
      if (!std::holds_alternative<LinkMesh>(placed.shape)) {
        shapes.push_back({{"field", field_spec_of(placed.shape)},
                          {"pose", pose_json(placed.rotation, placed.translation)}});
        ++fields;
        continue;
      }
      std::string file = file_name(link.name);
      for (int k = 1; !taken.insert(file).second; ++k)
        file = fmt::format("{}_{}", file_name(link.name), k);
      file += ".ist";
      const ClosedMesh mesh =
          close_aloud(mesh_of(placed, paths, what.robot).mesh,
                      fmt::format("{}: line {}: link {}", what.robot, placed.line, link.name),
                      what.settings.mesh);
      assets.push_back({file, bake_shape(mesh, what)});
      // The asset is in the link's frame already.
      shapes.push_back(
          {{"asset", file},
           {"pose", pose_json(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero())}});
    }
    links[link.name] = shapes;
  }
  if (assets.empty() && fields == 0) refuse_no_shapes(what.options, what.robot);
  require_folder(what.folder);
  const Json index = {{"robot", robot.name}, {"links", links}};
  const std::string index_file = file_name(robot.name) + ".json";
  {
    const InterruptGuard guard;
    for (const Baked& baked : assets) baked.asset.save(fs::path(what.folder) / baked.file);
    write_text((fs::path(what.folder) / index_file).string(), index.dump(2) + "\n");
  }
  exit_if_interrupted();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (what.json) {
    Json result = {{"index", (fs::path(what.folder) / index_file).string()}};
    result.update(index);
    result["seconds"] = seconds;
    fmt::print("{}\n", result.dump(2));
  } else if (!what.quiet) {
    fmt::print("{}\n", (fs::path(what.folder) / index_file).string());
    for (const Baked& baked : assets)
      fmt::print("  {:<32} {:>6} spheres, coverage {:.1f} %\n", baked.file,
                 baked.asset.view().header().sphere_count,
                 100 * baked.asset.view().header().coverage);
    fmt::print("  fields {}, time {:.2f} s\n", fields, seconds);
  }
}

}  // namespace ist::app
