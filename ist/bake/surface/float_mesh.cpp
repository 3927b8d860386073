#include "bake/surface/float_mesh.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

namespace ist {
namespace {

using Triangle = FloatMesh::Triangle;

/// Turned so that the lowest corner comes first.
Triangle lowest_first(const Triangle& t) {
  if (t[0] < t[1] && t[0] < t[2]) return t;
  if (t[1] < t[2]) return {t[1], t[2], t[0]};
  return {t[2], t[0], t[1]};
}

/// The same three corners run the other way.
bool runs_back(const Triangle& t) { return t[1] > t[2]; }
Triangle turned(const Triangle& t) { return {t[0], t[2], t[1]}; }
Triangle without_sense(const Triangle& t) { return runs_back(t) ? turned(t) : t; }

}  // namespace

std::vector<Triangle> reduced(std::vector<Triangle> triangles) {
  std::size_t kept = 0;
  for (const Triangle& t : triangles)
    if (t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) triangles[kept++] = lowest_first(t);
  triangles.resize(kept);
  tbb::parallel_sort(triangles.begin(), triangles.end(), [](const Triangle& a, const Triangle& b) {
    return std::pair(without_sense(a), runs_back(a)) < std::pair(without_sense(b), runs_back(b));
  });
  kept = 0;
  for (std::size_t begin = 0, end = 0; begin < triangles.size(); begin = end) {
    const Triangle t = without_sense(triangles[begin]);
    std::ptrdiff_t sum = 0;
    for (; end < triangles.size() && without_sense(triangles[end]) == t; ++end)
      sum += runs_back(triangles[end]) ? -1 : 1;
    for (std::ptrdiff_t i = 0; i < std::abs(sum); ++i) triangles[kept++] = sum < 0 ? turned(t) : t;
  }
  triangles.resize(kept);
  return triangles;
}

FloatMesh in_floats(const MeshView& mesh) {
  FloatMesh out;
  out.vertices.resize(mesh.vertex_count);
  out.triangles.resize(mesh.triangle_count);
  for (std::size_t v = 0; v < out.vertices.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k)
      out.vertices[v][k] = static_cast<float>(mesh.vertices[3 * v + k]);
  for (std::size_t t = 0; t < out.triangles.size(); ++t)
    std::copy_n(mesh.triangles + 3 * t, 3, out.triangles[t].begin());
  return out;
}

std::vector<std::uint32_t> reduce(FloatMesh& mesh) {
  for (FloatMesh::Vertex& v : mesh.vertices)
    for (float& x : v) x += 0.0f;  // one zero only
  std::vector<std::uint32_t> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(mesh.vertices[a], a) < std::pair(mesh.vertices[b], b);
  });
  std::vector<std::uint32_t> place(mesh.vertices.size());  // the first of those that are equal
  for (std::size_t i = 0; i < order.size(); ++i)
    place[order[i]] = i > 0 && mesh.vertices[order[i]] == mesh.vertices[order[i - 1]]
                          ? place[order[i - 1]]
                          : order[i];
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& v : t) v = place[v];
  mesh.triangles = reduced(std::move(mesh.triangles));
  return place;
}

}  // namespace ist
