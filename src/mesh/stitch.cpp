#include "mesh/stitch.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "mesh/edge_table.h"
#include "mesh/weld.h"

namespace ist {
namespace {

std::vector<bool> border_vertices(const TriangleMesh& mesh, const EdgeTable& edges) {
  std::vector<bool> border(mesh.vertices.size(), false);
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (edges.sides(e).size() % 2 == 1) border[edges.low(e)] = border[edges.high(e)] = true;
  return border;
}

/// Border vertices, findable by their x.
class SortedVertices {
 public:
  SortedVertices(const TriangleMesh& mesh, const std::vector<bool>& border) : mesh_(mesh) {
    for (std::uint32_t v = 0; v < border.size(); ++v)
      if (border[v]) order_.emplace_back(mesh.vertices[v][0], v);
    std::sort(order_.begin(), order_.end());
  }

  /// Those within `tolerance` of the segment from u to v but not of its ends, in its order.
  std::vector<std::uint32_t> on_segment(const std::uint32_t u, const std::uint32_t v,
                                        const double tolerance) const {
    const Eigen::Vector3d& a = mesh_.vertices[u];
    const Eigen::Vector3d& b = mesh_.vertices[v];
    const double length = (b - a).norm();
    const Eigen::Vector3d along = (b - a) / length;
    std::vector<std::pair<double, std::uint32_t>> found;
    const double first = std::min(a[0], b[0]) - tolerance, last = std::max(a[0], b[0]) + tolerance;
    for (auto it = std::lower_bound(order_.begin(), order_.end(), std::pair(first, 0u));
         it != order_.end() && it->first <= last; ++it) {
      if (it->second == u || it->second == v) continue;
      const Eigen::Vector3d p = mesh_.vertices[it->second] - a;
      const double at = p.dot(along);
      if (at > tolerance && at < length - tolerance && (p - at * along).norm() <= tolerance)
        found.emplace_back(at, it->second);
    }
    std::sort(found.begin(), found.end());
    std::vector<std::uint32_t> result;
    result.reserve(found.size());
    for (const auto& [at, w] : found) result.push_back(w);
    return result;
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<std::pair<double, std::uint32_t>> order_;
};

/// Splits border triangles at border vertices on their sides, one side a triangle. Returns whether
/// there was any to split.
bool split_once(TriangleMesh& mesh, const double tolerance) {
  const EdgeTable edges(mesh.triangles);
  const SortedVertices border(mesh, border_vertices(mesh, edges));
  std::vector<Triangle> pieces;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() != 1) continue;
    const std::uint32_t side = edges.sides(e)[0];
    Triangle& t = mesh.triangles[side / 3];
    const std::uint32_t u = t[side % 3], v = t[(side + 1) % 3], tip = t[(side + 2) % 3];
    if (edges.edge_of(side) != e ||
        std::pair(std::min(u, v), std::max(u, v)) != std::pair(edges.low(e), edges.high(e)))
      continue;  // already split at another side
    std::vector<std::uint32_t> stops = border.on_segment(u, v, tolerance);
    std::erase(stops, tip);
    if (stops.empty()) continue;
    stops.push_back(v);
    t = {u, stops[0], tip};
    for (std::size_t i = 0; i + 1 < stops.size(); ++i)
      pieces.push_back({stops[i], stops[i + 1], tip});
  }
  mesh.triangles.insert(mesh.triangles.end(), pieces.begin(), pieces.end());
  return !pieces.empty();
}

}  // namespace

TriangleMesh stitch(const TriangleMesh& mesh, const double tolerance) {
  TriangleMesh result =
      weld_among(mesh, tolerance, border_vertices(mesh, EdgeTable(mesh.triangles)));
  constexpr int kMostRounds = 8;  // each splits one side a triangle
  for (int round = 0; round < kMostRounds && split_once(result, tolerance); ++round) {
  }
  return result;
}

}  // namespace ist
