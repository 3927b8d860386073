#include "app/tree_glb.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include <ist/asset_layout.h>
#include <ist/error.h>

#include "app/glb_scene.h"

namespace ist::app {
namespace {

/// Colours of the spheres, their groups, the groups' groups …; all but the spheres let light
/// through.
std::array<double, 4> colour_of(std::size_t level) {
  constexpr std::array<std::array<double, 3>, 5> kColours = {{{0.90, 0.62, 0.28},
                                                              {0.25, 0.55, 0.85},
                                                              {0.35, 0.70, 0.40},
                                                              {0.75, 0.40, 0.65},
                                                              {0.55, 0.55, 0.60}}};
  const auto& c = kColours[level % kColours.size()];
  return {c[0], c[1], c[2], level == 0 ? 1.0 : 0.2};
}

}  // namespace

std::string tree_glb(const TreeView& view, Measure measure, std::uint32_t detail,
                     const std::string& name) {
  const AssetHeader& header = view.header();
  const TreeHeader& tree =
      measure == Measure::inner ? header.inner_tree : matched_tree(header, detail);
  const double scale = std::ldexp(1.0, header.exponent);
  constexpr int kMostExponent = 100;  // of what floats can hold, and viewers square
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

}  // namespace ist::app
