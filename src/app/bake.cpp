#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <memory>

#include <ist/bake.h>
#include <ist/error.h>

#include "app/asset_summary.h"
#include "app/commands.h"
#include "app/interrupt.h"
#include "app/number_checks.h"
#include "app/output_file.h"
#include "app/progress_line.h"
#include "app/text.h"

namespace ist::app {
namespace {

struct BakeOptions {
  std::string mesh, output;
  PackingSettings packing;
  std::string grid = "banded", device = "auto";
  ErrorTarget target = {0, ErrorTarget().at_overlap};  ///< error 0: none is asked for
  bool repair = false, json = false, quiet = false;
};

/// Says where the bake runs, if that was left open. Throws Error if it cannot run there.
void announce_device(Device device) {
  std::string why;
  if (device == Device::cuda)
    gpu_info();
  else if (device == Device::automatic && gpu_available(0, &why))
    spdlog::info("baking on the GPU: {}", gpu_info().name);
  else if (device == Device::automatic)
    spdlog::info("baking on the CPU: {}", why);
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// A number, or a number and a percent sign.
double parse_share(const std::string& text) {
  const bool percent = !text.empty() && text.back() == '%';
  double value = 0;
  if (!CLI::detail::lexical_cast(percent ? text.substr(0, text.size() - 1) : text, value))
    return -1;
  return percent ? value / 100 : value;
}

/// What CLI11 asks of a validator: "" or what is wrong.
template <class Accepts>
CLI::Validator share(const char* range, Accepts accepts) {
  return CLI::Validator(
      [=](std::string& text) {
        return accepts(parse_share(text)) ? std::string()
                                          : "'" + text + "' is not a share " + range;
      },
      "SHARE");
}

Asset bake_interruptibly(const ClosedMesh& mesh, const ErrorTarget& target,
                         const PackingSettings& settings, bool quiet) {
  const InterruptGuard guard;
  ProgressLine line(quiet);
  try {
    const auto show = [&](const Progress& progress) {
      line.show(progress);
      return !interrupted();
    };
    Asset asset = target.relative_error > 0 ? bake_to_error(mesh, target, settings, show)
                                            : bake(mesh, settings, show);
    exit_if_interrupted();
    return asset;
  } catch (const Error&) {
    exit_if_interrupted();
    throw;
  }
}

void run_bake(const BakeOptions& options) {
  if (options.quiet) spdlog::set_level(spdlog::level::err);
  PackingSettings settings = options.packing;
  settings.grid = grid_named(options.grid);
  require_output(options.output, options.mesh, "the asset");
  settings.device = device_named(options.device);
  announce_device(settings.device);

  const auto start = std::chrono::steady_clock::now();
  const ClosedMesh mesh =
      close_mesh(load_mesh(options.mesh), options.mesh,
                 options.repair ? OpenMeshPolicy::repair : OpenMeshPolicy::refuse);
  for (const std::string& note : mesh.report.notes) spdlog::warn("{}: {}", options.mesh, note);
  const double import_seconds = seconds_since(start);
  const Asset asset = bake_interruptibly(mesh, options.target, settings, options.quiet);
  const double bake_seconds = seconds_since(start) - import_seconds;
  {
    const InterruptGuard guard;  // the file is written whole, or not at all
    asset.save(options.output);
  }
  exit_if_interrupted();

  if (options.json) {
    nlohmann::ordered_json result = {{"asset", options.output}, {"mesh", options.mesh}};
    result.update(asset_json(asset.view()));
    result["notes"] = mesh.report.notes;
    result["seconds"] = {{"import", import_seconds}, {"bake", bake_seconds}};
    fmt::print("{}\n", result.dump(2));
  } else if (!options.quiet) {
    fmt::print("{}\n{}  {:<12} import {:.2f} s, bake {:.2f} s\n", options.output,
               describe_asset(asset.view()), "time", import_seconds, bake_seconds);
  }
}

}  // namespace

void add_bake(CLI::App& app) {
  const auto options = std::make_shared<BakeOptions>();
  PackingSettings& packing = options->packing;
  CLI::App* const command =
      app.add_subcommand("bake", "Pack a closed mesh with spheres and write an .ist asset");
  command->add_option("MESH", options->mesh, "OBJ, STL, PLY, OFF, GLB/glTF, DAE, …")->required();
  command->add_option("-o,--output", options->output, "The .ist file to write")->required();
  command
      ->add_option("--spheres", packing.max_spheres,
                   "Stop at this count, 0 = no limit (with --target-error: 200,000, as by default)")
      ->check(is_count)
      ->capture_default_str();
  command
      ->add_option_function<std::string>(
          "--target-error",
          [options, command](const std::string& text) {
            options->target.relative_error = parse_share(text);
            // Unless asked for, the default count is no limit here.
            if (command->count("--spheres") == 0) options->packing.max_spheres = 0;
          },
          "As many spheres as this median error of the volume needs, e.g. 1%; at most --spheres "
          "where given, else 200,000")
      ->check(share("above 0 and below 1", [](double x) { return x > 0 && x < 1; }));
  command
      ->add_option_function<std::string>(
          "--at-overlap",
          [options](const std::string& text) { options->target.at_overlap = parse_share(text); },
          "Overlap, part of the volume, at which it is to hold")
      ->check(share("from 0.01% to 50%", [](double x) { return x >= 1e-4 && x <= 0.5; }))
      ->needs("--target-error")
      ->default_str("0.1%");
  command->add_option("--coverage", packing.target_coverage, "Stop at this share of the volume")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--min-radius", packing.min_radius, "[u] Insert nothing smaller")
      ->check(is_not_negative)
      ->capture_default_str();
  command->add_option("--time", packing.time_limit, "[s] Stop packing after this, 0 = no limit")
      ->check(is_not_negative)
      ->capture_default_str();
  command
      ->add_option("--epsilon", packing.epsilon,
                   "Every sphere is at least 1 − E times the largest that would fit; 0 = the "
                   "library's own schedule")
      ->check(is_slack)
      ->capture_default_str();
  command->add_option("--grid", options->grid, "How space is searched")
      ->check(CLI::IsMember({"banded", "uniform", "explicit", "implicit", "hybrid"}))
      ->capture_default_str();
  command
      ->add_option("--grid-resolution", packing.grids.resolution,
                   "Cells on the longest side of the fixed grid, or of hybrid's first distance "
                   "grid; 0 = automatic")
      ->check(is_count)
      ->capture_default_str();
  command
      ->add_option("--grid-start", packing.grids.start,
                   "Cells on the longest side of the first grid of prototypes; 0 = automatic")
      ->check(is_count)
      ->capture_default_str();
  command
      ->add_option("--grid-refinements", packing.grids.refinements,
                   "How often that grid is split in 8; -1 = automatic")
      ->check(CLI::Range(-1, 10))
      ->capture_default_str();
  command
      ->add_option("--grid-rounds", packing.grids.rounds_per_level,
                   "Rounds before each split; 0 = automatic")
      ->check(is_count)
      ->capture_default_str();
  command
      ->add_option("--device", options->device,
                   "Where the bake runs; auto: on the GPU if there is one")
      ->check(CLI::IsMember({"auto", "cpu", "cuda"}))
      ->capture_default_str();
  command->add_option("--threads", packing.threads, "0 = all cores; never changes the result")
      ->check(is_count)
      ->capture_default_str();
  command->add_option("--seed", packing.seed, "Breaks ties; any value packs equally well")
      ->check(is_count)
      ->capture_default_str();
  command->add_flag("--repair", options->repair, "Close an open mesh, and say what was done");
  command->add_flag("--json", options->json, "The result as JSON on stdout");
  command->add_flag("--quiet", options->quiet, "Only errors");
  command->footer(
      "The first limit met stops the packing. Ctrl-C ends the bake without writing a file.\n"
      "Example: ist bake bolt.obj -o bolt.ist --spheres 4000");
  command->callback([options] { run_bake(*options); });
}

}  // namespace ist::app
