#include "meshes.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>

ist::TriangleMesh make_cells(const std::vector<double>& x, const std::vector<double>& y,
                             const std::vector<double>& z,
                             const std::function<bool(int, int, int)>& filled) {
  ist::TriangleMesh mesh;
  const std::array<int, 3> n = {static_cast<int>(x.size()) - 1, static_cast<int>(y.size()) - 1,
                                static_cast<int>(z.size()) - 1};
  const auto is_filled = [&](const std::array<int, 3>& c) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (c[k] < 0 || c[k] >= n[k]) return false;
    }
    return filled(c[0], c[1], c[2]);
  };
  std::map<std::array<int, 3>, std::uint32_t> corners;
  const auto corner = [&](const std::array<int, 3>& c) {
    const auto [it, fresh] =
        corners.try_emplace(c, static_cast<std::uint32_t>(mesh.vertices.size()));
    if (fresh) {
      mesh.vertices.emplace_back(x[static_cast<std::size_t>(c[0])],
                                 y[static_cast<std::size_t>(c[1])],
                                 z[static_cast<std::size_t>(c[2])]);
    }
    return it->second;
  };
  std::array<int, 3> c;
  for (c[0] = 0; c[0] < n[0]; ++c[0])
    for (c[1] = 0; c[1] < n[1]; ++c[1])
      for (c[2] = 0; c[2] < n[2]; ++c[2]) {
        if (!is_filled(c)) continue;
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (const int side : {0, 1}) {
            std::array<int, 3> beside = c;
            beside[axis] += side == 1 ? 1 : -1;
            if (is_filled(beside)) continue;
            const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
            std::array<std::uint32_t, 4> quad;
            for (std::size_t i = 0; i < 4; ++i) {
              std::array<int, 3> at = c;
              at[axis] += side;
              at[u] += i == 1 || i == 2;
              at[v] += i >= 2;
              quad[i] = corner(at);
            }
            if (side == 0) std::swap(quad[1], quad[3]);
            mesh.triangles.push_back({quad[0], quad[1], quad[2]});
            mesh.triangles.push_back({quad[0], quad[2], quad[3]});
          }
      }
  return mesh;
}

ist::TriangleMesh make_box(const Eigen::Vector3d& half_extents) {
  const auto ends = [&](int k) { return std::vector{-half_extents[k], half_extents[k]}; };
  return make_cells(ends(0), ends(1), ends(2), [](int, int, int) { return true; });
}

ist::TriangleMesh make_turned(const std::vector<std::pair<double, double>>& profile, int segments) {
  ist::TriangleMesh mesh;
  const bool closed = profile.front().first > 0;
  std::vector<std::vector<std::uint32_t>> rings;
  for (const auto& [radius, z] : profile) {
    std::vector<std::uint32_t>& ring = rings.emplace_back();
    for (int i = 0; i < segments; ++i) {
      if (radius > 0 || i == 0) {
        const double a = 2 * std::numbers::pi * i / segments;
        mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
      }
      ring.push_back(static_cast<std::uint32_t>(mesh.vertices.size() - 1));
    }
  }
  for (std::size_t r = 0; r + (closed ? 0 : 1) < rings.size(); ++r) {
    const std::vector<std::uint32_t>& low = rings[r];
    const std::vector<std::uint32_t>& high = rings[(r + 1) % rings.size()];
    for (std::size_t i = 0; i < low.size(); ++i) {
      const std::size_t j = (i + 1) % low.size();
      if (low[i] != low[j]) mesh.triangles.push_back({low[i], low[j], high[i]});
      if (high[i] != high[j]) mesh.triangles.push_back({low[j], high[j], high[i]});
    }
  }
  return mesh;
}

ist::TriangleMesh make_ball(double radius, int segments) {
  std::vector<std::pair<double, double>> profile;
  const int rows = segments / 2;
  for (int i = 0; i <= rows; ++i) {
    const double a = std::numbers::pi * (static_cast<double>(i) / rows - 0.5);
    profile.emplace_back(i == 0 || i == rows ? 0 : radius * std::cos(a), radius * std::sin(a));
  }
  return make_turned(profile, segments);
}
