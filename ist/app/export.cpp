#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include <ist/bake.h>
#include <ist/error.h>

#include <ist/asset_layout.h>
#include "app/commands.h"
#include "app/file_options.h"
#include "app/interrupt.h"
#include "app/number_options.h"
#include "app/tree_glb.h"
#include "library/exported_spheres.h"

namespace ist::app {
namespace {

struct ExportOptions {
  std::string asset, output, measure = "matched";
  std::uint32_t detail = 0;
};

using Format = std::string (*)(std::span<const ExportedSphere>);

/// By the file's ending; standard output gets CSV; none for a scene. Throws Error.
Format format_of(const std::string& output) {
  const std::string ending = ending_of(output);
  if (ending == ".csv" || is_standard_output(output)) return spheres_csv;
  if (ending == ".ply") return spheres_ply;
  if (ending == ".json") return spheres_json;
  if (ending == ".glb") return nullptr;
  throw Error(output + ": unknown format '" + ending + "'; use .csv, .ply, .json or .glb");
}

void run_export(const ExportOptions& options) {
  const Format format = format_of(options.output);
  const Asset asset = Asset::load(options.asset);
  if (asset.view().sphere_count() == 0)
    throw Error(options.asset + ": has no spheres; bake it again without --surface-only");
  const std::uint32_t details = asset.view().header().detail_count;
  if (options.detail > details)
    throw Error(
        fmt::format("{}: --detail {} is out of range: the asset has {} coarser level(s) of detail",
                    options.asset, options.detail, details));
  const bool inner = options.measure == "inner";
  if (inner && format != nullptr)
    throw Error(options.output +
                ": always contains both inner and matched spheres; --measure is for .glb");
  if (inner && options.detail > 0)
    throw Error("--detail " + std::to_string(options.detail) +
                ": only matched spheres have levels of detail; omit --measure inner");
  const InterruptGuard guard;
  if (format == nullptr) {
    const std::string name = std::filesystem::path(options.asset).stem().string();
    write_text(options.output, tree_glb(asset.view(), inner ? Measure::inner : Measure::matched,
                                        options.detail, name));
  } else {
    write_text(options.output, format(exported_spheres(asset.view(), options.detail)));
  }
}

}  // namespace

void add_export(CLI::App& app) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* const command =
      app.add_subcommand("export", "Write an asset's spheres for other tools");
  add_input(command, "ASSET", options->asset, "An .ist file");
  add_output(command, options->output,
             "The .csv, .ply, .json or .glb file to write; - = CSV on standard output",
             Dash::standard_output);
  add_whole(command, "--detail", options->detail,
            "Level of detail; 0 = all spheres, i = the i-th coarser level");
  command->add_option("--measure", options->measure, "Spheres whose tree a .glb shows")
      ->check(CLI::IsMember({"matched", "inner"}))
      ->capture_default_str();
  command->footer(
      "One row per sphere, in greedy order, in the mesh's own unit and frame: x,y,z,r is the\n"
      "inner sphere (r rounded down), ex,ey,ez,er the matched sphere, c the cover radius about\n"
      "x,y,z (rounded up). A .glb is a scene for viewers: the tree's spheres and the balls of\n"
      "each level above them. Each level is a node with a material, to be shown or hidden.\n"
      "Example: ist export bolt.ist -o bolt.csv");
  command->callback([options] { run_export(*options); });
}

}  // namespace ist::app
