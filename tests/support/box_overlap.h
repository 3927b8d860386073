#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace ist::testing {

/// A box at any orientation: centre, half-extents, columns of `axes` its unit edges.
struct OrientedBox {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Ones();
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

/// A convex solid as its faces, each a polygon wound counter-clockwise seen from outside.
using ConvexSolid = std::vector<std::vector<Eigen::Vector3d>>;

inline ConvexSolid faces_of(const OrientedBox& box) {
  ConvexSolid solid;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d n = side * box.half[axis] * box.axes.col(axis);
      const int next = (axis + 1) % 3, last = (axis + 2) % 3;
      const Eigen::Vector3d u = box.half[next] * box.axes.col(next);
      const Eigen::Vector3d v = side * box.half[last] * box.axes.col(last);
      const Eigen::Vector3d c = box.centre + n;
      solid.push_back({c - u - v, c + u - v, c + u + v, c - u + v});
    }
  return solid;
}

/// The part of the solid with n · x ≤ offset: every face is cut, and a fan about the cut's first
/// corner closes the cut.
inline ConvexSolid clipped(const ConvexSolid& solid, const Eigen::Vector3d& n, double offset) {
  ConvexSolid kept;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rim;  // edges along the cut
  for (const auto& face : solid) {
    std::vector<Eigen::Vector3d> polygon;
    Eigen::Vector3d leaves = n, enters = n;
    bool cut = false;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Eigen::Vector3d& p = face[i];
      const Eigen::Vector3d& q = face[(i + 1) % face.size()];
      const double dp = n.dot(p) - offset, dq = n.dot(q) - offset;
      if (dp <= 0) polygon.push_back(p);
      if ((dp <= 0) != (dq <= 0)) {
        const Eigen::Vector3d x = p + (q - p) * (dp / (dp - dq));
        polygon.push_back(x);
        (dp <= 0 ? leaves : enters) = x;
        cut = true;
      }
    }
    if (polygon.size() >= 3) kept.push_back(polygon);
    if (cut) rim.emplace_back(enters, leaves);
  }
  for (const auto& [from, to] : rim) kept.push_back({rim.front().first, from, to});
  return kept;
}

/// Volume by the divergence theorem.
inline double volume_of(const ConvexSolid& solid) {
  if (solid.empty()) return 0;
  const Eigen::Vector3d base = solid.front().front();
  double sum = 0;
  for (const auto& face : solid)
    for (std::size_t i = 2; i < face.size(); ++i)
      sum += (face[0] - base).dot((face[i - 1] - base).cross(face[i] - base));
  return sum / 6;
}

/// Exact volume of the overlap of two boxes, by clipping one at the other's six planes.
inline double overlap_volume(const OrientedBox& a, const OrientedBox& b) {
  ConvexSolid solid = faces_of(b);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d n = side * a.axes.col(axis);
      solid = clipped(solid, n, n.dot(a.centre) + a.half[axis]);
    }
  return volume_of(solid);
}

}  // namespace ist::testing
