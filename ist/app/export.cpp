#include <fmt/format.h>
#include <ist/asset.h>
#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <ist/query.h>
#include <cmath>
#include <filesystem>

#include "app/commands.h"
#include "app/glb_scene.h"
#include "app/interrupt.h"
#include "app/options.h"
#include "library/exported_spheres.h"

namespace ist::app {
namespace {

/// Colours of the spheres, their groups, the groups' groups …; all but the spheres are transparent.
std::array<double, 4> colour_of(std::size_t level) {
  constexpr std::array<std::array<double, 3>, 5> kColours = {{{0.90, 0.62, 0.28},
                                                              {0.25, 0.55, 0.85},
                                                              {0.35, 0.70, 0.40},
                                                              {0.75, 0.40, 0.65},
                                                              {0.55, 0.55, 0.60}}};
  const auto& c = kColours[level % kColours.size()];
  return {c[0], c[1], c[2], level == 0 ? 1.0 : 0.2};
}

/// A tree as a binary glTF 2.0 scene: one ball's mesh per level, with its own material, and one
/// node per sphere or node of the tree that instances it. In the mesh's own unit and frame, with
/// float coordinates about the asset's middle, which the root node places.
///
/// `detail` in [0, header().detail_count], 0 for Measure::inner. The file's bytes.
std::string tree_glb(const AssetView& view, Measure measure, std::uint32_t detail,
                     const std::string& name) {
  const AssetHeader& header = view.header();
  const TreeHeader& tree =
      measure == Measure::inner ? header.inner_tree : matched_tree(header, detail);
  const double scale = std::ldexp(1.0, header.exponent);
  constexpr int kMostExponent = 100;  // viewers square floats
  if (std::abs(header.exponent) > kMostExponent)
    throw Error(name + ": its size of about 2^" + std::to_string(header.exponent) +
                " u is out of range for a .glb (2^-100 to 2^100); export .csv, .ply or .json");
  GlbScene scene(GlbScene::Json{
      {"name", name}, {"translation", {header.centre[0], header.centre[1], header.centre[2]}}});
  for (std::uint32_t level = 0; level < tree.level_count; ++level) {
    const std::string level_name = level == 0 ? "spheres" : fmt::format("level {}", level);
    const std::size_t group = scene.add_node(0, {{"name", level_name}});
    const std::size_t ball = scene.add_ball(level_name, colour_of(level));
    const BallBlock* const blocks = at<BallBlock>(header, tree.level[level].blocks);
    const Origin* const origins = at<Origin>(header, tree.level[level].origins);
    for (std::uint32_t b = 0; b < tree.level[level].count; ++b)
      for (std::uint32_t lane = 0; lane < kWidth; ++lane) {
        const double r = static_cast<double>(blocks[b].r[lane]) * scale;
        if (!(r > 0)) continue;
        const Eigen::Vector3d x(origins[b].x + static_cast<double>(blocks[b].x[lane]),
                                origins[b].y + static_cast<double>(blocks[b].y[lane]),
                                origins[b].z + static_cast<double>(blocks[b].z[lane]));
        scene.add_instance(group, ball, x * scale, r);
      }
  }
  return scene.bytes();
}

struct ExportOptions {
  std::string asset, output, measure = "matched";
  std::uint32_t detail = 0;
};

using Format = std::string (*)(std::span<const ExportedSphere>);

/// The format by the file's extension; CSV for standard output, which cannot be a scene. Throws
/// Error.
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
    throw Error(options.asset + ": has no spheres; bake it again without --mesh-only");
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
