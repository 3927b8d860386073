#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>

#include <ist/bake.h>
#include <ist/error.h>

#include "app/asset_summary.h"
#include "app/bake_robot.h"
#include "app/coarseness.h"
#include "app/commands.h"
#include "app/device_option.h"
#include "app/file_options.h"
#include "app/grid_options.h"
#include "app/input_mesh.h"
#include "app/interrupt.h"
#include "app/number_options.h"
#include "app/progress_line.h"
#include "app/text.h"

namespace ist::app {
namespace {

struct BakeOptions {
  std::string mesh, output;
  PackingSettings packing;
  std::string grid = "banded", device = "auto";
  ErrorTarget target = {0, ErrorTarget().at_overlap};  ///< error 0: none is asked for
  RobotOptions robot;
  bool repair = false, json = false, quiet = false;
};

constexpr std::size_t kMostSpheres = 0x7fffffff;  ///< what the library takes

/// Says where the bake runs, if that was left open.
void announce_device(Device device) {
  if (device != Device::automatic) return;
  std::string why;
  if (gpu_available(0, &why))
    spdlog::info("baking on the GPU: {}", gpu_info().name);
  else
    spdlog::info("baking on the CPU: {}", why);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// An asset, and what its partners erred where an error was asked for.
struct Baked {
  Asset asset;
  std::vector<PartnerError> partners = {};
};

Baked bake_now(const ClosedMesh& mesh, const ErrorTarget& target, const PackingSettings& settings,
               const ProgressCallback& progress) {
  if (!(target.relative_error > 0)) return {bake(mesh, settings, progress)};
  TargetedAsset found = bake_to_error(mesh, target, settings, progress);
  Baked baked = {std::move(found.asset)};
  for (const PartnerError& partner : found.partners)
    if (partner.poses > 0) baked.partners.push_back(partner);
  return baked;
}

/// "copy 1.4 % (71), plane 0.3 % (24), …".
std::string describe_partners(const std::vector<PartnerError>& partners) {
  std::string text;
  for (const PartnerError& of : partners)
    text += fmt::format("{}{} {:.2g} % ({})", text.empty() ? "" : ", ", name_of(of.partner),
                        100 * of.median, of.poses);
  return text;
}

nlohmann::ordered_json partners_json(const std::vector<PartnerError>& partners) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const PartnerError& of : partners)
    list.push_back({{"partner", name_of(of.partner)}, {"error", of.median}, {"poses", of.poses}});
  return list;
}

Baked bake_interruptibly(const ClosedMesh& mesh, const ErrorTarget& target,
                         const PackingSettings& settings, bool quiet) {
  constexpr double kPatience = 0.15;  // [s] some steps take seconds, and leave nothing half done
  const InterruptGuard guard(kPatience);
  ProgressLine line(quiet);
  try {
    const auto show = [&](const Progress& progress) {
      line.show(progress);
      return !interrupted();
    };
    Baked baked = bake_now(mesh, target, settings, show);
    exit_if_interrupted();
    return baked;
  } catch (const Error&) {
    exit_if_interrupted();
    throw;
  }
}

void run_bake(const BakeOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  PackingSettings settings = options.packing;
  settings.grid = grid_named(options.grid);
  refuse_idle_options(settings);
  if (!is_robot_file(options.mesh)) require_output(options.output, options.mesh, "the asset");
  settings.device = usable_device(options.device);
  announce_device(settings.device);
  if (is_robot_file(options.mesh))
    return bake_robot({options.mesh, options.output, settings, options.robot, options.repair,
                       options.json, options.quiet});

  const auto start = std::chrono::steady_clock::now();
  const auto [declared, mesh] = read_input_mesh(options.mesh, options.repair);
  const double import_seconds = seconds_since(start);
  const auto [asset, partners] = bake_interruptibly(mesh, options.target, settings, options.quiet);
  const double bake_seconds = seconds_since(start) - import_seconds;
  {
    const InterruptGuard guard;  // the file is written whole, or not at all
    asset.save(options.output);
  }
  exit_if_interrupted();

  if (options.target.relative_error > 0 && !asset.view().predicted_errors().target_met())
    spdlog::warn("{}: {}", options.output, describe_target(asset.view()));
  if (const std::string coarse = describe_coarseness(asset.view()); !coarse.empty())
    spdlog::warn("{}: {}", options.output, coarse);
  if (options.json) {
    nlohmann::ordered_json result = {{"asset", options.output}, {"mesh", options.mesh}};
    result.update(asset_json(asset.view()));
    result["declared"] = declared_json(declared);
    result["notes"] = mesh.report.notes;
    result["partners"] = partners_json(partners);
    result["seconds"] = {{"import", import_seconds}, {"bake", bake_seconds}};
    fmt::print("{}\n", result.dump(2));
  } else if (!options.quiet) {
    const std::string declares = describe_declared(declared);
    fmt::print("{}\n{}", options.output, describe_asset(asset.view()));
    if (!partners.empty())
      fmt::print("  {:<12} {}: median error there, poses\n", "partners",
                 describe_partners(partners));
    if (!declares.empty()) fmt::print("  {:<12} {}\n", "mesh says", declares);
    fmt::print("  {:<12} import {:.2f} s, bake {:.2f} s\n", "time", import_seconds, bake_seconds);
  }
}

}  // namespace

