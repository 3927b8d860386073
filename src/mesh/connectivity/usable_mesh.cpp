#include "mesh/connectivity/usable_mesh.h"

#include <ist/types.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <atomic>
#include <utility>

#include "base/message_text.h"
#include "mesh/connectivity/weld.h"

namespace ist {
namespace {

void check_indices_and_coordinates(const TriangleMesh& mesh, const std::string& name) {
  if (mesh.triangles.empty()) throw Error(name + ": no triangles, so it does not bound a solid");
  const auto unsound = [&](std::size_t t) {
    return std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), [&](const auto v) {
      return v >= mesh.vertices.size() || !mesh.vertices[v].allFinite();
    });
  };
  std::atomic<bool> sound = true;
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    if (unsound(t)) sound = false;
  });
  if (sound) return;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.vertices.size())
        throw Error(name + ": triangle " + std::to_string(t) + " refers to vertex " +
                    std::to_string(v) + " of " + std::to_string(mesh.vertices.size()));
      if (!mesh.vertices[v].allFinite())
        throw Error(name + ": vertex " + std::to_string(v) +
                    " has a coordinate that is infinite or not a number. Correct it");
    }
}

/// Refuses sizes whose cube overflows or underflows a double, before anything is computed: exact
/// signs of infinite products do not terminate. A mesh of one point has its own message.
void refuse_unusable_size(const TriangleMesh& mesh, const std::string& name) {
  constexpr double kSmallest = 1e-90, kLargest = 1e90, kFarthest = 1e100;
  const Eigen::AlignedBox3d bounds = bounds_of(mesh.vertices);
  const double size = bounds.sizes().maxCoeff(), offset = largest_coordinate(bounds);
  if (!(size == 0 || size > kSmallest) || !(size < kLargest && offset < kFarthest))
    throw Error(name + ": a size of " + shortest(size) + " at an offset of " + shortest(offset) +
                " is out of range. Scale or move it");
}

}  // namespace

Eigen::AlignedBox3d bounds_of(const std::vector<Eigen::Vector3d>& points) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, points.size()), Eigen::AlignedBox3d(),
      [&](const tbb::blocked_range<std::size_t>& range, Eigen::AlignedBox3d box) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) box.extend(points[i]);
        return box;
      },
      [](const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) { return a.merged(b); });
}

double largest_coordinate(const Eigen::AlignedBox3d& bounds) {
  return std::max(bounds.min().cwiseAbs().maxCoeff(), bounds.max().cwiseAbs().maxCoeff());
}

void weld_usable(TriangleMesh& mesh, const std::string& name) {
  check_indices_and_coordinates(mesh, name);
  mesh = weld(std::move(mesh), 0);
  refuse_unusable_size(mesh, name);
}

}  // namespace ist
