#include "mesh/hierarchy/winding.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/hierarchy/line_lattice.h"

namespace ist {
namespace {

/// Clears hit[i] if oriented box i is apart from a box, seen along x.
void leave_out_apart(const OrientedBoxes<kBvhWidth>& boxes, const float low[3], const float high[3],
                     int hit[kBvhWidth]) {
  const float y = (low[1] + high[1]) / 2, z = (low[2] + high[2]) / 2;
  const float half_y = (high[1] - low[1]) / 2, half_z = (high[2] - low[2]) / 2;
  const auto size = [](FloatLanes x) { return x < FloatLanes{} ? -x : x; };
  for (int i = 0; i < kBvhWidth; i += kFloatLanes) {
    FloatLanes axis[3][3], centre_y{}, centre_z{}, apart{};
    load_axes(boxes, i, axis);
    for (int k = 0; k < 3; ++k) {
      const FloatLanes middle = load_lanes(boxes.middle[k] + i);
      centre_y += middle * axis[k][1];
      centre_z += middle * axis[k][2];
    }
    // Tests the directions perpendicular to each of the box's edges, in projection.
    for (int k = 0; k < 3; ++k) {
      const FloatLanes across_y = -axis[k][2], across_z = axis[k][1];
      FloatLanes reach =
          size(across_y) * half_y + size(across_z) * half_z + 8 * float_distance_error(1);
      for (int j = 0; j < 3; ++j)
        reach +=
            load_lanes(boxes.half[j] + i) * size(across_y * axis[j][1] + across_z * axis[j][2]);
      const FloatLanes off = size(across_y * (centre_y - y) + across_z * (centre_z - z)) - reach;
      apart = off > apart ? off : apart;
    }
    float gap[kFloatLanes];
    store_lanes(apart, gap);
    for (int lane = 0; lane < kFloatLanes; ++lane) hit[i + lane] &= gap[lane] > 0 ? 0 : 1;
  }
}

/// Calls visit(corners) for all triangles whose boxes meet a box, and for some others.
template <class Visit>
void visit_about_box(const MeshView& mesh, const float low[3], const float high[3],
                     const Visit& visit) {
  if (mesh.root == kBvhEmpty) return;
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = mesh.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : mesh.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle) visit(corners_of(mesh, triangle));
      continue;
    }
    const BvhNode& node = mesh.nodes[at];
    int hit[kBvhWidth] = {1, 1, 1, 1};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < kBvhWidth; ++i)
        hit[i] &= (node.lower[k][i] <= high[k]) & (node.upper[k][i] >= low[k]);
    if (mesh.oriented != nullptr) leave_out_apart(mesh.oriented[at], low, high, hit);
    for (int i = 0; i < kBvhWidth; ++i)
      if (hit[i] != 0) stack[top++] = node.child[i];
  }
}

/// Lines (y, z) grouped by square cells, as many cells as lines.
class LinesInCells {
 public:
  explicit LinesInCells(const std::vector<std::array<double, 2>>& lines)
      : cells_(static_cast<std::size_t>(std::sqrt(static_cast<double>(lines.size()))) + 1),
        lines_(cells_ * cells_, [&](const auto& visit) {
          for (std::uint32_t i = 0; i < lines.size(); ++i)
            visit(cell_of(lines[i][1]) * cells_ + cell_of(lines[i][0]), i);
        }) {}

  /// Calls visit(line) for all lines within the extents, and for some others.
  template <class Visit>
  void for_each(const Extent& y, const Extent& z, const Visit& visit) const {
    const std::size_t left = cell_of(y.low), right = cell_of(y.high), last = cell_of(z.high);
    for (std::size_t row = cell_of(z.low); row <= last; ++row) {
      const std::uint32_t end = lines_.first[row * cells_ + right + 1];
      for (std::uint32_t i = lines_.first[row * cells_ + left]; i < end; ++i)
        visit(lines_.items[i]);
    }
  }

 private:
  /// Monotone in the coordinate.
  std::size_t cell_of(double x) const {
    const auto n = static_cast<double>(cells_);
    return static_cast<std::size_t>(std::clamp((x + 1) / 2 * n, 0.0, n - 1));
  }

  std::size_t cells_;  ///< along each side of the cube
  ItemGroups<> lines_;
};

}  // namespace

int winding_number(const MeshView& mesh, const double p[3]) {
  int winding = 0;
  const RayBox box = RayBox::ray(p);
  visit_about_box(mesh, box.lower, box.upper,
                  [&](const Corners& t) { winding += ray_winding(t, p); });
  return winding;
}

void line_crossings(const MeshView& mesh, double y, double z, std::vector<Crossing>& out) {
  out.clear();
  const double yz[2] = {y, z};
  const RayBox box = RayBox::line(y, z);
  visit_about_box(mesh, box.lower, box.upper, [&](const Corners& t) {
    const int facing = pierced(t, yz);
    if (facing != 0) out.push_back({crossing_x(t, yz), -facing});
  });
  std::sort(out.begin(), out.end(), comes_before);
}

ItemGroups<std::uint32_t, Crossing> line_crossings(
    const MeshView& mesh, const std::vector<std::array<double, 2>>& lines) {
  const LinesInCells in_cells(lines);
  tbb::enumerable_thread_specific<std::vector<std::pair<std::uint32_t, Crossing>>> of_threads;
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t triangle) {
    const Corners t = corners_of(mesh, triangle);
    const Extent y(t, 1), z(t, 2);
    in_cells.for_each(y, z, [&](std::uint32_t line) {
      const double* const yz = lines[line].data();
      if (yz[0] < y.low || yz[0] > y.high || yz[1] < z.low || yz[1] > z.high) return;
      const int facing = pierced(t, yz);
      if (facing != 0) of_threads.local().push_back({line, {crossing_x(t, yz), -facing}});
    });
  });
  const auto each = [&](const auto& visit) {
    for (const auto& found : of_threads)
      for (const auto& [line, crossing] : found) visit(line, crossing);
  };
  return ItemGroups<std::uint32_t, Crossing>::in_parallel(lines.size(), each, comes_before);
}

}  // namespace ist
