#pragma once

#include <ist/mesh.h>
#include <cmath>
#include <numbers>

namespace ist {

/// A closed ring of vertices, counter-clockwise seen from +z (or along the direction of the sweep).
using Ring = std::vector<std::uint32_t>;

/// Puts meshes together from rings. Coordinates are rounded to multiples of 2^-30, so that a sample
/// does not depend on the last bit of this machine's sin and cos.
class MeshBuilder {
 public:
  std::uint32_t vertex(double x, double y, double z) {
    mesh_.vertices.emplace_back(snap(x), snap(y), snap(z));
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.triangles.push_back({a, b, c});
  }

  /// Ring of `n` vertices about the z axis; `radius(i)` gives the radius of the i-th.
  template <class Radius>
  Ring ring(std::size_t n, double z, Radius radius) {
    Ring result(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
      result[i] = vertex(radius(i) * std::cos(angle), radius(i) * std::sin(angle), z);
    }
    return result;
  }

  /// Wall between two rings of equal length, outward where `upper` follows `lower` along +z.
  void wall(const Ring& lower, const Ring& upper) {
    for (std::size_t i = 0, n = lower.size(); i < n; ++i) {
      const std::size_t j = (i + 1) % n;
      triangle(lower[i], lower[j], upper[j]);
      triangle(lower[i], upper[j], upper[i]);
    }
  }

  /// Cap from a ring to its apex, facing +z.
  void cap_up(const Ring& ring, std::uint32_t apex) {
    for (std::size_t i = 0, n = ring.size(); i < n; ++i) triangle(apex, ring[i], ring[(i + 1) % n]);
  }

  /// Cap from a ring to its apex, facing −z.
  void cap_down(const Ring& ring, std::uint32_t apex) {
    for (std::size_t i = 0, n = ring.size(); i < n; ++i) triangle(apex, ring[(i + 1) % n], ring[i]);
  }

  const Eigen::Vector3d& operator[](std::uint32_t v) const { return mesh_.vertices[v]; }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  static double snap(double x) { return std::nearbyint(x * 0x1p30) * 0x1p-30; }

  TriangleMesh mesh_;
};

}  // namespace ist
