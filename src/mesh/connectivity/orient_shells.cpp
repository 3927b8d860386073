#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>

#include "base/raw_array.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/triangle_columns.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {
namespace {

/// True if the point is left of the edge from u to v in the yz plane. Gives the same bits for both
/// triangles at the edge. A point on the edge counts as left.
bool left_of_upward_edge(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                         const Eigen::Vector3d& p) {
  return orient2d_sign(lower.data() + 1, upper.data() + 1, p.data() + 1) >= 0;
}

/// Winding number of the triangle's outline around the point in the yz plane: −1, 0 or 1.
int turns_around(const std::array<Eigen::Vector3d, 3>& corners, const Eigen::Vector3d& p) {
  int turns = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& u = corners[k];
    const Eigen::Vector3d& v = corners[(k + 1) % 3];
    const bool u_below = u[1] <= p[1], v_below = v[1] <= p[1];
    if (u_below && !v_below && left_of_upward_edge(u, v, p)) ++turns;
    if (v_below && !u_below && left_of_upward_edge(v, u, p)) --turns;
  }
  return turns;
}

/// Winding numbers of points around each of several closed shells, by the signed crossings of a
/// line parallel to x. Edges and vertices on the line are counted once and consistently.
class LineWinding {
 public:
  /// Keeps references.
  LineWinding(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
              const Shells& shells)
      : vertices_(vertices),
        triangles_(triangles),
        shells_(shells),
        columns_(triangles, 0, [&](std::uint32_t v) { return vertices[v]; }) {}

  /// Sets numbers[s] to the winding number of shell s around p, for every shell in `shells_met`,
  /// which lists those where it may differ from 0. `numbers` must be zeros on entry.
  void around(const Eigen::Vector3d& p, std::vector<int>& numbers,
              std::vector<std::uint32_t>& shells_met) const {
    shells_met.clear();
    for (const std::uint32_t i : columns_.about(p)) {
      const Triangle& t = triangles_[i];
      const std::array<Eigen::Vector3d, 3> corners{vertices_[t[0]], vertices_[t[1]],
                                                   vertices_[t[2]]};
      const int turns = turns_around(corners, p);
      if (turns == 0) continue;
      // The triangle is beyond p towards +x if p lies behind it while it faces that direction.
      if (orient3d_sign(corners[0].data(), corners[1].data(), corners[2].data(), p.data()) != turns)
        continue;
      const std::uint32_t shell = shells_.of_triangle[i];
      if (std::find(shells_met.begin(), shells_met.end(), shell) == shells_met.end())
        shells_met.push_back(shell);
      numbers[shell] += turns;
    }
  }

 private:
  const std::vector<Eigen::Vector3d>& vertices_;
  const std::vector<Triangle>& triangles_;
  const Shells& shells_;
  const TriangleColumns columns_;
};

struct Shell {
  SignedVolume volume;
  Eigen::AlignedBox3d box;
  std::vector<std::uint32_t> probes;  ///< some of its vertices
  std::vector<std::pair<std::uint32_t, int>> containers =
      {};  ///< shell, and its winding number here
};

/// Processes a range of triangles at a time, as those of one shell are mostly consecutive.
void find_boxes(const std::vector<Eigen::Vector3d>& vertices,
                const std::vector<Triangle>& triangles, const Shells& shells,
                std::vector<Shell>& result) {
  std::mutex mutex;
  const auto look_at = [&](const tbb::blocked_range<std::size_t>& range) {
    for (std::size_t t = range.begin(); t < range.end();) {
      const std::uint32_t shell = shells.of_triangle[t];
      Eigen::AlignedBox3d box;
      for (; t < range.end() && shells.of_triangle[t] == shell; ++t)
        box.extend(bounds_of(vertices, triangles[t]));
      const std::scoped_lock lock(mutex);
      result[shell].box.extend(box);
    }
  };
  constexpr std::size_t kPart = 4096;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles.size(), kPart), look_at);
}

