#include "query/probe/surface_distance.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace ist {
namespace {

using Eigen::Vector3d;

/// Depth first, nearest ball first.
class NearestSearch {
 public:
  NearestSearch(const SurfaceTree& surface, const double (&x)[3], double limit)
      : surface_(surface), x_(x), at_(x[0], x[1], x[2]), best_{limit, {}} {}

  NearestSurface run() {
    if (surface_.top == 0) {
      open_block(0);
    } else {
      open(surface_.top, 0);
    }
    return best_;
  }

 private:
  void open(int level, std::uint32_t block) {
    const BallBlock& balls = surface_.level[level].balls[block];
    const Origin& origin = surface_.level[level].origins[block];
    const std::uint32_t below = surface_.level[level - 1].count;
    struct Child {
      double gap;
      std::uint32_t block;
    } children[kWidth];
    std::uint32_t count = 0;
    for (std::uint32_t lane = 0; lane < kWidth && kWidth * block + lane < below; ++lane) {
      const Vector3d centre(origin.x + static_cast<double>(balls.x[lane]),
                            origin.y + static_cast<double>(balls.y[lane]),
                            origin.z + static_cast<double>(balls.z[lane]));
      Child child{(centre - at_).norm() - static_cast<double>(balls.r[lane]),
                  kWidth * block + lane};
      if (child.gap >= best_.distance) continue;
      std::uint32_t place = count++;
      for (; place > 0 && children[place - 1].gap > child.gap; --place)
        children[place] = children[place - 1];
      children[place] = child;
    }
    for (std::uint32_t i = 0; i < count && children[i].gap < best_.distance; ++i) {
      if (level == 1) {
        open_block(children[i].block);
      } else {
        open(level - 1, children[i].block);
      }
    }
  }

  void open_block(std::uint32_t block) {
    for (std::uint32_t lane = 0; lane < surface_.blocks[block].triangles; ++lane) {
      double corner[3][3];
      for (int k = 0; k < 3; ++k) {
        float p[3];
        surface_.corner(block, lane, k, p);
        for (int i = 0; i < 3; ++i) corner[k][i] = static_cast<double>(p[i]);
      }
      double point[3];
      const double d2 = nearest_in_triangle(x_, corner[0], corner[1], corner[2], point);
      if (d2 >= best_.distance * best_.distance) continue;
      best_.distance = std::sqrt(d2);
      std::copy(point, point + 3, best_.point);
    }
  }

  const SurfaceTree& surface_;
  const double (&x_)[3];
  const Vector3d at_;
  NearestSurface best_;
};

}  // namespace

double nearest_in_triangle(const double (&x)[3], const double (&a)[3], const double (&b)[3],
                           const double (&c)[3], double (&point)[3]) noexcept {
  // By the regions of Voronoi of corners, edges and inside (Ericson, Real-Time Collision
  // Detection).
  const Vector3d p(x[0], x[1], x[2]), A(a[0], a[1], a[2]), B(b[0], b[1], b[2]), C(c[0], c[1], c[2]);
  const Vector3d ab = B - A, ac = C - A, ap = p - A;
  Vector3d nearest;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  const Vector3d bp = p - B;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  const Vector3d cp = p - C;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  if (d1 <= 0 && d2 <= 0) {
    nearest = A;
  } else if (d3 >= 0 && d4 <= d3) {
    nearest = B;
  } else if (d6 >= 0 && d5 <= d6) {
    nearest = C;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    nearest = A + d1 / (d1 - d3) * ab;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    nearest = A + d2 / (d2 - d6) * ac;
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    nearest = B + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (C - B);
  } else {
    const double sum = va + vb + vc;
    nearest = sum > 0 ? Vector3d(A + vb / sum * ab + vc / sum * ac) : A;
  }
  for (int k = 0; k < 3; ++k) point[k] = nearest[k];
  return (nearest - p).squaredNorm();
}

NearestSurface nearest_surface(const SurfaceTree& surface, const double (&x)[3],
                               double limit) noexcept {
  return NearestSearch(surface, x, limit).run();
}

}  // namespace ist
