#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include <ist/bake.h>
#include <ist/error.h>

#include <ist/asset_layout.h>
#include "app/commands.h"
#include "app/exported_spheres.h"
#include "app/interrupt.h"
#include "app/number_checks.h"
#include "asset/atomic_file.h"

namespace ist::app {
namespace {

struct ExportOptions {
  std::string asset;
  std::filesystem::path output;
  std::uint32_t detail = 0;
};

void run_export(const ExportOptions& options) {
  const Asset asset = Asset::load(options.asset);
  const std::uint32_t details = asset.view().header().detail_count;
  if (options.detail > details)
    throw Error(fmt::format("{}: it has {} coarser level(s) of detail, not {}", options.asset,
                            details, options.detail));
  const std::vector<ExportedSphere> spheres = exported_spheres(asset.view(), options.detail);
  const std::string extension = options.output.extension().string();
  const InterruptGuard guard;
  if (extension == ".csv") return write_atomically(options.output, spheres_csv(spheres));
  if (extension == ".ply") return write_atomically(options.output, spheres_ply(spheres));
  if (extension == ".json") return write_atomically(options.output, spheres_json(spheres));
  throw Error(options.output.string() + ": nothing is exported as '" + extension +
              "'; use .csv, .ply or .json");
}

}  // namespace

void add_export(CLI::App& app) {
  const auto options = std::make_shared<ExportOptions>();
  CLI::App* const command =
      app.add_subcommand("export", "Write an asset's spheres for other tools");
  command->add_option("ASSET", options->asset, "An .ist file")->required();
  command->add_option("-o,--output", options->output, "The .csv, .ply or .json file to write")
      ->required();
  command
      ->add_option("--detail", options->detail,
                   "0: all spheres; i: the i-th coarser level of detail")
      ->check(is_count)
      ->capture_default_str();
  command->footer(
      "A row a sphere, in greedy order, in the mesh's own unit and frame: x,y,z,r the inner "
      "sphere\n"
      "(r rounded down: it stays inside), ex,ey,ez,er the matched sphere, c the cover radius "
      "about\n"
      "x,y,z (rounded up).\n"
      "Example: ist export bolt.ist -o bolt.csv");
  command->callback([options] { run_export(*options); });
}

}  // namespace ist::app
