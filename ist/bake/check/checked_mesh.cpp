#include "bake/check/checked_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace ist {
namespace {

constexpr std::uint32_t kLeaf = 6;

double squared_distance_to_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                   const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length = ab.squaredNorm();
  const double t = length > 0 ? std::clamp((p - a).dot(ab) / length, 0.0, 1.0) : 0.0;
  return (p - (a + t * ab)).squaredNorm();
}

/// An orthonormal frame whose third axis is the ray.
const std::array<Eigen::Vector3d, 3>& ray_frame() {
  static const std::array<Eigen::Vector3d, 3> frame = [] {
    const Eigen::Vector3d ray = Eigen::Vector3d(0.41421356, -0.31830989, 0.85271871).normalized();
    const Eigen::Vector3d first = ray.cross(Eigen::Vector3d(0.3, 0.9, -0.2)).normalized();
    return std::array<Eigen::Vector3d, 3>{first, ray.cross(first), ray};
  }();
  return frame;
}

/// Sign of a determinant whose rounding error stays below 1e-14 of its products; 0 if undecided.
int certain_sign(double determinant, double magnitude) {
  if (std::abs(determinant) <= 1e-14 * magnitude) return 0;
  return determinant > 0 ? 1 : -1;
}

bool ray_meets(const Eigen::Vector3d& p, const Eigen::AlignedBox3d& box) {
  double enter = 0;
  double leave = 1e30;
  for (int k = 0; k < 3; ++k) {
    const double inverse = 1 / ray_frame()[2][k];
    const double a = (box.min()[k] - 1e-9 - p[k]) * inverse;
    const double b = (box.max()[k] + 1e-9 - p[k]) * inverse;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

enum class Hit { no, front, back, open };

/// Determines whether the ray from p leaves (front) or enters (back) through a triangle.
Hit cross(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& triangle) {
  std::array<Eigen::Vector3d, 3> t;  // in the ray's frame, p at the origin
  double size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d d = triangle[k] - p;
    t[k] = {d.dot(ray_frame()[0]), d.dot(ray_frame()[1]), d.dot(ray_frame()[2])};
    size = std::max(size, d.lpNorm<1>());
  }
  bool left = true;   // the ray is, or may be, left of every edge
  bool right = true;  // it is, or may be, right of every edge
  bool certain = true;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& a = t[k];
    const Eigen::Vector3d& b = t[(k + 1) % 3];
    const int sign = certain_sign(a.x() * b.y() - a.y() * b.x(), size * size);
    left &= sign >= 0;
    right &= sign <= 0;
    certain &= sign != 0;
  }
  if (!left && !right) return Hit::no;
  if (t[0].z() < -1e-14 * size && t[1].z() < -1e-14 * size && t[2].z() < -1e-14 * size)
    return Hit::no;
  if (!certain) return Hit::open;
  // Volume of (p, a, b, c): it has the edges' sign if the triangle is ahead of p.
  const int side = certain_sign(t[0].dot(t[1].cross(t[2])), size * size * size);
  if (side == 0) return Hit::open;
  if (left) return side > 0 ? Hit::front : Hit::no;
  return side < 0 ? Hit::back : Hit::no;
}

/// The edges, and the foot of the perpendicular if that lies inside. Every candidate is a point of
/// the triangle, so that a sliver's inaccurate normal cannot make the distance too small.
double squared_distance_to_triangle(const Eigen::Vector3d& p, const CheckedMesh::Corners& t) {
  double best = std::min({squared_distance_to_segment(p, t[0], t[1]),
                          squared_distance_to_segment(p, t[1], t[2]),
                          squared_distance_to_segment(p, t[2], t[0])});
  const Eigen::Vector3d u = t[1] - t[0];
  const Eigen::Vector3d v = t[2] - t[0];
  const Eigen::Vector3d w = p - t[0];
  const Eigen::Vector3d n = u.cross(v);
  const double area = n.squaredNorm();
  if (area > 0) {
    const double beta = w.cross(v).dot(n) / area;
    const double gamma = u.cross(w).dot(n) / area;
    if (beta >= 0 && gamma >= 0 && beta + gamma <= 1)
      best = std::min(best, (w - (beta * u + gamma * v)).squaredNorm());
  }
  return best;
}

}  // namespace

