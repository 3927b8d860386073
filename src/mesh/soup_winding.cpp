#include "mesh/soup_winding.h"

#include <algorithm>
#include <cmath>

#include "mesh/closest_point.h"
#include "mesh/exact_triangle.h"
#include "numerics/angle.h"

namespace ist {
namespace {

constexpr double kFullAngle = 12.566370614359172;  ///< 4π
constexpr double kFar = 3;  ///< distance of what counts together over its radius

/// Signed solid angle of a triangle, positive where p sees its back (van Oosterom & Strackee).
double solid_angle(const Corners& t, const double p[3]) {
  double v[3][3], length[3];
  for (int c = 0; c < 3; ++c) {
    for (int k = 0; k < 3; ++k) v[c][k] = t.p[c][k] - p[k];
    length[c] = std::sqrt(v[c][0] * v[c][0] + v[c][1] * v[c][1] + v[c][2] * v[c][2]);
  }
  const auto dot = [&](int a, int b) {
    return v[a][0] * v[b][0] + v[a][1] * v[b][1] + v[a][2] * v[b][2];
  };
  const double volume = v[0][0] * (v[1][1] * v[2][2] - v[1][2] * v[2][1]) -
                        v[0][1] * (v[1][0] * v[2][2] - v[1][2] * v[2][0]) +
                        v[0][2] * (v[1][0] * v[2][1] - v[1][1] * v[2][0]);
  return 2 * angle_of(volume, length[0] * length[1] * length[2] + dot(0, 1) * length[2] +
                                  dot(1, 2) * length[0] + dot(2, 0) * length[1]);
}

}  // namespace

SoupWinding::SoupWinding(const MeshView& mesh) : mesh_(mesh) {
  if (mesh.root == kBvhEmpty || (mesh.root & kBvhLeaf) != 0) return;
  BvhNode around = {};
  far_of(mesh.root, around, 0);
}

SoupWinding::Far SoupWinding::far_of_block(std::uint32_t block) const {
  Far far;
  double centroid[kBvhWidth][3], normal[kBvhWidth][3];
  int count = 0;
  for (const std::uint32_t triangle : mesh_.blocks[block].triangle) {
    if (triangle == kNoTriangle) continue;
    const Corners t = corners_of(mesh_, triangle);
    double a[3], b[3];
    for (int k = 0; k < 3; ++k) {
      a[k] = t.p[1][k] - t.p[0][k];
      b[k] = t.p[2][k] - t.p[0][k];
      centroid[count][k] = (t.p[0][k] + t.p[1][k] + t.p[2][k]) / 3;
    }
    double squares = 0;
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      normal[count][k] = (a[i] * b[j] - a[j] * b[i]) / 2;
      squares += normal[count][k] * normal[count][k];
    }
    const double area = std::sqrt(squares);
    far.area += area;
    for (int k = 0; k < 3; ++k) far.centre[k] += area * centroid[count][k];
    ++count;
  }
  for (double& x : far.centre) x = far.area > 0 ? x / far.area : 0;
  for (int t = 0; t < count; ++t)
    for (int i = 0; i < 3; ++i) {
      far.dipole[i] += normal[t][i];
      for (int j = 0; j < 3; ++j)
        far.second[3 * i + j] += normal[t][i] * (centroid[t][j] - far.centre[j]);
    }
  return far;
}

/// `place`: which child of `parent` it is; the parent's box bounds it.
SoupWinding::Far SoupWinding::far_of(std::uint32_t child, const BvhNode& parent, int place) {
  Far far;
  if ((child & kBvhLeaf) != 0) {
    far = far_of_block(child & ~kBvhLeaf);
  } else {
    const BvhNode& node = mesh_.nodes[child];
    std::array<Far, kBvhWidth> below;
    for (int i = 0; i < kBvhWidth; ++i) {
      if (node.child[i] == kBvhEmpty) continue;
      const Far& part = below[static_cast<std::size_t>(i)] = far_of(node.child[i], node, i);
      far.area += part.area;
      for (int k = 0; k < 3; ++k) far.centre[k] += part.area * part.centre[k];
    }
    for (double& x : far.centre) x = far.area > 0 ? x / far.area : 0;
    for (const Far& part : below)
      for (int i = 0; i < 3; ++i) {
        far.dipole[i] += part.dipole[i];
        for (int j = 0; j < 3; ++j)
          far.second[3 * i + j] +=
              part.second[3 * i + j] + part.dipole[i] * (part.centre[j] - far.centre[j]);
      }
    if (of_children_.size() <= child) of_children_.resize(child + 1);
    of_children_[child] = below;
  }
  double squares = 0;
  for (int k = 0; k < 3; ++k) {
    const double reach = std::max(far.centre[k] - double{parent.lower[k][place]},
                                  double{parent.upper[k][place]} - far.centre[k]);
    squares += reach * reach;
  }
  far.reach2 = kFar * kFar * squares;
  return far;
}

double SoupWinding::at(const double p[3]) const {
  double sum = 0;
  const auto add_block = [&](std::uint32_t block) {
    for (const std::uint32_t triangle : mesh_.blocks[block].triangle)
      if (triangle != kNoTriangle) sum += solid_angle(corners_of(mesh_, triangle), p);
  };
  if (mesh_.root == kBvhEmpty) return 0;
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  stack[top++] = mesh_.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      add_block(at & ~kBvhLeaf);
      continue;
    }
    const BvhNode& node = mesh_.nodes[at];
    for (int i = 0; i < kBvhWidth; ++i) {
      if (node.child[i] == kBvhEmpty) continue;
      const Far& far = of_children_[at][static_cast<std::size_t>(i)];
      const double r[3] = {far.centre[0] - p[0], far.centre[1] - p[1], far.centre[2] - p[2]};
      const double r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
      if (!(r2 > far.reach2)) {
        stack[top++] = node.child[i];
        continue;
      }
      double first = 0, second = 0, trace = 0;
      for (int k = 0; k < 3; ++k) {
        first += far.dipole[k] * r[k];
        trace += far.second[4 * k];
        for (int j = 0; j < 3; ++j) second += r[k] * far.second[3 * k + j] * r[j];
      }
      sum += (first + trace - 3 * second / r2) / (r2 * std::sqrt(r2));
    }
  }
  return sum / kFullAngle;
}

}  // namespace ist
