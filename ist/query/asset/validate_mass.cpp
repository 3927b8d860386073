#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "query/asset/valid_values.h"

namespace ist {
namespace {

constexpr double kMassRounding = 1e-12;
/// Bound on the entries of an inertia: a mass of 1e18 within kMaxExtent.
constexpr double kMaxInertia = 1e21;

/// True if the principal second moments ∫ (y·e)² are not negative. Then neither are the principal
/// inertias, and none exceeds the sum of the other two.
bool sound_inertia(const AssetHeader& header) noexcept {
  const double* m = header.inertia;
  for (int k = 0; k < 6; ++k)
    if (!in_range(m[k], k < 3 ? 0 : -kMaxInertia, kMaxInertia)) return false;
  if (!in_range(header.inertia_error, 0, kMaxInertia)) return false;
  const double half_trace = (m[0] + m[1] + m[2]) / 2;
  Eigen::Matrix3d second;
  second << half_trace - m[0], -m[3], -m[4],  //
      -m[3], half_trace - m[1], -m[5],        //
      -m[4], -m[5], half_trace - m[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(second, Eigen::EigenvaluesOnly);
  return principal.eigenvalues()[0] >= -(kMassRounding * half_trace + 3 * header.inertia_error);
}

/// True if the box lies near the unit frame and contains the centres of ball and mass, and the
/// ball's radius lies between half the box's longest side and its diagonal.
bool sound_bounds(const AssetHeader& header) noexcept {
  const double unit = std::ldexp(1.0, header.exponent);
  const double margin = kMassRounding * unit;
  double half_side = 0, squares = 0;
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(header.box_lower[k]) || !std::isfinite(header.box_upper[k])) return false;
    const double low = (header.box_lower[k] - header.centre[k]) / unit;
    const double high = (header.box_upper[k] - header.centre[k]) / unit;
    if (!is_offset(low) || !is_offset(high)) return false;
    if (!in_range(header.ball_centre[k], header.box_lower[k], header.box_upper[k])) return false;
    const double slack = header.centre_of_mass_error + kMassRounding;
    if (!in_range(header.centre_of_mass[k], low - slack, high + slack)) return false;
    half_side = std::max(half_side, (high - low) / 2);
    squares += (high - low) * (high - low) / 4;
  }
  return in_range(header.ball_radius, unit * half_side * (1 - 1e-9) - margin,
                  2 * unit * std::sqrt(squares) + margin);
}

}  // namespace

bool sound_mass(const AssetHeader& header) noexcept {
  return in_range(header.centre_of_mass_error, 0, kMaxExtent) && sound_inertia(header) &&
         sound_bounds(header);
}

}  // namespace ist
