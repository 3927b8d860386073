#pragma once

#include <cmath>
#include <cstdint>

#include "base/angle.h"
#include "base/host_device.h"
#include "base/plain.h"
#include "base/vec3.h"
#include "query/asset/shared_constants.h"

// What a triangle does to a ball that meets it: add_patch() (query/ball_triangle/patch_sums.h) for
// one of each, in plain numbers.

namespace ist::gpu {

/// By less than this part of its radius a ball is moved, to be told from beside an edge on which
/// its centre lies.
constexpr double kMoved = 0x1p-10;

IST_HD inline void move_away(double r, double (&at)[3]) {
  at[0] += moved_along(0) * r;
  at[1] += moved_along(1) * r;
  at[2] += moved_along(2) * r;
}

/// A triangle as balls meet it (SurfacePatch): its plane's axes, of which the first runs along the
/// first edge.
struct TrianglePlane {
  double corner[3];  ///< the first
  double u[3], v[3], n[3];
  double length[3];     ///< of the edges
  double ex[3], ey[3];  ///< their directions
  bool flat;            ///< it has no plane: no ball is to meet it

  IST_HD explicit TrianglePlane(const double (&c)[3][3]) {
    double e[3], f[3], normal[3];
    for (int k = 0; k < 3; ++k) {
      corner[k] = c[0][k];
      e[k] = c[1][k] - c[0][k];
      f[k] = c[2][k] - c[0][k];
    }
    cross(e, f, normal);
    const double area = norm(normal), base = norm(e);
    flat = !(area > 0);
    const double per_area = 1 / (flat ? 1 : area), per_base = 1 / (flat ? 1 : base);
    for (int k = 0; k < 3; ++k) {
      u[k] = e[k] * per_base;
      n[k] = normal[k] * per_area;
    }
    cross(n, u, v);
    const double apex_x = dot(f, u), apex_y = area * per_base;
    length[0] = base;
    ex[0] = 1;
    ey[0] = 0;
    set_edge(1, apex_x - base, apex_y, flat);
    set_edge(2, -apex_x, -apex_y, flat);
  }

  /// Height over the plane, and the foot in it.
  IST_HD void feet(const double (&x)[3], double& height, double& fx, double& fy) const {
    const double p[3] = {x[0] - corner[0], x[1] - corner[1], x[2] - corner[2]};
    height = dot(p, n);
    fx = dot(p, u);
    fy = dot(p, v);
  }

 private:
  IST_HD void set_edge(int k, double x, double y, bool flat) {
    length[k] = sqrt(x * x + y * y);
    const double per_length = 1 / (flat ? 1 : length[k]);
    ex[k] = x * per_length;
    ey[k] = y * per_length;
  }
};

/// Of the part of a triangle inside a ball: volume of the cones to the sphere, solid angle, area,
/// and ∫ (r² − |y − centre|²) dA. Cones and angle are positive where it is seen from outside.
struct DiscPart {
  double cones, angle, area, second;
};

/// How the disc in which a triangle's plane cuts a ball lies to the triangle.
enum class DiscKind {
  apart,  ///< the ball misses the triangle
  whole,  ///< inside it
  cut     ///< crossed by edges
};

/// A ball over a triangle's plane.
class Disc {
 public:
  IST_HD Disc(const TrianglePlane& t, const double (&x)[3], double r) : r_(r) {
    t.feet(x, height_, x_, y_);
    h_ = std::fabs(height_);
    rho2_ = (r - h_) * (r + h_);
    const double px = t.length[0] - x_;
    const double t1 = px * t.ex[1] - y_ * t.ey[1], t2 = -(x_ * t.ex[2] + y_ * t.ey[2]);
    edge_[0] = {y_, -x_, px};
    edge_[1] = {px * t.ey[1] + y_ * t.ex[1], t1, t1 + t.length[1]};
    edge_[2] = {y_ * t.ex[2] - x_ * t.ey[2], t2 - t.length[2], t2};
  }

  /// Whether the centre all but lies on an edge: rounding decides from where it sees the triangle,
  /// and cones and angle are worth nothing.
  IST_HD bool on_edge() const {
    const double m2 =
        least(least(edge_[0].m * edge_[0].m, edge_[1].m * edge_[1].m), edge_[2].m * edge_[2].m);
    return m2 + h_ * h_ < kOnEdge2 * (r_ * r_);
  }

