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

struct Baked {
  std::string file;
  Asset asset;
};

/// A shape of a link; its mesh, closed, if it is one.
struct LinkShape {
  std::string link;
  const PlacedShape* placed;
  std::optional<ClosedMesh> mesh = std::nullopt;
  std::string file = {};  ///< of its asset
};

bool equal(const LinkShape& a, const LinkShape& b) {
  return a.mesh && b.mesh && a.mesh->mesh.triangles == b.mesh->mesh.triangles &&
         a.mesh->mesh.vertices == b.mesh->mesh.vertices;
}

std::vector<LinkShape> closed_shapes(const RobotModel& robot, const RobotBake& what) {
  const PackagePaths paths = package_paths(what.robot, what.options);
  LinkMeshes meshes(what.robot, what.settings.mesh);
  std::vector<LinkShape> shapes;
  for (const RobotLink& link : robot.links)
    for (const PlacedShape& placed : link.shapes(what.options.shapes())) {
      LinkShape& shape = shapes.emplace_back(LinkShape{link.name, &placed});
      if (std::holds_alternative<LinkMesh>(placed.shape))
        shape.mesh =
            meshes.close(link.name, [&] { return mesh_of(placed, paths, what.robot).mesh; });
    }
  meshes.finish();
  return shapes;
}

/// LINK.ist, or where that is taken LINK_1.ist, …
std::string free_name(const std::string& link, const std::vector<Baked>& taken) {
  std::string file = file_name(link) + ".ist";
  for (int k = 1; std::any_of(taken.begin(), taken.end(),
                              [&](const Baked& baked) { return baked.file == file; });
       ++k)
    file = fmt::format("{}_{}.ist", file_name(link), k);
  return file;
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
  std::vector<Baked> assets;
  Json links = Json::object();
  std::size_t fields = 0;
  std::vector<LinkShape> shapes = closed_shapes(robot, what);
  for (const RobotLink& link : robot.links) links[link.name] = Json::array();
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const LinkShape& shape = shapes[i];
    if (!shape.mesh) {
      links[shape.link].push_back(
          {{"field", field_spec_of(shape.placed->shape)},
           {"pose", pose_json(shape.placed->rotation, shape.placed->translation)}});
      ++fields;
      continue;
    }
    const auto same = std::find_if(shapes.begin(), shapes.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const LinkShape& one) { return equal(one, shape); });
    shapes[i].file = same->file;
    if (&*same == &shape) {
      shapes[i].file = free_name(shape.link, assets);
      assets.push_back({shape.file, bake_shape(*shape.mesh, what)});
    }
    // The asset is in the link's frame already.
    links[shape.link].push_back(
        {{"asset", shape.file},
         {"pose", pose_json(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero())}});
  }
  require_folder(what.folder);
  const Json index = {{"robot", robot.name}, {"links", links}};
  const std::string index_file = file_name(robot.name) + ".json";
  {
    const InterruptGuard guard;
    for (const Baked& baked : assets) baked.asset.save(fs::path(what.folder) / baked.file);
    write_text((fs::path(what.folder) / index_file).string(), json_text(index) + "\n");
  }
  exit_if_interrupted();
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (what.json) {
    Json result = {{"index", (fs::path(what.folder) / index_file).string()}};
    result.update(index);
    result["seconds"] = seconds;
    fmt::print("{}\n", json_text(result));
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
