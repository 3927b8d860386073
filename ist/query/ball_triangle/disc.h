#pragma once

#include <cmath>

#include "base/elementary.h"
#include "base/host_device.h"
#include "base/vec3.h"
#include "query/asset/shared_constants.h"

// The part of a ball inside a triangle, for host and device. On the GPU a thread sums a whole ball,
// one triangle at a time; on the CPU add_patch() (query/ball_triangle/patch_sums.h) classifies
// discs by it before it sums them in vectors.

namespace ist {

namespace disc {

using Real = double;
IST_HD inline double constant(double x) { return x; }
IST_HD inline double negated(double x) { return -x; }
IST_HD inline double root(double x) { return std::sqrt(x); }
IST_HD inline double lesser(double x, double y) { return least(x, y); }
IST_HD inline double greater(double x, double y) { return most(x, y); }
IST_HD inline double where_positive(double x, double y) { return x > 0 ? y : 1; }

#define IST_FORMULA IST_HD inline
#include "query/ball_triangle/disc_formulas-inl.h"
#undef IST_FORMULA

}  // namespace disc

using disc::DiscPart;

/// Bound, in radii, on how far a ball whose centre lies on an edge is moved off it.
inline constexpr double kMoved = 0x1p-10;

IST_HD inline void move_away(double r, double (&at)[3]) {
  for (int k = 0; k < 3; ++k) at[k] += moved_along(k) * r;
}

struct TrianglePlane : disc::PlaneFrame {
  double corner[3];  ///< the first
  bool flat;         ///< degenerate: skip it, as it has no plane

  IST_HD explicit TrianglePlane(const double (&c)[3][3]) {
    double e[3], f[3];
    for (int k = 0; k < 3; ++k) {
      corner[k] = c[0][k];
      e[k] = c[1][k] - c[0][k];
      f[k] = c[2][k] - c[0][k];
    }
    frame_of(e, f, *this);
    flat = !(area > 0);
  }

  /// Height over the plane, and the foot in it.
  IST_HD void feet(const double (&x)[3], double& height, double& fx, double& fy) const {
    const double p[3] = {x[0] - corner[0], x[1] - corner[1], x[2] - corner[2]};
    height = dot(p, n);
    fx = dot(p, u);
    fy = dot(p, v);
  }
};

/// The disc in which a triangle's plane cuts a ball, relative to the triangle.
enum class DiscKind {
  apart,  ///< outside, or there is no disc
  whole,  ///< inside
  cut     ///< crossed by edges
};

/// A ball over a triangle's plane.
class Disc {
 public:
  IST_HD Disc(const TrianglePlane& t, const double (&x)[3], double r) : r_(r) {
    double fx, fy;
    t.feet(x, height_, fx, fy);
    place(t.length, t.edge_x, t.edge_y, fx, fy);
  }
  IST_HD Disc(double height, double x, double y, double r, const double (&length)[3],
              const double (&edge_x)[3], const double (&edge_y)[3])
      : r_(r), height_(height) {
    place(length, edge_x, edge_y, x, y);
  }

  /// True if the centre is so close to an edge that rounding decides its side of the triangle:
  /// cones and angle are meaningless then.
  IST_HD bool on_edge() const {
    const double m2 =
        least(least(edge_[0].m * edge_[0].m, edge_[1].m * edge_[1].m), edge_[2].m * edge_[2].m);
    return m2 + h_ * h_ < kOnEdge2 * (r_ * r_);
  }

