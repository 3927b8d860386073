#pragma once

#include <algorithm>
#include <random>

#include <ist/mesh.h>

#include "support/test_meshes.h"

// Random closed meshes whose corners have small integer coordinates: in these a pose by integers
// rounds nothing.

namespace ist::testing {

class IntegerMeshes {
 public:
  explicit IntegerMeshes(std::uint64_t seed) : random_(seed) {}

  int whole(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  static constexpr int kKinds = 9;

  /// One of kKinds kinds, within about 12 of the origin; sheared or not.
  TriangleMesh make(int kind) {
    TriangleMesh mesh = plain(kind);
    if (whole(0, 2) == 0) shear(mesh);
    return mesh;
  }

 private:
  using Point = Eigen::Vector3d;

  Point point(int from, int to) {
    const int x = whole(from, to), y = whole(from, to), z = whole(from, to);
    return Point(x, y, z);
  }

  TriangleMesh plain(int kind) {
    switch (kind) {
      case 0:
        return tetrahedron(-5, 5);
      case 1:
        return box(-5, 5);
      case 2:
        return prism({{0, 0}, {whole(1, 6), whole(-2, 2)}, {whole(-2, 2), whole(3, 6)}},
                     {{0, 1, 2}});
      case 3: {  // an L, fanned from the corner inside
        const int c = whole(1, 3), b = whole(1, 3), a = c + whole(1, 4), d = b + whole(1, 4);
        return prism({{0, 0}, {a, 0}, {a, b}, {c, b}, {c, d}, {0, d}},
                     {{3, 4, 5}, {3, 5, 0}, {3, 0, 1}, {3, 1, 2}});
      }
      case 4:
        return star(false);
      case 5:
        return star(true);
      case 6: {  // two components, which may touch
        const TriangleMesh first = box(-6, 0), second = whole(0, 1) ? box(0, 6) : tetrahedron(0, 6);
        return joined(first, second);
      }
      case 7:
        return cavity();
      default: {  // a shell within a cavity within a shell
        const Point low = point(-1, 0), high = low + point(1, 2);
        return joined(cavity(), box_mesh(low, high));
      }
    }
  }

  TriangleMesh tetrahedron(int from, int to) {
    TriangleMesh mesh;
    for (double volume = 0; volume == 0;) {
      mesh.vertices = {point(from, to), point(from, to), point(from, to), point(from, to)};
      const Point& o = mesh.vertices[0];
      volume = (mesh.vertices[1] - o).cross(mesh.vertices[2] - o).dot(mesh.vertices[3] - o);
      if (volume < 0) std::swap(mesh.vertices[2], mesh.vertices[3]);
    }
    mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    return mesh;
  }

  TriangleMesh box(int from, int to) {
    const Point low = point(from, to - 1);
    Point high;
    for (int k = 0; k < 3; ++k) high[k] = whole(static_cast<int>(low[k]) + 1, to);
    return box_mesh(low, high);
  }

  /// `outline`: counter-clockwise; `inside`: its triangles.
  TriangleMesh prism(const std::vector<std::array<int, 2>>& outline,
                     const std::vector<std::array<std::uint32_t, 3>>& inside) {
    TriangleMesh mesh;
    const Point at = point(-4, 0);
    const int height = whole(1, 6);
    for (const int z : {0, height})
      for (const auto& [x, y] : outline) mesh.vertices.emplace_back(at + Point(x, y, z));
    const auto n = static_cast<std::uint32_t>(outline.size());
    for (const auto& t : inside) {
      mesh.triangles.push_back({t[0], t[2], t[1]});
      mesh.triangles.push_back({n + t[0], n + t[1], n + t[2]});
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t j = (i + 1) % n;
      mesh.triangles.push_back({i, j, n + j});
      mesh.triangles.push_back({i, n + j, n + i});
    }
    return mesh;
  }

  /// Rays from the origin in the directions of an octahedron's corners, or of those of a cube cut
  /// in eight, each of its own length.
  TriangleMesh star(bool fine) {
    TriangleMesh mesh;
    if (!fine) {
      for (const Point& direction : {Point(1, 0, 0), Point(0, 1, 0), Point(0, 0, 1),
                                     Point(-1, 0, 0), Point(0, -1, 0), Point(0, 0, -1)})
        mesh.vertices.push_back(whole(1, 6) * direction);
      mesh.triangles = {{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2},
                        {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
      return mesh;
    }
    std::map<std::array<int, 3>, std::uint32_t> number;
    const auto vertex = [&](const std::array<int, 3>& key) {
      const auto [it, fresh] = number.try_emplace(key, mesh.vertices.size());
      if (fresh) mesh.vertices.push_back(whole(2, 5) * Point(key[0], key[1], key[2]));
      return it->second;
    };
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1})
        for (int i = -1; i < 1; ++i)
          for (int j = -1; j < 1; ++j) {
            const auto at = [&](int u, int v) {
              std::array<int, 3> key;
              key[static_cast<std::size_t>(axis)] = side;
              key[static_cast<std::size_t>((axis + 1) % 3)] = u;
              key[static_cast<std::size_t>((axis + 2) % 3)] = v;
              return vertex(key);
            };
            std::uint32_t a = at(i, j), b = at(i + 1, j), c = at(i + 1, j + 1), d = at(i, j + 1);
            if (side < 0) std::swap(b, d);
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
          }
    return mesh;
  }

  TriangleMesh cavity() {
    const Point low = point(-6, -4), high = point(4, 6);
    return joined(box_mesh(low, high), inverted(box_mesh(point(-3, -2), point(2, 3))));
  }

  /// Applies a matrix of integers with determinant 1.
  void shear(TriangleMesh& mesh) {
    const int from = whole(0, 2), to = (from + whole(1, 2)) % 3, by = whole(0, 1) ? 1 : -1;
    for (Point& v : mesh.vertices) v[to] += by * v[from];
  }

  std::mt19937_64 random_;
};

}  // namespace ist::testing
