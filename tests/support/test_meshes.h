#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <ist/mesh.h>

// Small closed meshes made on the spot. All wind counter-clockwise seen from outside.

namespace ist::testing {

inline ClosedMesh closed(TriangleMesh mesh, std::string name) {
  ClosedMesh out;
  out.report.closed = true;
  out.report.triangles = mesh.triangles.size();
  out.report.vertices = mesh.vertices.size();
  for (const auto& v : mesh.vertices) out.report.bounds.extend(v);
  out.mesh = std::move(mesh);
  out.name = std::move(name);
  return out;
}

/// Box with corners `lower` and `upper`, 12 triangles.
inline TriangleMesh box_mesh(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) ? upper.x() : lower.x(), (i & 2) ? upper.y() : lower.y(),
                               (i & 4) ? upper.z() : lower.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// The cube [−½, ½]³.
inline TriangleMesh cube_mesh() {
  return box_mesh(Eigen::Vector3d::Constant(-0.5), Eigen::Vector3d::Constant(0.5));
}

/// Sphere of radius 1 about the origin, 20 · 4^subdivisions triangles, corners on the sphere.
inline TriangleMesh icosphere_mesh(int subdivisions) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  for (auto& v : mesh.vertices) v.normalize();
  mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                    {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                    {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                    {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b), mesh.vertices.size());
      if (fresh) {
        const Eigen::Vector3d sum = mesh.vertices[a] + mesh.vertices[b];
        mesh.vertices.push_back(sum.normalized());
      }
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& t : mesh.triangles) {
      const std::uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
      finer.push_back({t[0], ab, ca});
      finer.push_back({t[1], bc, ab});
      finer.push_back({t[2], ca, bc});
      finer.push_back({ab, bc, ca});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// Torus about z: `around` segments along the centre line, `across` around the tube.
inline TriangleMesh torus_mesh(double major, double minor, std::uint32_t around,
                               std::uint32_t across) {
  constexpr double kTurn = 6.283185307179586;
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < around; ++i) {
    const double a = kTurn * i / around;
    for (std::uint32_t j = 0; j < across; ++j) {
      const double b = kTurn * j / across;
      const double ring = major + minor * std::cos(b);
      mesh.vertices.emplace_back(ring * std::cos(a), ring * std::sin(a), minor * std::sin(b));
    }
  }
  for (std::uint32_t i = 0; i < around; ++i) {
    for (std::uint32_t j = 0; j < across; ++j) {
      const std::uint32_t i1 = (i + 1) % around, j1 = (j + 1) % across;
      const std::uint32_t p = i * across + j, q = i1 * across + j, r = i1 * across + j1,
                          s = i * across + j1;
      mesh.triangles.push_back({p, q, r});
      mesh.triangles.push_back({p, r, s});
    }
  }
  return mesh;
}

/// The triangles of both, side by side: shells may overlap.
/// A tube of needles along no axis, 2 long, between radii `inner` and 1.
inline TriangleMesh needle_tube(std::uint32_t sides, double inner) {
  TriangleMesh mesh;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(0.8, 0.3, -0.5, 0.1).normalized();
  for (const auto& [radius, z] : {std::pair{1.0, -1.0}, {1.0, 1.0}, {inner, 1.0}, {inner, -1.0}})
    for (std::uint32_t i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.push_back(
          turn * Eigen::Vector3d(radius * std::cos(angle), radius * std::sin(angle), z));
    }
  for (std::uint32_t ring = 0; ring < 4; ++ring)
    for (std::uint32_t i = 0; i < sides; ++i) {
      const std::uint32_t next = (i + 1) % sides, a = ring * sides, b = (ring + 1) % 4 * sides;
      mesh.triangles.push_back({a + i, a + next, b + i});
      mesh.triangles.push_back({a + next, b + next, b + i});
    }
  return mesh;
}

inline TriangleMesh joined(TriangleMesh a, const TriangleMesh& b) {
  const auto offset = static_cast<std::uint32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles)
    a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  return a;
}

/// Inside out: the same surface with the other orientation (a cavity, say).
inline TriangleMesh inverted(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Cubes [−½, ½]³ and [0, 1]³ as two shells: union 2 − 1/8, divergence theorem 2.
inline TriangleMesh overlapping_cubes_mesh() {
  return joined(cube_mesh(), box_mesh(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()));
}

}  // namespace ist::testing