CheckedMesh::CheckedMesh(const ClosedMesh& mesh, const UnitFrame& frame) {
  triangles_.reserve(mesh.mesh.triangles.size());
  for (const auto& triangle : mesh.mesh.triangles) {
    Corners corners;
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = frame.to_unit(mesh.mesh.vertices[triangle[k]]);
      bounds_.extend(corners[k]);
    }
    triangles_.push_back(corners);
  }
  build(0, static_cast<std::uint32_t>(triangles_.size()));
}

void CheckedMesh::build(std::uint32_t begin, std::uint32_t end) {
  const std::size_t self = nodes_.size();
  nodes_.emplace_back();
  nodes_[self].begin = begin;
  nodes_[self].end = end;
  for (std::uint32_t i = begin; i < end; ++i)
    for (const Eigen::Vector3d& corner : triangles_[i]) nodes_[self].box.extend(corner);
  if (end - begin <= kLeaf) return;
  int axis = 0;
  nodes_[self].box.sizes().maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  const auto centre = [axis](const Corners& t) { return t[0][axis] + t[1][axis] + t[2][axis]; };
  std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle,
                   triangles_.begin() + end,
                   [&](const Corners& a, const Corners& b) { return centre(a) < centre(b); });
  build(begin, middle);
  nodes_[self].right = static_cast<std::uint32_t>(nodes_.size());
  build(middle, end);
}

double CheckedMesh::distance(const Eigen::Vector3d& p, double limit) const {
  double best = limit * limit;
  struct Entry {
    std::uint32_t node;
    double squared;
  };
  std::array<Entry, 64> stack;  // the tree is balanced: depth ≤ 32
  std::size_t size = 0;
  stack[size++] = {0, nodes_[0].box.squaredExteriorDistance(p)};
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= best) continue;
    const Node& node = nodes_[entry.node];
    if (node.right == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i)
        best = std::min(best, squared_distance_to_triangle(p, triangles_[i]));
      continue;
    }
    Entry near = {entry.node + 1, nodes_[entry.node + 1].box.squaredExteriorDistance(p)};
    Entry far = {node.right, nodes_[node.right].box.squaredExteriorDistance(p)};
    if (far.squared < near.squared) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return std::sqrt(best);
}

int CheckedMesh::winding(const Eigen::Vector3d& p) const {
  int winding = 0;
  std::array<std::uint32_t, 64> stack;
  std::size_t size = 0;
  stack[size++] = 0;
  while (size > 0) {
    const std::uint32_t index = stack[--size];
    const Node& node = nodes_[index];
    if (!ray_meets(p, node.box)) continue;
    if (node.right != 0) {
      stack[size++] = index + 1;
      stack[size++] = node.right;
      continue;
    }
    for (std::uint32_t i = node.begin; i < node.end; ++i) {
      switch (cross(p, triangles_[i])) {
        case Hit::front:
          ++winding;
          break;
        case Hit::back:
          --winding;
          break;
        case Hit::open:
          return winding_by_solid_angle(p);
        case Hit::no:
          break;
      }
    }
  }
  return winding;
}

// Van Oosterom and Strackee, "The solid angle of a plane triangle" (1983).
int CheckedMesh::winding_by_solid_angle(const Eigen::Vector3d& p) const {
  double sum = 0;
  for (const Corners& t : triangles_) {
    const Eigen::Vector3d a = t[0] - p;
    const Eigen::Vector3d b = t[1] - p;
    const Eigen::Vector3d c = t[2] - p;
    const double la = a.norm();
    const double lb = b.norm();
    const double lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)),
                          la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return static_cast<int>(std::lround(sum / (4 * std::numbers::pi)));
}

}  // namespace ist
