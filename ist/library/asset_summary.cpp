#include "library/asset_summary.h"

#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <ist/mass_properties.h>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "bake/predict/trial_poses.h"
#include "library/settings/spelling.h"
#include "library/text.h"

namespace ist {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kCoarse = 0.4;  // coverage by inner spheres; less means that walls are thinner
constexpr double kEnough = 0.5;
/// Additional spheres needed, relative to their last size: measured on a plate with holes
/// (tray_perforated.stl) with 100 to 8,000 spheres.
constexpr double kExtraSpheres = 1.9;

/// Rounds up to two digits.
std::uint64_t round_count(double count) {
  const double unit = std::pow(10.0, std::max(0.0, std::floor(std::log10(count)) - 1));
  return static_cast<std::uint64_t>(std::ceil(count / unit) * unit);
}

/// True if the mode knows the largest sphere that would fit; the header of others contains 1.
bool keeps_bound(GridMode mode) { return mode == GridMode::banded; }

/// Keys of JSON for kOverlapClassNames, in ASCII.
constexpr std::array<const char*, kOverlapClasses> kOverlapClassKeys = {
    "contained", "10-50%", "1-10%", "0.1-1%", "0.01-0.1%"};

std::string hex(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

Json tree_json(const TreeHeader& tree, double scale) {
  return {{"spheres", tree.sphere_count},
          {"levels", tree.level_count},
          {"volume_sum", tree.volume_sum * scale * scale * scale},
          {"root_radius", tree.root[3] * scale},
          {"mean_radius", tree.mean_radius * scale},
          {"overlap", tree.overlap}};
}

/// Empty without a prediction.
Json predicted_json(const AssetHeader& h) {
  Json result = Json::object();
  if (h.predicted_poses == 0) return result;
  result["poses"] = h.predicted_poses;
  for (std::uint32_t k = 0; k < kOverlapClasses; ++k)
    result["error"][kOverlapClassKeys[k]] = h.predicted_error[k];
  return result;
}

/// The requested error and the result; empty if no error was requested.
Json target_json(const AssetView& tree) {
  Json result = Json::object();
  const PredictedErrors errors = tree.predicted_errors();
  if (errors.target_error == 0) return result;
  result["target_error"] = errors.target_error;
  result["target_overlap"] = errors.target_overlap;
  result["target_met"] = errors.target_met();
  result["measured_error"] =
      errors.measured_poses > 0 ? Json(errors.measured_error) : Json(nullptr);
  result["measured_poses"] = errors.measured_poses;
  result["search_stop"] = name_of(static_cast<StopReason>(tree.header().search_stop));
  result["worst_partner"] =
      errors.measured_poses > 0 ? Json(name_of(errors.worst_partner)) : Json(nullptr);
  return result;
}

const char* why_missed(StopReason stop) {
  constexpr const char* kCount = "no more spheres are allowed";
  return word_of(stop, {kCount, "the requested coverage ended the packing",
                        "the requested smallest radius ended the packing",
                        "the time limit ended the search", kCount, "no more spheres fit"});
}

/// The mesh is the last section of the file.
std::uint64_t mesh_bytes(const AssetHeader& h) { return h.mesh == 0 ? 0 : h.file_bytes - h.mesh; }

Json mesh_json(const AssetView& tree) {
  return {{"state", name_of(tree.mesh_state())},
          {"triangles", tree.mesh_triangles()},
          {"bytes", mesh_bytes(tree.header())},
          {"error", tree.has_mesh() ? Json(tree.mesh_error()) : Json(nullptr)},
          {"self_overlap_volume", tree.self_overlap_volume()}};
}

std::string describe_mesh(const AssetView& tree) {
  if (!tree.has_mesh())
    return tree.mesh_state() == MeshState::unresolved ? "none: parts of the mesh overlap" : "none";
  const char* const whose = tree.mesh_state() == MeshState::own ? "all of the mesh"
                            : tree.mesh_state() == MeshState::resolved
                                ? "of the union of the mesh's parts"
                                : "made from a signed distance";
  return fmt::format("{} triangles, {}, within {:.4g} u of the solid's surface, {} bytes",
                     grouped(tree.mesh_triangles()), whose, tree.mesh_error(),
                     grouped(mesh_bytes(tree.header())));
}

Json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json mass_json(const AssetView& tree) {
  const MassProperties mass = mass_properties(tree);
  const Eigen::Matrix3d& m = mass.inertia;
  return {{"volume", mass.volume},
          {"volume_error", mass.volume_error},
          {"centre_of_mass", json_of(mass.centre_of_mass)},
          {"centre_of_mass_error", mass.centre_of_mass_error},
          {"inertia", {m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2)}},
          {"inertia_error", mass.inertia_error}};
}

Json bounds_json(const AssetView& tree) {
  const Bounds held = bounds(tree);
  return {{"lower", json_of(held.lower)},
          {"upper", json_of(held.upper)},
          {"ball_centre", json_of(held.centre)},
          {"ball_radius", held.radius}};
}

std::string text_of(const Eigen::Vector3d& v) {
  return fmt::format("({:.9g}, {:.9g}, {:.9g})", v.x(), v.y(), v.z());
}

Json details_json(const AssetHeader& h, double scale) {
  Json list = Json::array();
  for (std::uint32_t i = 1; i <= h.detail_count; ++i) {
    const DetailLevel& detail = at<DetailLevel>(h, h.details)[i - 1];
    list.push_back({{"protrusion", detail.protrusion * scale},
                    {"matched_tree", tree_json(detail.matched_tree, scale)}});
  }
  return list;
}

}  // namespace

