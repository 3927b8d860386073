#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <Eigen/Core>

#include <ist/mesh.h>

namespace ist::testing {

/// The solid that a closed outline (distance from z, height) sweeps around z, in flat segments. The
/// outline runs counter-clockwise, or what it encloses lies outside.
inline TriangleMesh turned_solid(const std::vector<Eigen::Vector2d>& outline,
                                 std::uint32_t segments) {
  TriangleMesh mesh;
  const auto n = static_cast<std::uint32_t>(outline.size());
  for (std::uint32_t i = 0; i < segments; ++i) {
    const double a = 2 * std::numbers::pi * i / segments;
    for (const Eigen::Vector2d& p : outline)
      mesh.vertices.emplace_back(p.x() * std::cos(a), p.x() * std::sin(a), p.y());
    const std::uint32_t here = i * n, next = (i + 1) % segments * n;
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t l = (k + 1) % n;
      mesh.triangles.push_back({here + k, next + k, next + l});
      mesh.triangles.push_back({here + k, next + l, here + l});
    }
  }
  return mesh;
}

}  // namespace ist::testing
