#include <ist/mass_properties.h>

#include <cmath>
#include <optional>

#include <ist/asset_layout.h>
#include "query/base/no_answer.h"
#include "query/base/relative_pose.h"

namespace ist {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The rotation of a pose; empty for an invalid pose or an empty asset.
std::optional<Matrix3d> rotation_of(const PlacedAsset& placed) noexcept {
  if (placed.asset.empty()) return std::nullopt;
  const std::optional<Eigen::Quaterniond> q = usable_rotation(placed.pose, placed.scale);
  return q ? std::optional(q->toRotationMatrix()) : std::nullopt;
}

}  // namespace

MassProperties mass_properties(const AssetView& tree) noexcept {
  const AssetHeader& h = tree.header();
  const double unit = std::ldexp(1.0, h.exponent);
  const auto turning = [&](double value) { return std::ldexp(value, 5 * h.exponent); };
  MassProperties result;
  result.volume = std::ldexp(h.volume, 3 * h.exponent);
  result.volume_error = std::ldexp(h.volume_error, 3 * h.exponent);
  result.centre_of_mass = vector(h.centre_of_mass) * unit + vector(h.centre);
  // Far from the origin doubles are coarser.
  result.centre_of_mass_error =
      h.centre_of_mass_error * unit + 0x1p-53 * result.centre_of_mass.cwiseAbs().maxCoeff();
  const double* m = h.inertia;
  result.inertia << turning(m[0]), turning(m[3]), turning(m[4]),  //
      turning(m[3]), turning(m[1]), turning(m[5]),                //
      turning(m[4]), turning(m[5]), turning(m[2]);
  result.inertia_error = turning(h.inertia_error);
  return result;
}

Bounds bounds(const AssetView& tree) noexcept {
  const AssetHeader& h = tree.header();
  return {vector(h.box_lower), vector(h.box_upper), vector(h.ball_centre), h.ball_radius};
}

MassProperties mass_properties(const PlacedAsset& placed) noexcept {
  const std::optional<Matrix3d> rotation = rotation_of(placed);
  if (!rotation)
    return {kNone, Vector3d::Constant(kNone), Matrix3d::Constant(kNone), kNone, kNone, kNone};
  const double s = placed.scale, cube = s * s * s;
  MassProperties result = mass_properties(placed.asset);
  result.volume *= cube;
  result.volume_error *= cube;
  result.centre_of_mass = *rotation * (s * result.centre_of_mass) + vector(placed.pose.t);
  // Rotation mixes the three components.
  result.centre_of_mass_error *= std::sqrt(3.0) * s;
  const Matrix3d turned = *rotation * result.inertia * rotation->transpose();
  result.inertia = s * s * cube * (turned + turned.transpose()) / 2;
  result.inertia_error *= 3 * s * s * cube;
  return result;
}

Bounds bounds(const PlacedAsset& placed) noexcept {
  const std::optional<Matrix3d> rotation = rotation_of(placed);
  const Vector3d none = Vector3d::Constant(kNone);
  if (!rotation) return {none, none, none, kNone};
  const Bounds own = bounds(placed.asset);
  const double s = placed.scale;
  const Vector3d origin = vector(placed.pose.t);
  const Vector3d middle = *rotation * (s * (own.lower + own.upper) / 2) + origin;
  const Vector3d half = rotation->cwiseAbs() * (s * (own.upper - own.lower) / 2);
  return {middle - half, middle + half, *rotation * (s * own.centre) + origin, s * own.radius};
}

}  // namespace ist