  struct Crossings {
    unsigned through = 0;     ///< a bit for each edge that cuts the disc from side to side
    bool has_corner = false;  ///< the disc contains a corner
    bool is_outside = false;  ///< the foot is outside the triangle
    bool is_apart = false;    ///< the whole disc is beyond an edge
  };
  IST_HD Crossings crossings() const {
    Crossings found;
    for (unsigned k = 0; k < 3; ++k) {
      const Edge& e = edge_[k];
      const double m2 = e.m * e.m;
      found.is_outside = found.is_outside || e.m < 0;
      if (m2 >= rho2_) {
        found.is_apart = found.is_apart || e.m < 0;
        continue;
      }
      const double half2 = rho2_ - m2;
      const bool begins = e.begin * e.begin < half2, ends = e.end * e.end < half2;
      const bool across = e.begin < 0 && !begins && e.end > 0 && !ends;
      found.through |= across ? 1u << k : 0;
      found.has_corner = found.has_corner || begins || ends;
    }
    return found;
  }

  IST_HD DiscKind kind() const {
    if (!(h_ < r_)) return DiscKind::apart;
    const Crossings found = crossings();
    if (found.is_apart) return DiscKind::apart;
    if (found.through != 0 || found.has_corner) return DiscKind::cut;
    return found.is_outside ? DiscKind::apart : DiscKind::whole;
  }

  /// Cones and angle are positive if the triangle is seen from outside.
  IST_HD DiscPart part() const {
    const DiscKind is = kind();
    if (is == DiscKind::apart) return {0, 0, 0, 0};
    return is == DiscKind::cut ? within_edges() : whole();
  }

  IST_HD DiscPart whole() const {
    constexpr double kTurn = 2 * 3.141592653589793;
    const DiscPart sector = disc::disc_shape(h_, r_).sector;
    const double sign = height_ > 0 ? 1 : -1;
    return {sign * (kTurn * sector.cones), sign * (kTurn * sector.angle), kTurn * sector.area,
            kTurn * sector.second};
  }

  /// Sums, over the edges, the part between the edge and the foot.
  IST_HD DiscPart within_edges() const {
    DiscPart sum = {0, 0, 0, 0};
    const disc::DiscShape shape = disc::disc_shape(h_, r_);
    IST_ROLLED
    for (int k = 0; k < 3; ++k) {
      const Edge e = edge(k);
      const disc::EdgeInDisc in = disc::edge_in_disc(shape, e.m, e.begin, e.end);
      // A loop keeps one copy of angle_of() in the kernel's code.
      double sectors = 0, omega = 0;
      IST_ROLLED
      for (int seen = 0; seen < 2; ++seen) {
        const double angle =
            angle_of(seen != 0 ? in.half_y : in.sectors_y, seen != 0 ? in.half_x : in.sectors_x);
        sectors = seen != 0 ? sectors : angle;
        omega = 2 * angle;
      }
      disc::add_sector(shape, sectors, sum);
      disc::add_triangle(shape, omega, e.m, in.low, in.high, sum);
    }
    if (!(height_ > 0)) {
      sum.cones = -sum.cones;
      sum.angle = -sum.angle;
    }
    return sum;
  }

  IST_HD double height() const { return height_; }
  /// The signed distance of an edge from the foot, positive if the foot is within.
  IST_HD double distance(int k) const { return edge(k).m; }

 private:
  struct Edge {
    double m, begin, end;
  };

  IST_HD void place(const double (&length)[3], const double (&edge_x)[3], const double (&edge_y)[3],
                    double x, double y) {
    h_ = std::fabs(height_);
    rho2_ = (r_ - h_) * (r_ + h_);
    const double px = length[0] - x;
    const double t1 = px * edge_x[1] - y * edge_y[1], t2 = -(x * edge_x[2] + y * edge_y[2]);
    edge_[0] = {y, -x, px};
    edge_[1] = {px * edge_y[1] + y * edge_x[1], t1, t1 + length[1]};
    edge_[2] = {y * edge_x[2] - x * edge_y[2], t2 - length[2], t2};
  }

  /// Selects without indexing, since registers cannot be indexed.
  IST_HD Edge edge(int k) const { return k == 0 ? edge_[0] : k == 1 ? edge_[1] : edge_[2]; }

  double r_, height_, h_, rho2_;
  Edge edge_[3];
};

}  // namespace ist