void add_bake(CLI::App& app) {
  const auto options = std::make_shared<BakeOptions>();
  PackingSettings& packing = options->packing;
  CLI::App* const command =
      app.add_subcommand("bake", "Pack a closed mesh with spheres and write an .ist asset");
  add_input(command, "MESH", options->mesh,
            "OBJ, STL, PLY, OFF, GLB/glTF, DAE, VDB, …; or a robot: .urdf");
  add_output(command, options->output,
             "The .ist file to write; of a robot the folder, for an asset a mesh and an index",
             Dash::refused);
  add_whole<std::size_t>(
      command, "--spheres", packing.max_spheres,
      "Stop at this count, 0 = no limit (with --target-error: 200,000, as by default)", 0,
      kMostSpheres);
  CLI::Option* const target = add_share(
      command, "--target-error", options->target.relative_error,
      {.least = 0, .most = 1, .without_least = true, .without_most = true},
      "As many spheres as this median error of the volume needs, e.g. 1%; at most --spheres "
      "where given, else 200,000");
  target->default_str("");
  add_share(command, "--at-overlap", options->target.at_overlap, {.least = 1e-4, .most = 0.5},
            "Overlap, part of the volume, at which it is to hold")
      ->needs(target)
      ->default_str("0.1%");
  add_share(command, "--coverage", packing.target_coverage, {.least = 0, .most = 1},
            "Stop at this share of the volume");
  add_real(command, "--min-radius", packing.min_radius, {}, "[u] Insert nothing smaller");
  add_real(command, "--time", packing.time_limit, {},
           "[s] Stop packing after this, 0 = no limit; with --target-error: the whole search");
  add_share(command, "--epsilon", packing.epsilon, {.least = 0, .most = 1, .without_most = true},
            "Every sphere is at least 1 − E times the largest that would fit; 0 = the "
            "library's own schedule");
  CLI::Option* const field_error =
      add_real(command, "--field-error", packing.field.error, {.least = 0, .without_least = true},
               "[u] How far the surface kept for exact queries may be from the mesh's; as few "
               "triangles as that allows. Default: the mesh's own where they are at most 30,000, "
               "else that many");
  field_error->default_str("");
  command
      ->add_flag_callback(
          "--no-field", [&packing] { packing.field.wanted = false; },
          "Keep no surface: a smaller file, whose volumes are those of spheres")
      ->excludes(field_error);
  add_grid_options(command, options->grid, packing.grids);
  add_device_option(command, options->device,
                    "Where the bake runs; auto: on the GPU if there is one");
  add_whole(command, "--threads", packing.threads, "0 = all cores; never changes the result");
  add_whole(command, "--seed", packing.seed, "Breaks ties; any value packs equally well");
  command->add_flag("--repair", options->repair, "Close an open mesh, and say what was done");
  add_robot_options(command, options->robot);
  command->add_flag("--json", options->json, "The result as JSON on stdout");
  command->add_flag("--quiet", options->quiet, "Only errors");
  command->footer(
      "The first limit met stops the packing. Ctrl-C ends the bake without writing a file.\n"
      "Example: ist bake bolt.obj -o bolt.ist --spheres 4000");
  command->callback([options, command] {
    // Unless asked for, the default count is no limit where an error is the target.
    if (options->target.relative_error > 0 && command->count("--spheres") == 0)
      options->packing.max_spheres = 0;
    run_bake(*options);
  });
}

}  // namespace ist::app