std::vector<Shell> measure(const std::vector<Eigen::Vector3d>& vertices,
                           const std::vector<Triangle>& triangles, const Shells& shells) {
  constexpr std::size_t kProbes = 9;
  std::vector<Shell> result(shells.count);
  std::vector<std::size_t> sizes(shells.count, 0);
  if (shells.count == 1)
    sizes[0] = triangles.size();
  else
    for (const std::uint32_t s : shells.of_triangle) ++sizes[s];
  find_boxes(vertices, triangles, shells, result);
  RawArray<double> terms(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
    const Eigen::Vector3d origin = result[shells.of_triangle[t]].box.center();
    const auto corner = [&](std::size_t k) { return vertices[triangles[t][k]] - origin; };
    terms[t] = corner(0).dot(corner(1).cross(corner(2))) / 6;
  });
  std::vector<std::size_t> until_probe(shells.count, 0);  // triangles
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t s = shells.of_triangle[t];
    Shell& shell = result[s];
    const double term = terms[t];
    shell.volume.volume += term;
    shell.volume.magnitude += std::abs(term);
    if (until_probe[s]-- != 0) continue;
    until_probe[s] = (sizes[s] + kProbes - 1) / kProbes - 1;
    shell.probes.push_back(triangles[t][0]);
  }
  return result;
}

/// Finds which shells contain which: all probes of the inner one lie inside.
void find_containers(const std::vector<Eigen::Vector3d>& vertices,
                     const std::vector<Triangle>& triangles, const Shells& shells,
                     std::vector<Shell>& measured) {
  const LineWinding winding(vertices, triangles, shells);
  std::vector<int> numbers(shells.count, 0);
  std::vector<std::uint32_t> met;
  for (std::uint32_t s = 0; s < shells.count; ++s) {
    auto& containers = measured[s].containers;
    for (std::size_t i = 0; i < measured[s].probes.size(); ++i) {
      winding.around(vertices[measured[s].probes[i]], numbers, met);
      if (i == 0) {
        std::sort(met.begin(), met.end());
        for (const std::uint32_t other : met)
          if (other != s && measured[other].box.contains(measured[s].box))
            containers.emplace_back(other, numbers[other]);
      }
      std::erase_if(containers,
                    [&](const auto& c) { return numbers[c.first] != c.second || c.second == 0; });
      for (const std::uint32_t other : met) numbers[other] = 0;
    }
  }
}

}  // namespace

Nesting orient_shells(const std::vector<Eigen::Vector3d>& vertices,
                      std::vector<Triangle>& triangles, const Shells& shells) {
  std::vector<Shell> measured = measure(vertices, triangles, shells);
  if (shells.count > 1) find_containers(vertices, triangles, shells, measured);

  // From the outside in: a shell lies in more shells than any that contains it.
  std::vector<std::uint32_t> order(shells.count);
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return measured[a].containers.size() < measured[b].containers.size();
  });
  Nesting nesting;
  std::vector<bool> turned(shells.count, false);
  for (const std::uint32_t s : order) {
    const Shell& shell = measured[s];
    if (shell.volume.is_flat()) {
      ++nesting.flat;
      continue;
    }
    std::uint32_t outermost = s;
    int around =
        0;  // winding number of the shells that contain this one, in their current orientation
    for (const auto& [holder, number] : shell.containers) {
      around += turned[holder] ? -number : number;
      if (measured[holder].containers.size() < measured[outermost].containers.size())
        outermost = holder;
    }
    const bool follows = outermost != s && turned[outermost];
    const bool outward = (shell.volume.volume > 0) != follows;
    if (outward || around >= 1) {
      turned[s] = follows;
      if (outward && around >= 1) ++nesting.nested_solids;
      if (!outward) ++nesting.cavities;
    } else {
      turned[s] = !follows;
    }
    nesting.flipped += turned[s] ? 1 : 0;
    nesting.volume.volume += turned[s] ? -shell.volume.volume : shell.volume.volume;
    nesting.volume.magnitude += shell.volume.magnitude;
  }
  if (std::find(turned.begin(), turned.end(), true) == turned.end()) return nesting;
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
    if (turned[shells.of_triangle[t]]) std::swap(triangles[t][1], triangles[t][2]);
  });
  return nesting;
}

}  // namespace ist