  IST_HD DiscKind kind() const {
    if (!(h_ < r_)) return DiscKind::apart;
    bool cut = false, outside = false;
    for (const Edge& e : edge_) {
      const double m2 = e.m * e.m;
      outside = outside || e.m < 0;
      if (m2 >= rho2_) {
        if (e.m < 0) return DiscKind::apart;
        continue;
      }
      const double half2 = rho2_ - m2;
      const bool from_before = e.begin < 0 && e.begin * e.begin >= half2;
      const bool to_behind = e.end > 0 && e.end * e.end >= half2;
      // Across the disc, or with an end in it; else it is beside the disc.
      cut = cut || (from_before && to_behind) || e.begin * e.begin < half2 || e.end * e.end < half2;
    }
    return cut ? DiscKind::cut : outside ? DiscKind::apart : DiscKind::whole;
  }

  IST_HD DiscPart part() const {
    const DiscKind is = kind();
    if (is == DiscKind::apart) return {0, 0, 0, 0};
    return is == DiscKind::cut ? within_edges() : whole();
  }

  IST_HD DiscPart whole() const {
    constexpr double kTurn = 2 * 3.141592653589793;
    const double cap = r_ - h_, sign = height_ > 0 ? 1 : -1;
    return {sign * (kTurn * ((1.0 / 6) * (cap * cap) * (r_ + (r_ + h_)))),
            sign * (kTurn * (cap / r_)), kTurn * (0.5 * rho2_), kTurn * (0.25 * (rho2_ * rho2_))};
  }

  /// Edge by edge, what lies between it and the foot.
  IST_HD DiscPart within_edges() const {
    DiscPart sum = {0, 0, 0, 0};
    const double cap = r_ - h_, h2 = h_ * h_;
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      const Edge e = edge(k);
      const double m2 = e.m * e.m;
      const double half = sqrt(most(rho2_ - m2, 0));
      const double low = least(most(-half, e.begin), e.end);
      const double high = least(most(half, e.begin), e.end);
      // Two sectors as one angle, and half of that under which the triangle between them is seen:
      // in a loop, for angle_of() to stand in the kernel's code once.
      const double x1 = m2 + e.begin * low, y1 = e.m * (low - e.begin);
      const double x2 = m2 + high * e.end, y2 = e.m * (e.end - high);
      const double flat = m2 + h2;
      const double a = sqrt(low * low + flat), b = sqrt(high * high + flat);
      const double cross = e.m * (high - low);
      double phi = 0, omega = 0;
      IST_ROLLED
      for (int seen = 0; seen < 2; ++seen) {
        const double angle =
            angle_of(seen != 0 ? cross : x1 * y2 + y1 * x2,
                     seen != 0 ? (a * b + h_ * (a + b)) + (low * high + flat) : x1 * x2 - y1 * y2);
        phi = seen != 0 ? phi : angle;
        omega = 2 * angle;
      }
      sum.cones += phi * ((1.0 / 6) * (cap * cap) * (r_ + (r_ + h_)));
      sum.angle += phi * (cap / r_);
      sum.area += phi * (0.5 * rho2_);
      sum.second += phi * (0.25 * (rho2_ * rho2_));
      const double area = 0.5 * cross;
      const double spread =
          (1.0 / 12) * cross * ((low * low + low * high) + (high * high + 3.0 * m2));
      sum.cones += (1.0 / 3) * (r_ * (r_ * r_) * omega - h_ * area);
      sum.angle += omega;
      sum.area += area;
      sum.second += rho2_ * area - spread;
    }
    if (!(height_ > 0)) {
      sum.cones = -sum.cones;
      sum.angle = -sum.angle;
    }
    return sum;
  }

 private:
  /// Distance of the foot, positive if it is within, and where the edge begins and ends.
  struct Edge {
    double m, begin, end;
  };

  /// Without an index into registers.
  IST_HD Edge edge(int k) const { return k == 0 ? edge_[0] : k == 1 ? edge_[1] : edge_[2]; }

  double r_, height_, h_, x_, y_, rho2_;
  Edge edge_[3];
};

}  // namespace ist::gpu
