#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <spdlog/spdlog.h>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "app/bake_library.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/mesh_notes.h"
#include "app/options.h"
#include "app/progress_line.h"
#include "library/asset_summary.h"
#include "library/settings/bake_settings.h"
#include "library/text.h"
#include "robots/description/link_mesh.h"

namespace ist::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct BakeOptions {
  std::string mesh, output, closed_mesh;
  SettingOptions asked;
  std::string device = "auto";
  unsigned threads = 0;
  bool json = false, quiet = false;
  LibraryOptions library;
  RobotOptions robot;
};

/// "copy 1.4 % (71), plane 0.3 % (24), …".
std::string describe_partners(const std::vector<PartnerError>& partners) {
  std::string text;
  for (const PartnerError& of : partners)
    text += fmt::format("{}{} {:.2g} % ({})", text.empty() ? "" : ", ", name_of(of.partner),
                        100 * of.median, of.poses);
  return text;
}

Json partners_json(const std::vector<PartnerError>& partners) {
  Json list = Json::array();
  for (const PartnerError& of : partners)
    list.push_back({{"partner", name_of(of.partner)}, {"error", of.median}, {"poses", of.poses}});
  return list;
}

Baked bake_interruptibly(const ClosedMesh& mesh, const BakeSettings& settings, bool quiet) {
  constexpr double kPatience = 0.15;  // [s] some steps take seconds, and leave no incomplete files
  return interruptibly(
      kPatience, quiet, settings.target.relative_error > 0,
      [&](const ProgressCallback& progress) { return bake_as_asked(mesh, settings, progress); });
}

void require_folder(const std::string& folder) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw Error(folder + ": is a file; name a folder for the robot's assets");
  fs::create_directories(folder, error);
  if (error) throw Error(folder + ": cannot create the folder: " + error.message());
}

/// Bakes every mesh of every link of the URDF, in the link's frame, and writes assets and the
/// index, all or nothing: files are written after the last bake. Boxes, cylinders and spheres
/// become shape descriptions of the command line with a pose. Throws Error.
void bake_robot(const BakeOptions& options, const BakeSettings& settings) {
  const auto start = std::chrono::steady_clock::now();
  const RobotModel robot = read_robot_for(options.robot, options.mesh);
  warn_of_left_out(links_seen_only(robot, options.robot), options.mesh);
  Job like;
  like.settings = settings;
  const RobotAssets all = robot_assets(robot, options.robot.shapes(), "", like);
  const PackagePaths paths = package_paths(options.mesh, options.robot);
  LinkMeshes meshes(options.mesh, settings.mesh, options.robot.repaired);
  std::vector<std::optional<ClosedMesh>> closed;
  for (std::size_t i = 0; i < all.jobs.size(); ++i)
    closed.push_back(meshes.close(
        all.links[i], [&] { return mesh_of(*all.jobs[i].shape, paths, options.mesh).mesh; }));
  meshes.finish();
  std::vector<Asset> assets;
  for (const auto& mesh : closed)
    assets.push_back(bake_interruptibly(*mesh, settings, options.quiet).asset);
  require_folder(options.output);
  const std::string index_file = (fs::path(options.output) / (all.name + ".json")).string();
  const auto file_of = [&](std::size_t i) { return all.jobs[i].name + ".ist"; };
  {
    const InterruptGuard guard;
    for (std::size_t i = 0; i < assets.size(); ++i)
      assets[i].save(fs::path(options.output) / file_of(i));
    write_text(index_file, json_text(all.index) + "\n");
  }
  exit_if_interrupted();
  for (std::size_t i = 0; i < assets.size(); ++i)
    for (const std::string& warning : warnings_of(assets[i].view()))
      for (const std::string& link : all.links[i]) meshes.warn(link, warning);
  meshes.finish();
  const double seconds = seconds_since(start);
  if (options.json) {
    Json result = {{"index", index_file}};
    result.update(all.index);
    result["warnings"] = meshes.said();
    result["seconds"] = seconds;
    fmt::print("{}\n", json_text(result));
  } else if (!options.quiet) {
    fmt::print("{}\n", index_file);
    for (std::size_t i = 0; i < assets.size(); ++i)
      fmt::print("  {:<32} {:>6} spheres, coverage {:.1f} %\n", file_of(i),
                 assets[i].view().header().sphere_count, 100 * assets[i].view().header().coverage);
    fmt::print("  assets {}, time {:.2f} s\n", assets.size(), seconds);
  }
}

