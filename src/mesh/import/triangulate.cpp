
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

/// 1 for an equilateral triangle, 0 for a flat one, negative if it turns against the normal.
double roundness(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                 const Eigen::Vector3d& normal) {
  const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return sides > 0 ? turn(a, b, c, normal) / (sides * normal.norm()) : 0;
}

/// Clips ears in quadratic time, whatever the polygon.
class EarClipper {
 public:
  EarClipper(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& normal)
      : points_(points), normal_(normal), left_(points.size()), corners_(points.size()) {
    for (std::size_t i = 0; i < left_.size(); ++i) left_[i] = i;
    for (std::size_t i = 0; i < left_.size(); ++i) look_at(i);
  }

  /// Cuts the best ear until a triangle is left. If the polygon intersects itself, no proper ear
  /// may remain: then the least bad corner is cut, so that every side of the polygon keeps its
  /// triangle.
  template <class Emit>
  void clip(const Emit& emit) {
    while (left_.size() > 3) {
      std::size_t best = 0;
      for (std::size_t i = 1; i < left_.size(); ++i)
        if (quality(left_[i]) > quality(left_[best])) best = i;
      const std::size_t cut = left_[best];
      emit(corners_[cut].before, cut, corners_[cut].after);
      left_.erase(left_.begin() + static_cast<std::ptrdiff_t>(best));
      corners_[cut].is_cut = true;
      const std::size_t n = left_.size();
      look_at((best + n - 1) % n);
      look_at(best % n);
      for (const std::size_t k : left_)
        if (corners_[k].blocked_by == cut) find_blocker(k);
    }
    emit(left_[0], left_[1], left_[2]);
  }

 private:
  static constexpr std::size_t kNobody = SIZE_MAX;

  struct Corner {
    std::size_t before = 0, after = 0;  ///< its neighbours
    double roundness = 0;               ///< of the ear between them
    std::size_t blocked_by = kNobody;   ///< the first point that lies in the ear
    bool is_cut = false;
  };

  double quality(std::size_t k) const {
    const Corner& corner = corners_[k];
    return corner.blocked_by == kNobody ? corner.roundness : corner.roundness - 1;
  }

  /// Updates the corner at index i, whose neighbours have changed.
  void look_at(std::size_t i) {
    const std::size_t n = left_.size(), k = left_[i];
    Corner& corner = corners_[k];
    corner.before = left_[(i + n - 1) % n];
    corner.after = left_[(i + 1) % n];
    corner.roundness =
        roundness(points_[corner.before], points_[k], points_[corner.after], normal_);
    corner.blocked_by = kNobody;
    if (corner.roundness > 0) find_blocker(k);
  }

  /// Points before a blocker that was cut do not lie in the ear, so the search continues from
  /// there.
  void find_blocker(std::size_t k) {
    Corner& corner = corners_[k];
    const Eigen::Vector3d &a = points_[corner.before], &b = points_[k], &c = points_[corner.after];
    std::size_t i = corner.blocked_by == kNobody ? 0 : corner.blocked_by + 1;
    corner.blocked_by = kNobody;
    for (; i < points_.size(); ++i) {
      const Eigen::Vector3d& p = points_[i];
      if (corners_[i].is_cut || p == a || p == b || p == c) continue;
      if (turn(a, b, p, normal_) >= 0 && turn(b, c, p, normal_) >= 0 &&
          turn(c, a, p, normal_) >= 0) {
        corner.blocked_by = i;
        return;
      }
    }
  }

  const std::vector<Eigen::Vector3d>& points_;
  const Eigen::Vector3d normal_;
  std::vector<std::size_t> left_;
  std::vector<Corner> corners_;  ///< by point
};

}  // namespace

void triangulate_polygon(const std::vector<Eigen::Vector3d>& vertices, const std::uint32_t* corners,
                         std::size_t count, Triangles& out) {
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
  // Without a normal (a flat or unreadable polygon) any diagonal is equally good.
  const bool has_normal = normal.squaredNorm() > 0;
  // Ear clipping takes quadratic time, so a huge polygon becomes a fan.
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

Triangles triangulate(PolygonMesh& mesh) {
  if (!mesh.triangles.empty()) return std::move(mesh.triangles);
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
