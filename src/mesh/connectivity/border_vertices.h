#pragma once

#include <ist/mesh.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace ist {

/// Border vertices in a k-d tree: the median of a range divides it, along x, y and z in turn.
class BorderVertices {
 public:
  BorderVertices(const TriangleMesh& mesh, const std::vector<bool>& border) : mesh_(mesh) {
    for (std::uint32_t v = 0; v < border.size(); ++v)
      if (border[v]) points_.push_back({mesh.vertices[v], v});
    part(0, points_.size(), 0);
  }

  /// The vertices within `tolerance` of the segment from u to v, except near its ends, in order
  /// along it.
  std::vector<std::uint32_t> on_segment(std::uint32_t u, std::uint32_t v, double tolerance) const {
    std::vector<std::pair<double, std::uint32_t>> found;
    for_each_beside(u, v, tolerance, [&](std::uint32_t w, double off, double at, double from_end) {
      if (off <= tolerance && from_end > tolerance) found.emplace_back(at, w);
    });
    std::sort(found.begin(), found.end());
    std::vector<std::uint32_t> result;
    result.reserve(found.size());
    for (const auto& [at, w] : found) result.push_back(w);
    return result;
  }

  /// The least tolerance up to `most` within which a vertex lies on the segment or coincides with
  /// its ends; infinity if there is none.
  double least_tolerance(std::uint32_t u, std::uint32_t v, double most) const {
    double least = HUGE_VAL;
    for_each_beside(u, v, most, [&](std::uint32_t w, double off, double, double from_end) {
      const double needed = off < from_end ? off : std::min(distance(w, u), distance(w, v));
      if (needed <= most) least = std::min(least, needed);
    });
    return least;
  }

 private:
  struct Point {
    Eigen::Vector3d x;
    std::uint32_t vertex;
  };

  static constexpr std::size_t kFew = 8;  ///< so few are not divided

  double distance(std::uint32_t v, std::uint32_t w) const {
    return (mesh_.vertices[v] - mesh_.vertices[w]).norm();
  }

  /// visit(w, its distance from the line, its position along it from u, that from the nearer end)
  /// for all vertices within `tolerance` of the segment from u to v, and some others.
  template <class Visit>
  void for_each_beside(std::uint32_t u, std::uint32_t v, double tolerance,
                       const Visit& visit) const {
    const Eigen::Vector3d& a = mesh_.vertices[u];
    const double length = distance(u, v);
    const Eigen::Vector3d along = (mesh_.vertices[v] - a) / length;
    visit_near({0, points_.size(), 0, -tolerance, length + tolerance}, a, along, tolerance,
               [&](const Point& point) {
                 if (point.vertex == u || point.vertex == v) return;
                 const Eigen::Vector3d p = point.x - a;
                 const double at = p.dot(along);
                 visit(point.vertex, (p - at * along).norm(), at, std::min(at, length - at));
               });
  }

  void part(std::size_t first, std::size_t last, int axis) {
    if (last - first <= kFew) return;
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(first), at(middle), at(last),
                     [&](const Point& p, const Point& q) { return p.x[axis] < q.x[axis]; });
    part(first, middle, (axis + 1) % 3);
    part(middle + 1, last, (axis + 1) % 3);
  }

  /// A range of the tree, and the part of a line that is searched there.
  struct Range {
    std::size_t first, last;
    int axis;
    double begin, end;
  };

  /// The vertices near a part of the line from a, and some others.
  template <class Visit>
  void visit_near(const Range range, const Eigen::Vector3d& a, const Eigen::Vector3d& along,
                  double tolerance, const Visit& visit) const {
    const auto& [first, last, axis, begin, end] = range;
    if (last - first <= kFew) {
      for (std::size_t i = first; i < last; ++i) visit(points_[i]);
      return;
    }
    const std::size_t middle = first + (last - first) / 2;
    const double plane = points_[middle].x[axis], slope = along[axis];
    const double from = a[axis] + slope * begin - plane, to = a[axis] + slope * end - plane;
    const double margin = 2 * tolerance;
    const bool below = std::min(from, to) <= margin, above = std::max(from, to) >= -margin;
    Range parts[] = {{first, middle, (axis + 1) % 3, begin, end},
                     {middle + 1, last, (axis + 1) % 3, begin, end}};
    if (below && above) {
      visit(points_[middle]);
      // The line leaves one side and enters the other.
      for (const int side : {0, 1}) {
        const double off = (side == 0 ? margin : -margin) - from;
        if (!(std::abs(off) < std::abs(to - from))) continue;
        const double place = begin + off / (to - from) * (end - begin);
        if ((to > from) == (side == 0))
          parts[side].end = std::min(end, place);
        else
          parts[side].begin = std::max(begin, place);
      }
    }
    if (below) visit_near(parts[0], a, along, tolerance, visit);
    if (above) visit_near(parts[1], a, along, tolerance, visit);
  }

  const TriangleMesh& mesh_;
  std::vector<Point> points_;
};

}  // namespace ist