void run_bake(const BakeOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  BakeSettings settings = options.asked.settings;
  settings.packing.threads = options.threads;
  const bool robot = is_robot_file(options.mesh);
  if (!robot) {
    require_output(options.output, options.mesh, "the asset");
    if (has_mesh_ending(options.output))
      throw Error(options.output + ": has the extension of a mesh; name the asset " +
                  fs::path(options.output).replace_extension(".ist").string());
  }
  if (!options.closed_mesh.empty())
    require_output(options.closed_mesh, options.mesh, "the closed mesh");
  settings.packing.device = usable_device(options.device);
  if (!settings.mesh_only) announce_device(settings.packing.device);
  if (robot) return bake_robot(options, settings);

  const auto start = std::chrono::steady_clock::now();
  const auto [declared, mesh] = read_mesh_aloud(options.mesh, settings.mesh);
  const double import_seconds = seconds_since(start);
  const auto [asset, partners] = bake_interruptibly(mesh, settings, options.quiet);
  const double bake_seconds = seconds_since(start) - import_seconds;
  {
    const InterruptGuard guard;  // the file is written completely or not at all
    if (!options.closed_mesh.empty()) write_mesh(mesh.mesh, options.closed_mesh);
    asset.save(options.output);
  }
  exit_if_interrupted();

  for (const std::string& warning : warnings_of(asset.view()))
    spdlog::warn("{}: {}", options.output, warning);
  if (options.json) {
    Json result = {{"asset", options.output}, {"mesh", options.mesh}};
    result.update(asset_json(asset.view()));
    result["declared"] = declared_json(declared);
    result["notes"] = mesh.report.notes;
    result["closing"] = closing_json(mesh.report);
    result["partners"] = partners_json(partners);
    result["seconds"] = {{"import", import_seconds}, {"bake", bake_seconds}};
    fmt::print("{}\n", json_text(result));
  } else if (!options.quiet) {
    const std::string declares = describe_declared(declared);
    fmt::print("{}\n{}", options.output, describe_asset(asset.view()));
    if (!partners.empty())
      fmt::print("  {:<12} {}: median error (poses)\n", "partners", describe_partners(partners));
    if (!declares.empty()) fmt::print("  {:<12} {}\n", "declared", declares);
    if (const std::string closing = describe_closing(mesh.report); !closing.empty())
      fmt::print("  {:<12} {}\n", "closed by", closing);
    fmt::print("  {:<12} import {:.2f} s, bake {:.2f} s\n", "time", import_seconds, bake_seconds);
  }
}

}  // namespace

void add_bake(CLI::App& app) {
  const auto options = std::make_shared<BakeOptions>();
  CLI::App* const command = app.add_subcommand(
      "bake", "Pack a closed mesh with spheres and write an .ist asset, or many with --manifest");
  CLI::Option* const mesh =
      add_input(command, "MESH", options->mesh,
                "OBJ, STL, PLY, OFF, GLB/glTF, DAE, VDB, …; or a robot: .urdf, .sdf, .xml")
          ->required(false);
  add_output(command, options->output,
             "The .ist file to write. With --manifest: the folder for NAME.ist. For a robot: the "
             "folder for LINK.ist and an index. A missing folder is created",
             Dash::refused);
  add_setting_options(command, options->asked, all_settings());
  command
      ->add_option("--write-mesh", options->closed_mesh,
                   "Also write the mesh that was baked, after --repair or --wrap: .obj, .ply, .off "
                   "or .stl")
      ->check([](const std::string& path) -> std::string {
        return has_mesh_ending(path) ? ""
                                     : "'" + path + "' does not end in .obj, .ply, .off or .stl";
      });
  add_device_option(command, options->device,
                    "Device of the bake; auto = the GPU if there is one, else the CPU");
  add_whole(command, "--threads", options->threads,
            "Number of threads; 0 = all cores. The result does not depend on it");
  add_robot_options(command, options->robot);
  add_library_options(command, options->library);
  command->add_flag("--json", options->json, "Print the result as JSON");
  command->add_flag("--quiet", options->quiet, "Print errors only");
  command->footer(
      "Packing stops at the first limit it reaches. Ctrl-C stops the bake; no file is written.\n"
      "Example: ist bake bolt.obj -o bolt.ist --spheres 4000\n"
      "Example: ist bake ur5.urdf -o ur5 --spheres 1000\n"
      "Example: ist bake --manifest library.toml -o assets --cache ~/.cache/ist");
  command->callback([options, mesh] {
    if (!options->library.manifest.empty()) {
      refuse_idle_options(options->robot, options->library.manifest);
      if (!options->mesh.empty())
        throw CLI::ValidationError("--manifest", "excludes MESH; list the mesh in the manifest");
      if (!options->closed_mesh.empty())
        throw CLI::ValidationError("--write-mesh", "takes one mesh, not a manifest");
      if (!options->asked.given.empty())
        throw CLI::ValidationError("--" + *options->asked.given.begin(),
                                   "cannot be combined with --manifest; set it in the manifest, "
                                   "without --, under [defaults] or an [[asset]]");
      return run_library({options->library, options->output, options->device, options->threads,
                          options->json, options->quiet});
    }
    if (!options->closed_mesh.empty() && is_robot_file(options->mesh))
      throw CLI::ValidationError("--write-mesh", "takes one mesh, not a robot");
    if (options->mesh.empty()) throw CLI::RequiredError(mesh->get_name());
    complete_settings(options->asked);
    refuse_idle_options(options->robot, options->mesh);
    if (is_robot_file(options->mesh))
      for (const Setting& placing : placing_settings())
        if (options->asked.given.contains(placing.name))
          throw CLI::ValidationError("--" + placing.name,
                                     "cannot be combined with a robot; its URDF places the meshes");
    run_bake(*options);
  });
}

}  // namespace ist::app