std::optional<std::uint64_t> enough_spheres(const AssetView& tree) {
  const AssetHeader& h = tree.header();
  if (!(h.coverage < kCoarse) || !(h.volume > 0)) return std::nullopt;
  // The last quarter: the volume of the solid that one of its spheres covers.
  const Sphere* const spheres = at<Sphere>(h, h.inner_spheres);
  const std::uint64_t from = h.sphere_count - (h.sphere_count + 3) / 4;
  double covered = 0;
  for (std::uint64_t i = from; i < h.sphere_count; ++i) {
    const double r = spheres[i].r;
    covered += 4 * std::numbers::pi / 3 * r * r * r / h.volume;
  }
  const double each = covered / static_cast<double>(h.sphere_count - from);
  if (!(each > 0)) return std::nullopt;
  const double count =
      static_cast<double>(h.sphere_count) + kExtraSpheres * (kEnough - h.coverage) / each;
  if (!(count <= static_cast<double>(kMaxSpheres))) return std::nullopt;
  return round_count(count);
}

std::string describe_coarseness(const AssetView& tree) {
  if (tree.header().sphere_count == 0 || !(tree.header().coverage < kCoarse)) return "";
  const std::string coarse =
      fmt::format("the spheres are too coarse for thin parts: they fill {:.2g} % of the solid; ",
                  100 * tree.header().coverage);
  if (const auto enough = enough_spheres(tree))
    return coarse + fmt::format("about {} spheres are enough", grouped(*enough));
  return coarse + "no number of spheres is enough. Bake the mesh alone (--mesh-only)";
}

