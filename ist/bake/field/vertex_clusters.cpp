#include "bake/field/vertex_clusters.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "mesh/triangle_frame.h"

namespace ist {
namespace {

/// Where the grid lies, in cells: off the planes that meshes like.
constexpr double kShift[3] = {0.3711, 0.4393, 0.2937};
/// How strongly the mean of a cluster's corners holds it where planes do not.
constexpr double kPull = 1e-3;

struct Clusters {
  std::vector<std::uint32_t> of_vertex;
  std::vector<std::array<std::int32_t, 3>> cell;  ///< [cluster]
};

std::array<std::int32_t, 3> cell_of(const double* x, double cell) {
  std::array<std::int32_t, 3> at;
  for (std::size_t k = 0; k < 3; ++k)
    at[k] = static_cast<std::int32_t>(std::floor(x[k] / cell + kShift[k]));
  return at;
}

Clusters find_clusters(const MeshView& mesh, double cell) {
  using Entry = std::pair<std::array<std::int32_t, 3>, std::uint32_t>;
  std::vector<Entry> entries(mesh.vertex_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.vertex_count, [&](std::uint32_t v) {
    entries[v] = {cell_of(mesh.vertices + 3 * std::size_t{v}, cell), v};
  });
  tbb::parallel_sort(entries.begin(), entries.end());
  Clusters clusters;
  clusters.of_vertex.resize(mesh.vertex_count);
  for (const auto& [at, v] : entries) {
    if (clusters.cell.empty() || clusters.cell.back() != at) clusters.cell.push_back(at);
    clusters.of_vertex[v] = static_cast<std::uint32_t>(clusters.cell.size() - 1);
  }
  return clusters;
}

/// The triangles over clusters of three different corners.
std::vector<FieldMesh::Triangle> spanning(const MeshView& mesh, const Clusters& clusters) {
  std::vector<FieldMesh::Triangle> triangles;
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    FieldMesh::Triangle corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = clusters.of_vertex[mesh.triangles[3 * t + k]];
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
      triangles.push_back(corners);
  }
  return triangles;
}

/// The corners 3t + k of each cluster in ascending order.
struct CornerLists {
  std::vector<std::uint32_t> first, corner;

  CornerLists(const MeshView& mesh, const Clusters& clusters)
      : first(clusters.cell.size() + 1), corner(3 * std::size_t{mesh.triangle_count}) {
    const auto cluster_of = [&](std::size_t c) { return clusters.of_vertex[mesh.triangles[c]]; };
    for (std::size_t c = 0; c < corner.size(); ++c) ++first[cluster_of(c) + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::size_t c = 0; c < corner.size(); ++c)
      corner[next[cluster_of(c)]++] = static_cast<std::uint32_t>(c);
  }
};

/// Twice the area times the normal.
std::array<double, 3> doubled_area(const MeshView& mesh, std::uint32_t triangle) {
  const std::uint32_t* t = mesh.triangles + 3 * std::size_t{triangle};
  const double* p[3];
  for (int k = 0; k < 3; ++k) p[k] = mesh.vertices + 3 * std::size_t{t[k]};
  double u[3], v[3];
  for (int k = 0; k < 3; ++k) {
    u[k] = p[1][k] - p[0][k];
    v[k] = p[2][k] - p[0][k];
  }
  std::array<double, 3> out;
  cross3(u, v, out.data());
  return out;
}

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

/// Where a cluster of these corners goes: as near as can be to the planes of their triangles,
/// weighted by area.
std::array<double, 3> place(const MeshView& mesh, const std::uint32_t* corners, std::size_t count,
                            const std::vector<std::array<double, 3>>& areas) {
  double weight = 0, mean[3] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const double* n = areas[corners[i] / 3].data();
    const double area = std::sqrt(dot3(n, n));
    const double* x = mesh.vertices + 3 * std::size_t{mesh.triangles[corners[i]]};
    weight += area;
    for (int k = 0; k < 3; ++k) mean[k] += area * x[k];
  }
  if (!(weight > 0)) {
    const double* x = mesh.vertices + 3 * std::size_t{mesh.triangles[corners[0]]};
    return {x[0], x[1], x[2]};
  }
  for (double& m : mean) m /= weight;
  double a[3][3] = {}, b[3] = {};
  for (std::size_t i = 0; i < count; ++i) {
    const double* n = areas[corners[i] / 3].data();
    const double area = std::sqrt(dot3(n, n));
    if (!(area > 0)) continue;
    const double* x = mesh.vertices + 3 * std::size_t{mesh.triangles[corners[i]]};
    const double off[3] = {x[0] - mean[0], x[1] - mean[1], x[2] - mean[2]};
    const double height = dot3(n, off) / area;
    for (int k = 0; k < 3; ++k) {
      b[k] += n[k] * height;
      for (int l = 0; l < 3; ++l) a[k][l] += n[k] * (n[l] / area);
    }
  }
  for (int k = 0; k < 3; ++k) a[k][k] += kPull * weight;
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < k; ++l) a[k][l] = a[l][k];
  double y[3];
  solve(a, b, y);
  return {mean[0] + y[0], mean[1] + y[1], mean[2] + y[2]};
}

}  // namespace

std::size_t clustered_triangles(const MeshView& mesh, double cell) {
  return reduced(spanning(mesh, find_clusters(mesh, cell))).size();
}

Clustered cluster_vertices(const MeshView& mesh, double cell) {
  const Clusters clusters = find_clusters(mesh, cell);
  const CornerLists lists(mesh, clusters);
  std::vector<std::array<double, 3>> areas(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count,
                    [&](std::uint32_t t) { areas[t] = doubled_area(mesh, t); });
  Clustered out;
  out.mesh.vertices.resize(clusters.cell.size());
  tbb::parallel_for(std::size_t{0}, clusters.cell.size(), [&](std::size_t c) {
    const std::size_t count = lists.first[c + 1] - lists.first[c];
    if (count == 0) return;
    const std::array<double, 3> x = place(mesh, lists.corner.data() + lists.first[c], count, areas);
    for (std::size_t k = 0; k < 3; ++k) {
      const double low = (clusters.cell[c][k] - kShift[k] - 0.5) * cell;
      out.mesh.vertices[c][k] = static_cast<float>(std::clamp(x[k], low, low + 2 * cell));
    }
  });
  out.mesh.triangles = spanning(mesh, clusters);
  const std::vector<std::uint32_t> merged = reduce(out.mesh);
  out.vertex_of.resize(mesh.vertex_count);
  for (std::size_t v = 0; v < out.vertex_of.size(); ++v)
    out.vertex_of[v] = merged[clusters.of_vertex[v]];
  return out;
}

}  // namespace ist
