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
std::array<double, 3> placed(const MeshView& mesh, const std::uint32_t* corners, std::size_t count,
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

/// Of the plane of a corner's triangle that passes farthest from p.
double farthest_plane(const MeshView& mesh, const std::array<double, 3>& p,
                      const std::uint32_t* corners, std::size_t count,
                      const std::vector<std::array<double, 3>>& areas) {
  double most = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double* n = areas[corners[i] / 3].data();
    const double area = std::sqrt(dot3(n, n));
    if (!(area > 0)) continue;
    const double* x = mesh.vertices + 3 * std::size_t{mesh.triangles[corners[i]]};
    const double off[3] = {x[0] - p[0], x[1] - p[1], x[2] - p[2]};
    most = std::max(most, std::fabs(dot3(n, off)) / area);
  }
  return most;
}

}  // namespace

VertexClusters::VertexClusters(const MeshView& mesh, double coarsest, int levels) : mesh_(mesh) {
  std::vector<std::array<double, 3>> areas(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count,
                    [&](std::uint32_t t) { areas[t] = doubled_area(mesh, t); });
  double cell = coarsest;
  for (int l = 0; l < levels; ++l, cell /= 2) {
    Clusters clusters = find_clusters(mesh, cell);
    const CornerLists lists(mesh, clusters);
    Level& level = levels_.emplace_back();
    level.place.resize(clusters.cell.size());
    level.off.resize(clusters.cell.size());
    tbb::parallel_for(std::size_t{0}, clusters.cell.size(), [&](std::size_t c) {
      const std::uint32_t* const corners = lists.corner.data() + lists.first[c];
      const std::size_t count = lists.first[c + 1] - lists.first[c];
      if (count == 0) return;
      std::array<double, 3> x = placed(mesh, corners, count, areas);
      for (std::size_t k = 0; k < 3; ++k) {
        const double low = (clusters.cell[c][k] - kShift[k] - 0.5) * cell;
        x[k] = std::clamp(x[k], low, low + 2 * cell);
      }
      level.place[c] = x;
      level.off[c] = farthest_plane(mesh, x, corners, count, areas);
    });
    level.of_vertex = std::move(clusters.of_vertex);
  }
}

std::vector<std::uint32_t> VertexClusters::chosen(double tolerance) const {
  std::vector<std::uint32_t> cluster_of(mesh_.vertex_count);
  tbb::parallel_for(std::uint32_t{0}, mesh_.vertex_count, [&](std::uint32_t v) {
    std::size_t before = 0;
    for (const Level& level : levels_) {
      const std::uint32_t cluster = level.of_vertex[v];
      if (level.off[cluster] <= tolerance) {
        cluster_of[v] = static_cast<std::uint32_t>(before + cluster);
        return;
      }
      before += level.place.size();
    }
    cluster_of[v] = static_cast<std::uint32_t>(before + v);
  });
  return cluster_of;
}

void VertexClusters::raise(const std::vector<double>& distance_of_vertex, double tolerance) {
  const std::vector<std::uint32_t> cluster_of = chosen(tolerance);
  for (std::size_t v = 0; v < cluster_of.size(); ++v) {
    std::size_t cluster = cluster_of[v];
    for (Level& level : levels_) {
      if (cluster < level.off.size()) {
        level.off[cluster] = std::max(level.off[cluster], distance_of_vertex[v]);
        break;
      }
      cluster -= level.off.size();
    }
  }
}

std::vector<FieldMesh::Triangle> VertexClusters::spanning(
    const std::vector<std::uint32_t>& cluster_of) const {
  std::vector<FieldMesh::Triangle> triangles;
  for (std::size_t t = 0; t < mesh_.triangle_count; ++t) {
    FieldMesh::Triangle corners;
    for (std::size_t k = 0; k < 3; ++k) corners[k] = cluster_of[mesh_.triangles[3 * t + k]];
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
      triangles.push_back(corners);
  }
  return triangles;
}

std::size_t VertexClusters::triangles_within(double tolerance) const {
  return reduced(spanning(chosen(tolerance))).size();
}

Clustered VertexClusters::within(double tolerance) const {
  const std::vector<std::uint32_t> cluster_of = chosen(tolerance);
  Clustered out;
  // Only clusters that are chosen become vertices.
  std::size_t names = mesh_.vertex_count;
  for (const Level& level : levels_) names += level.place.size();
  std::vector<std::uint32_t> vertex_of_cluster(names, kNoTriangle);
  out.vertex_of.resize(mesh_.vertex_count);
  for (std::uint32_t v = 0; v < mesh_.vertex_count; ++v) {
    std::uint32_t& vertex = vertex_of_cluster[cluster_of[v]];
    if (vertex == kNoTriangle) {
      vertex = static_cast<std::uint32_t>(out.mesh.vertices.size());
      const std::array<double, 3> x = place_of(cluster_of[v], v);
      out.mesh.vertices.push_back(
          {static_cast<float>(x[0]), static_cast<float>(x[1]), static_cast<float>(x[2])});
    }
    out.vertex_of[v] = vertex;
  }
  out.mesh.triangles = spanning(out.vertex_of);
  const std::vector<std::uint32_t> merged = reduce(out.mesh);
  for (std::uint32_t& vertex : out.vertex_of) vertex = merged[vertex];
  return out;
}

std::array<double, 3> VertexClusters::place_of(std::size_t cluster, std::uint32_t vertex) const {
  for (const Level& level : levels_) {
    if (cluster < level.place.size()) return level.place[cluster];
    cluster -= level.place.size();
  }
  const double* x = mesh_.vertices + 3 * std::size_t{vertex};
  return {x[0], x[1], x[2]};
}

}  // namespace ist