std::string describe_asset(const AssetView& tree) {
  const AssetHeader& h = tree.header();
  const double scale = std::ldexp(1.0, h.exponent);
  std::string text;
  const auto line = [&](const char* name, const std::string& value) {
    text += fmt::format("  {:<12} {}\n", name, value);
  };
  const bool alone = h.sphere_count == 0;
  line("spheres",
       alone ? "none: a mesh alone, for exact queries only"
             : fmt::format("{}, {:.3f} % of the volume (stopped by: {})", grouped(h.sphere_count),
                           100 * h.coverage, name_of(static_cast<StopReason>(h.stop_reason))));
  if (const std::string coarse = describe_coarseness(tree); !coarse.empty())
    line("warning", coarse);
  if (const std::string twice = describe_counted_twice(tree); !twice.empty())
    line("warning", twice);
  const auto grid = static_cast<GridMode>(h.asked_grid);
  if (!alone)
    line("greedy",
         keeps_bound(grid)
             ? fmt::format("radius at least {:.3f} of the largest that fits, median {:.3f}",
                           h.kept_ratio_worst, h.kept_ratio_median)
             : fmt::format("no bound: grid {} does not track the largest radius that fits",
                           name_of(grid)));
  const MassProperties mass = mass_properties(tree);
  line("volume", fmt::format("{:.9g} ± {:.1g} u³", mass.volume, mass.volume_error));
  line("mass centre",
       fmt::format("{} ± {:.1g} u", text_of(mass.centre_of_mass), mass.centre_of_mass_error));
  const Eigen::Matrix3d& m = mass.inertia;
  line("inertia",
       fmt::format("xx {:.9g}, yy {:.9g}, zz {:.9g}, xy {:.9g}, xz {:.9g}, yz {:.9g} ± {:.1g} u⁵ "
                   "about the mass centre, density 1",
                   m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2), mass.inertia_error));
  const Bounds held = bounds(tree);
  line("box", fmt::format("{} to {} u", text_of(held.lower), text_of(held.upper)));
  line("ball", fmt::format("radius {:.9g} u about {} u", held.radius, text_of(held.centre)));
  line("frame", fmt::format("centre ({:.9g}, {:.9g}, {:.9g}) u, scale 2^{}", h.centre[0],
                            h.centre[1], h.centre[2], h.exponent));
  if (!alone)
    line("protrusion",
         fmt::format("{:.4g} u: bound on how far matched spheres stick out of the solid",
                     h.protrusion * scale));
  for (std::uint32_t i = 1; i <= h.detail_count; ++i) {
    const DetailLevel& detail = at<DetailLevel>(h, h.details)[i - 1];
    line("detail",
         fmt::format("{} spheres, protrusion {:.4g} u", grouped(detail.matched_tree.sphere_count),
                     detail.protrusion * scale));
  }
  line("mesh", describe_mesh(tree));
  if (!alone)
    line(
        "requested",
        fmt::format("{} spheres, coverage {:g}, min radius {:g} u, epsilon {:g}, grid {}, "
                    "seed {}",
                    h.asked_spheres == 0 ? "unlimited" : grouped(h.asked_spheres), h.asked_coverage,
                    h.asked_min_radius, h.asked_epsilon, name_of(grid), h.asked_seed));
  if (h.predicted_poses > 0) {
    std::string errors;
    for (std::uint32_t k = 0; k < kOverlapClasses; ++k)
      errors += fmt::format("{}{}: {:.2g} %", k == 0 ? "" : ", ", kOverlapClassNames[k],
                            100 * h.predicted_error[k]);
    line("error",
         fmt::format("median by overlap of two copies, {} poses: {}", h.predicted_poses, errors));
  }
  if (const std::string target = describe_target(tree); !target.empty())
    text += "  " + target + "\n";
  if ((h.flags & kFlagRepaired) != 0) line("note", "the mesh was open and was repaired");
  if ((h.flags & kFlagWrapped) != 0) line("note", "the mesh was not closed and was wrapped");
  if ((h.flags & kFlagPolygonised) != 0)
    line("solid", fmt::format("given by its signed distance; calibrated with a mesh within {:.4g} "
                              "u of it, from {} cells along the longest side",
                              h.polygonise_error * scale, h.polygonise_cells));
  if ((h.flags & kFlagBelowNoise) != 0)
    line("note",
         "the smallest spheres are below float precision: certified, but not in greedy order");
  line("file", fmt::format("{} bytes, format {}.{}, content {}, mesh {}", grouped(h.file_bytes),
                           h.format_major, h.format_minor, hex(h.content_hash), hex(h.mesh_hash)));
  return text;
}

