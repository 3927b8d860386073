#include "library/coarseness.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ist/asset_layout.h>
#include "library/text.h"

namespace ist::app {
namespace {

constexpr double kCoarse = 0.4;  // covered by inner spheres: less says that walls are thinner
constexpr double kEnough = 0.5;
/// Spheres needed from where an asset stops, in those of its last size: measured on a plate with
/// holes (tray_perforated.stl) of 100 to 8,000 spheres.
constexpr double kRoom = 1.9;

/// With two digits, upwards.
std::uint64_t round_count(double count) {
  const double unit = std::pow(10.0, std::max(0.0, std::floor(std::log10(count)) - 1));
  return static_cast<std::uint64_t>(std::ceil(count / unit) * unit);
}

}  // namespace

std::optional<std::uint64_t> enough_spheres(const TreeView& tree) {
  const AssetHeader& h = tree.header();
  if (!(h.coverage < kCoarse) || !(h.volume > 0)) return std::nullopt;
  // The last quarter: what one of its spheres covers of the solid.
  const Sphere* const spheres = at<Sphere>(h, h.inner_spheres);
  const std::uint64_t from = h.sphere_count - (h.sphere_count + 3) / 4;
  double covered = 0;
  for (std::uint64_t i = from; i < h.sphere_count; ++i) {
    const double r = spheres[i].r;
    covered += 4 * std::numbers::pi / 3 * r * r * r / h.volume;
  }
  const double each = covered / static_cast<double>(h.sphere_count - from);
  if (!(each > 0)) return std::nullopt;
  const double count = static_cast<double>(h.sphere_count) + kRoom * (kEnough - h.coverage) / each;
  if (!(count <= static_cast<double>(kMaxSpheres))) return std::nullopt;
  return round_count(count);
}

std::string describe_coarseness(const TreeView& tree) {
  const std::optional<std::uint64_t> enough = enough_spheres(tree);
  if (!enough) return "";
  return fmt::format(
      "the spheres are too coarse for thin parts: they fill {:.2g} % of the solid; about {} "
      "spheres are enough",
      100 * tree.header().coverage, grouped(*enough));
}

}  // namespace ist::app
