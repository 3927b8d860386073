#include "library/exported_spheres.h"

#include <fmt/format.h>
#include <ist/asset_layout.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

namespace ist {
namespace {

constexpr std::array kColumns = {"x", "y", "z", "r", "ex", "ey", "ez", "er", "c"};
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Moved {
  Eigen::Vector3d centre;
  double error;  ///< [u] bound on the distance of the exact centre from `centre`
};

/// x · scale + origin. The product is exact (a power of two); Knuth's two-sum gives the exact
/// rounding error of the sum.
Moved to_mesh_frame(const Sphere& s, const double origin[3], double scale) {
  const double unit[3] = {s.x, s.y, s.z};
  Moved moved{Eigen::Vector3d::Zero(), 0};
  for (int k = 0; k < 3; ++k) {
    const double a = unit[k] * scale, b = origin[k], sum = a + b;
    const double b_part = sum - a, a_part = sum - b_part;
    moved.centre[k] = sum;
    moved.error += std::abs((a - a_part) + (b - b_part));
  }
  moved.error *= 1 + 1e-12;
  return moved;
}

std::array<double, kColumns.size()> row(const ExportedSphere& s) {
  return {s.centre.x(),         s.centre.y(),         s.centre.z(),         s.radius,
          s.matched_centre.x(), s.matched_centre.y(), s.matched_centre.z(), s.matched_radius,
          s.cover_radius};
}

void append_row(std::string& out, const ExportedSphere& sphere, char separator) {
  bool first = true;
  for (const double value : row(sphere)) {
    if (!first) out += separator;
    first = false;
    fmt::format_to(std::back_inserter(out), "{:.17g}", value);
  }
}

std::string joined_columns(const char* before, const char* between, const char* after) {
  std::string out;
  for (const char* column : kColumns)
    out += (out.empty() ? "" : between) + std::string(before) + column + after;
  return out;
}

}  // namespace

std::vector<ExportedSphere> exported_spheres(const AssetView& tree, std::uint32_t detail) {
  const AssetHeader& header = tree.header();
  const double scale = std::ldexp(1.0, header.exponent);
  const Sphere* const inner = at<Sphere>(header, header.inner_spheres);
  const Sphere* const matched = matched_spheres(header, detail);
  const float* const cover = at<float>(header, header.cover_radii);
  std::vector<ExportedSphere> result(matched_tree(header, detail).sphere_count);
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Moved moved = to_mesh_frame(inner[i], header.centre, scale);
    const double radius = inner[i].r * scale, cover_radius = cover[i] * scale;
    ExportedSphere& s = result[i];
    s.centre = moved.centre;
    // If the sum was exact, so are the radii; otherwise they compensate for the moved centre.
    s.radius =
        moved.error == 0 ? radius : std::max(0.0, std::nextafter(radius - moved.error, -kInfinity));
    s.cover_radius =
        moved.error == 0 ? cover_radius : std::nextafter(cover_radius + moved.error, kInfinity);
    s.matched_centre = to_mesh_frame(matched[i], header.centre, scale).centre;
    s.matched_radius = matched[i].r * scale;
  }
  return result;
}

std::string spheres_csv(std::span<const ExportedSphere> spheres) {
  std::string out = joined_columns("", ",", "") + "\n";
  for (const ExportedSphere& sphere : spheres) {
    append_row(out, sphere, ',');
    out += '\n';
  }
  return out;
}

std::string spheres_ply(std::span<const ExportedSphere> spheres) {
  std::string out = fmt::format("ply\nformat ascii 1.0\nelement vertex {}\n{}end_header\n",
                                spheres.size(), joined_columns("property double ", "", "\n"));
  for (const ExportedSphere& sphere : spheres) {
    append_row(out, sphere, ' ');
    out += '\n';
  }
  return out;
}

std::string spheres_json(std::span<const ExportedSphere> spheres) {
  std::string out =
      fmt::format("{{\"columns\": [{}],\n \"spheres\": [", joined_columns("\"", ", ", "\""));
  const char* separator = "\n  [";
  for (const ExportedSphere& sphere : spheres) {
    out += separator;
    append_row(out, sphere, ',');
    out += ']';
    separator = ",\n  [";
  }
  return out + "\n ]}\n";
}

}  // namespace ist