Json asset_json(const AssetView& tree) {
  const AssetHeader& h = tree.header();
  const double scale = std::ldexp(1.0, h.exponent);
  const auto grid = static_cast<GridMode>(h.asked_grid);
  const auto kept = [&](double ratio) { return keeps_bound(grid) ? Json(ratio) : Json(); };
  const std::optional<std::uint64_t> enough = enough_spheres(tree);
  Json json = {
      {"format", fmt::format("{}.{}", h.format_major, h.format_minor)},
      {"bytes", h.file_bytes},
      {"content_hash", hex(h.content_hash)},
      {"mesh_hash", hex(h.mesh_hash)},
      {"spheres", h.sphere_count},
      {"coverage", h.coverage},
      {"enough_spheres", enough                                        ? Json(*enough)
                         : h.sphere_count > 0 && h.coverage >= kCoarse ? Json(h.sphere_count)
                                                                       : Json()},
      {"kept_ratio_worst", kept(h.kept_ratio_worst)},
      {"kept_ratio_median", kept(h.kept_ratio_median)},
      {"stop", name_of(static_cast<StopReason>(h.stop_reason))},
      {"bounds", bounds_json(tree)},
      {"protrusion", h.protrusion * scale},
      {"frame", {{"centre", h.centre}, {"exponent", h.exponent}}},
      {"repaired", (h.flags & kFlagRepaired) != 0},
      {"wrapped", (h.flags & kFlagWrapped) != 0},
      {"below_float_noise", (h.flags & kFlagBelowNoise) != 0},
      {"asked",
       {{"spheres", h.asked_spheres},
        {"coverage", h.asked_coverage},
        {"min_radius", h.asked_min_radius},
        {"epsilon", h.asked_epsilon},
        {"grid", name_of(grid)},
        {"grid_start", h.asked_grid_start},
        {"grid_resolution", h.asked_grid_resolution},
        {"grid_refinements", h.asked_grid_refinements},
        {"grid_rounds", h.asked_grid_rounds},
        {"seed", h.asked_seed},
        {"error", h.asked_error},
        {"at_overlap", h.asked_at_overlap}}},
      {"predicted", predicted_json(h)},
      {"inner_tree", tree_json(h.inner_tree, scale)},
      {"matched_tree", tree_json(h.matched_tree, scale)},
      {"details", details_json(h, scale)},
      {"kept_mesh", mesh_json(tree)},
  };
  json.update(mass_json(tree));
  json.update(target_json(tree));
  return json;
}

std::string describe_counted_twice(const AssetView& tree) {
  const bool resolved = tree.mesh_state() == MeshState::resolved;
  if (!resolved && tree.mesh_state() != MeshState::unresolved) return "";
  if (tree.self_overlap_volume() == 0)
    return "parts of the mesh touch: the asset represents their union, without the walls between "
           "them";
  return fmt::format(
      "parts of the mesh overlap and count {:.3g} u³, {:.2g} % of the volume, more than once: {}",
      tree.self_overlap_volume(), 100 * tree.self_overlap_volume() / tree.volume(),
      resolved ? "the asset represents their union"
               : "the mesh is not kept, and exact queries are not possible");
}

std::string describe_target(const AssetView& tree) {
  const PredictedErrors errors = tree.predicted_errors();
  if (errors.target_error == 0) return "";
  const std::string asked = fmt::format("target {:.4g} % at {:.4g} % overlap",
                                        100 * errors.target_error, 100 * errors.target_overlap);
  const std::string measured =
      errors.measured_poses == 0
          ? "not measured"
          : fmt::format("{:.3g} % measured against the worst partner, {}, with {} poses in all",
                        100 * errors.measured_error, name_of(errors.worst_partner),
                        errors.measured_poses);
  if (errors.target_met()) return fmt::format("{}: met, {}", asked, measured);
  return fmt::format("{}: missed, {}; {}", asked, measured,
                     why_missed(static_cast<StopReason>(tree.header().search_stop)));
}

}  // namespace ist
