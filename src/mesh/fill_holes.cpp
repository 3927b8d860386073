#include "mesh/fill_holes.h"

#include <algorithm>

#include "mesh/import/polygon_mesh.h"

namespace ist {

std::vector<BorderLoop> border_loops(const EdgeTable& edges) {
  std::vector<std::uint32_t> open;  // odd edges
  std::uint32_t vertices = 0;
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() % 2 == 0) continue;
    open.push_back(e);
    vertices = std::max(vertices, edges.high(e) + 1);
  }
  std::vector<std::vector<std::uint32_t>> at(vertices);  // edges still to walk
  for (auto e = open.rbegin(); e != open.rend(); ++e) {
    at[edges.low(*e)].push_back(*e);
    at[edges.high(*e)].push_back(*e);
  }
  std::vector<bool> walked(edges.size(), false);
  std::vector<std::uint32_t> place(vertices, kNoIndex);  // of a vertex on the path
  std::vector<BorderLoop> loops;
  for (const std::uint32_t start : open) {
    if (walked[start]) continue;
    std::vector<std::uint32_t> path{edges.low(start)};
    place[path[0]] = 0;
    while (!path.empty()) {
      auto& choices = at[path.back()];
      while (!choices.empty() && walked[choices.back()]) choices.pop_back();
      if (choices.empty()) {  // only the start of the walk, all its loops closed, has no way on
        place[path.back()] = kNoIndex;
        path.pop_back();
        continue;
      }
      const std::uint32_t e = choices.back();
      walked[e] = true;
      const std::uint32_t next = edges.low(e) == path.back() ? edges.high(e) : edges.low(e);
      if (place[next] == kNoIndex) {
        place[next] = static_cast<std::uint32_t>(path.size());
        path.push_back(next);
        continue;
      }
      // Back on the path: cut the loop off.
      const auto begin = path.begin() + place[next];
      loops.push_back({{begin, path.end()}, e});
      for (auto v = begin + 1; v != path.end(); ++v) place[*v] = kNoIndex;
      path.erase(begin + 1, path.end());
    }
  }
  return loops;
}

std::vector<Triangle> cap(const std::vector<Eigen::Vector3d>& vertices, const BorderLoop& loop) {
  std::vector<Triangle> triangles;
  triangulate_polygon(vertices, loop.vertices.data(), loop.vertices.size(), triangles);
  return triangles;
}

}  // namespace ist
