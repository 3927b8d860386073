#include "bake/field/corner_planes.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mesh/triangle_frame.h"

namespace ist {
namespace {

/// How strongly the mean of a cluster's corners holds it where planes do not.
constexpr double kPull = 1e-3;

/// Solves the symmetric positive definite system a x = b.
void solve(const double a[3][3], const double b[3], double x[3]) {
  const double c00 = a[1][1] * a[2][2] - a[1][2] * a[1][2];
  const double c01 = a[0][2] * a[1][2] - a[0][1] * a[2][2];
  const double c02 = a[0][1] * a[1][2] - a[0][2] * a[1][1];
  const double c11 = a[0][0] * a[2][2] - a[0][2] * a[0][2];
  const double c12 = a[0][1] * a[0][2] - a[0][0] * a[1][2];
  const double c22 = a[0][0] * a[1][1] - a[0][1] * a[0][1];
  const double determinant = a[0][0] * c00 + a[0][1] * c01 + a[0][2] * c02;
  x[0] = (c00 * b[0] + c01 * b[1] + c02 * b[2]) / determinant;
  x[1] = (c01 * b[0] + c11 * b[1] + c12 * b[2]) / determinant;
  x[2] = (c02 * b[0] + c12 * b[1] + c22 * b[2]) / determinant;
}

}  // namespace

std::array<double, 3> placed(std::span<const CornerPlane> planes) {
  double weight = 0, mean[3] = {};
  for (const CornerPlane& plane : planes) {
    weight += plane.triangle.length;
    for (int k = 0; k < 3; ++k) mean[k] += plane.triangle.length * plane.x[k];
  }
  if (!(weight > 0)) return {planes[0].x[0], planes[0].x[1], planes[0].x[2]};
  for (double& m : mean) m /= weight;
  double a[3][3] = {}, b[3] = {};
  for (const auto& [triangle, x] : planes) {
    const auto& [n, length] = triangle;
    if (!(length > 0)) continue;
    const double off[3] = {x[0] - mean[0], x[1] - mean[1], x[2] - mean[2]};
    const double height = dot3(n, off) / length;
    for (int k = 0; k < 3; ++k) {
      b[k] += n[k] * height;
      for (int l = k; l < 3; ++l) a[k][l] += n[k] * (n[l] / length);
    }
  }
  for (int k = 0; k < 3; ++k) a[k][k] += kPull * weight;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < k; ++l) a[k][l] = a[l][k];
  double y[3];
  solve(a, b, y);
  return {mean[0] + y[0], mean[1] + y[1], mean[2] + y[2]};
}

double farthest_plane(std::span<const CornerPlane> planes, const std::array<double, 3>& p) {
  double most = 0;
  for (const auto& [triangle, x] : planes) {
    const auto& [n, length] = triangle;
    if (!(length > 0)) continue;
    const double off[3] = {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
    most = std::max(most, std::fabs(dot3(n, off)) / length);
  }
  return most;
}

// Weights that take four unit normals to zero take heights over the planes to a number that is the
// same everywhere.
double nearest_of_any(std::span<const CornerPlane> planes, double size) {
  constexpr double kLeast = 1e-7;     // of all weights: normals that tell nothing
  constexpr double kRounding = 1e-7;  // of the size, with room
  double most = 0;
  for (std::size_t i = 0; i + 3 < planes.size(); ++i) {
    double n[4][3], height[4], u[3];
    for (std::size_t j = 0; j < 4; ++j) {
      const CornerPlane& plane = planes[i + j];
      for (std::size_t k = 0; k < 3; ++k) {
        n[j][k] = plane.triangle.n[k] / plane.triangle.length;
        u[k] = plane.x[k] - planes[i].x[k];
      }
      height[j] = dot3(n[j], u);
    }
    double all = 0, sum = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      cross3(n[(j + 1) % 4], n[(j + 2) % 4], u);
      const double weight = (j % 2 == 0 ? 1 : -1) * dot3(u, n[(j + 3) % 4]);
      all += std::fabs(weight);
      sum += weight * height[j];
    }
    if (all > kLeast) most = std::max(most, std::fabs(sum) / all - kRounding * size);
  }
  return most;
}

}  // namespace ist
