#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "mesh/import/polygon_mesh.h"

namespace ist {
namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// Twice the vector area of a closed polygon; its direction is the polygon's normal (Newell).
Eigen::Vector3d newell_normal(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < points.size(); ++i)
    sum += (points[i] - points[0]).cross(points[i + 1] - points[0]);
  return sum;
}

/// Twice the signed area of a triangle seen along `normal`, times |normal|.
double turn(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& normal) {
  return (b - a).cross(c - a).dot(normal);
}

/// Of a triangle: 1 for an equilateral one, 0 for a flat one, negative if it turns the wrong way.
double roundness(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                 const Eigen::Vector3d& normal) {
  const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return sides > 0 ? turn(a, b, c, normal) / (sides * normal.norm()) : 0;
}

class EarClipper {
 public:
  EarClipper(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& normal)
      : points_(points), normal_(normal), left_(points.size()) {
    for (std::size_t i = 0; i < left_.size(); ++i) left_[i] = i;
  }

  /// Cuts the best ear until a triangle is left. Where the polygon crosses itself no proper ear may
  /// remain: then the least bad corner goes, so that every side of the polygon keeps its triangle.
  template <class Emit>
  void clip(const Emit& emit) {
    while (left_.size() > 3) {
      std::size_t best = 0;
      double best_quality = -2;
      for (std::size_t i = 0; i < left_.size(); ++i) {
        const auto [a, b, c] = corner(i);
        double quality = roundness(points_[a], points_[b], points_[c], normal_);
        if (quality > 0 && holds_another(a, b, c)) quality = -1 + quality;
        if (quality > best_quality) {
          best = i;
          best_quality = quality;
        }
      }
      const auto [a, b, c] = corner(best);
      emit(a, b, c);
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(best));
    }
    emit(left_[0], left_[1], left_[2]);
  }

 private:
  std::array<std::size_t, 3> corner(const std::size_t i) const {
    const std::size_t n = left_.size();
    return {left_[(i + n - 1) % n], left_[i], left_[(i + 1) % n]};
  }

  bool holds_another(const std::size_t a, const std::size_t b, const std::size_t c) const {
    return std::any_of(left_.begin(), left_.end(), [&](const std::size_t k) {
      const Eigen::Vector3d& p = points_[k];
      if (p == points_[a] || p == points_[b] || p == points_[c]) return false;
      return turn(points_[a], points_[b], p, normal_) >= 0 &&
             turn(points_[b], points_[c], p, normal_) >= 0 &&
             turn(points_[c], points_[a], p, normal_) >= 0;
    });
  }

  const std::vector<Eigen::Vector3d>& points_;
  const Eigen::Vector3d normal_;
  std::vector<std::size_t> left_;
};

}  // namespace

void triangulate_polygon(const std::vector<Eigen::Vector3d>& vertices,
                         const std::uint32_t* const corners, const std::size_t count,
                         Triangles& out) {
  if (count == 3) {
    out.push_back({corners[0], corners[1], corners[2]});
    return;
  }
  std::vector<Eigen::Vector3d> points(count);
  for (std::size_t i = 0; i < count; ++i) points[i] = vertices[corners[i]];
  const Eigen::Vector3d normal = newell_normal(points);
  bool fan_is_valid = true;
  for (std::size_t i = 1; fan_is_valid && i + 1 < count; ++i)
    fan_is_valid = turn(points[0], points[i], points[i + 1], normal) > 0;
  // Without a normal (a flat or unreadable polygon) one way is as good as another.
  const bool has_normal = normal.squaredNorm() > 0;
  // Cutting ears takes the square to the cube of the number of corners: a huge polygon is fanned.
  constexpr std::size_t kMostCorners = 2000;
  if (fan_is_valid || !has_normal || count > kMostCorners) {
    for (std::size_t i = 1; i + 1 < count; ++i)
      out.push_back({corners[0], corners[i], corners[i + 1]});
    return;
  }
  EarClipper(points, normal).clip([&](std::size_t a, std::size_t b, std::size_t c) {
    out.push_back({corners[a], corners[b], corners[c]});
  });
}

Triangles triangulate(const PolygonMesh& mesh) {
  Triangles triangles;
  triangles.reserve(mesh.corners.size() - 2 * mesh.ends.size());
  std::size_t begin = 0;
  for (const std::size_t end : mesh.ends) {
    triangulate_polygon(mesh.vertices, mesh.corners.data() + begin, end - begin, triangles);
    begin = end;
  }
  return triangles;
}

}  // namespace ist
