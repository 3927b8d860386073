#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "cuda/query/seen_triangles.h"
#include "query/ball_triangle/disc.h"
#include "support/random_pairs.h"

// Triangles as the GPU's queries see them, in floats: their results must be exactly true.

namespace ist::testing {
namespace {

using Eigen::Vector3d;

struct Triangle {
  float c[3][3];

  void set(int i, const Vector3d& x) {
    for (int k = 0; k < 3; ++k) c[i][k] = static_cast<float>(x[k]);
  }
  Vector3d corner(int i) const { return Vector3d(c[i][0], c[i][1], c[i][2]); }
  void in_double(double (&out)[3][3]) const {
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) out[i][k] = static_cast<double>(c[i][k]);
  }
};

class Random : public RandomPairs {
 public:
  using RandomPairs::RandomPairs;

  bool one_in(int n) { return uniform(0, n) < 1; }
  /// In a ball about the origin.
  Vector3d within(double reach) {
    for (;;) {
      const Vector3d x(uniform(-1, 1), uniform(-1, 1), uniform(-1, 1));
      if (x.norm() <= 1) return reach * x;
    }
  }
  /// Near a point, of any size beside the reach; slivers and flat ones too.
  Triangle triangle(const Vector3d& near, double reach) {
    const double size = reach * std::exp(one_in(4) ? uniform(6, 14) : uniform(-6, 6));
    Triangle out;
    const Vector3d edge = within(size), from = near + within(reach);
    const Vector3d other =
        one_in(3) ? edge * uniform(-1, 1) + within(size * std::exp(uniform(-25, 0))) : within(size);
    const double u = uniform(-0.2, 1.2), v = uniform(-0.2, 1.2);
    const Vector3d first = from - u * edge - v * other;  // the point lies in it, or not far off
    out.set(0, first);
    out.set(1, first + edge);
    out.set(2, one_in(50) ? first + edge : first + other);
    return out;
  }
};

Vector3d closest_point(const Triangle& t, const Vector3d& x) {
  const Vector3d a = t.corner(0), b = t.corner(1), c = t.corner(2);
  const auto on_segment = [&](const Vector3d& p, const Vector3d& q) {
    const double length2 = (q - p).squaredNorm();
    const double s = length2 > 0 ? std::clamp((x - p).dot(q - p) / length2, 0.0, 1.0) : 0.0;
    return (p + s * (q - p)).eval();
  };
  Vector3d best = on_segment(a, b);
  for (const Vector3d& other : {on_segment(b, c), on_segment(c, a)})
    if ((other - x).norm() < (best - x).norm()) best = other;
  const Vector3d n = (b - a).cross(c - a);
  if (n.squaredNorm() == 0) return best;
  const Vector3d foot = x - n * ((x - a).dot(n) / n.squaredNorm());
  const bool within = (b - a).cross(foot - a).dot(n) >= 0 && (c - b).cross(foot - b).dot(n) >= 0 &&
                      (a - c).cross(foot - c).dot(n) >= 0;
  return within ? foot : best;
}

/// Tests all triangles as flat ones.
bool is_flat(const double (&c)[3][3]) {
  double e[3], f[3];
  for (int k = 0; k < 3; ++k) {
    e[k] = c[1][k] - c[0][k];
    f[k] = c[2][k] - c[0][k];
  }
  const double n[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                       e[0] * f[1] - e[1] * f[0]};
  return !((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2] > 0);
}

/// Scales from a reach that is a float's last digits of where it lies to one as large as all.
struct View {
  Vector3d at;
  double reach;
  gpu::SeenTriangles seen;

  explicit View(Random& random)
      : at(random.within(1)), reach(std::exp(random.uniform(std::log(1e-4), 0.5))) {
    const double centre[3] = {at.x(), at.y(), at.z()};
    seen.look_from(centre, reach);
  }
  Triangle triangle(Random& random) {
    const Triangle t = random.triangle(at, reach);
    double c[3][3];
    t.in_double(c);
    seen.see(0, c);
    return t;
  }
  gpu::SeenFrom from(const Vector3d& x) const {
    const double at_x[3] = {x.x(), x.y(), x.z()};
    float p[3];
    seen.seen(at_x, p);
    return seen.from(0, p);
  }
};

TEST(GpuSeenTriangles, NoBallThatMeetsOneIsMissed) {
  Random random(1);
  int met = 0, told = 0;
  for (int i = 0; i < 200000; ++i) {
    View view(random);
    const Triangle t = view.triangle(random);
    Vector3d x = view.at + random.within(1.5 * view.reach);
    const double r = view.reach * std::exp(random.uniform(-5, 0));
    const Vector3d nearest = closest_point(t, x);
    if (i % 2 == 0 && (nearest - view.at).norm() < 1.5 * view.reach)
      x = nearest + random.within(1.5 * r);
    const bool meets = (closest_point(t, x) - x).norm() < r * (1 - 1e-9);
    double c[3][3];
    t.in_double(c);
    const bool flat = is_flat(c);
    const bool says = gpu::SeenTriangles::meets(view.from(x), view.seen.seen_radius(r));
    if (meets && !flat) {
      ASSERT_TRUE(says) << i;
    }
    if (flat) {
      EXPECT_FALSE(says) << i;
    }
    met += meets ? 1 : 0;
    told += says ? 1 : 0;
  }
  std::printf("%d meet, %d may\n", met, told);
  EXPECT_GT(met, 40000);
  EXPECT_LT(told, 1.5 * met);
}

}  // namespace
}  // namespace ist::testing
