// Formulas of the part of a ball inside a triangle, for lanes of the CPU and threads of the GPU.
// The file that includes it defines `Real`, a number or lanes of numbers, with constant(),
// negated(), root(), lesser() and greater(); where_positive(x, y), which is y where x > 0 and 1
// elsewhere; and IST_FORMULA, which goes before a function.

/// The axes of a triangle's plane: u along the first edge, n the outward normal.
struct PlaneFrame {
  Real u[3], v[3], n[3];
  Real length[3];             ///< of the edges
  Real edge_x[3], edge_y[3];  ///< their directions
  Real area, apex_x, apex_y;  ///< twice the area; the third corner
};

/// `e`, `f`: from the first corner to the others.
IST_FORMULA void frame_of(const Real (&e)[3], const Real (&f)[3], PlaneFrame& out) {
  const Real cross[3] = {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2],
                         e[0] * f[1] - e[1] * f[0]};
  out.area = root((cross[0] * cross[0] + cross[1] * cross[1]) + cross[2] * cross[2]);
  const Real base = root((e[0] * e[0] + e[1] * e[1]) + e[2] * e[2]), one = constant(1.0);
  const Real per_area = one / where_positive(out.area, out.area);
  const Real per_base = one / where_positive(out.area, base);
  for (int k = 0; k < 3; ++k) {
    out.u[k] = e[k] * per_base;
    out.n[k] = cross[k] * per_area;
  }
  const Real(&u)[3] = out.u, (&n)[3] = out.n;
  out.v[0] = n[1] * u[2] - n[2] * u[1];
  out.v[1] = n[2] * u[0] - n[0] * u[2];
  out.v[2] = n[0] * u[1] - n[1] * u[0];
  out.apex_x = (f[0] * u[0] + f[1] * u[1]) + f[2] * u[2];
  out.apex_y = out.area * per_base;
  out.length[0] = base;
  out.edge_x[0] = one;
  out.edge_y[0] = constant(0.0);
  for (int k = 1; k < 3; ++k) {
    const Real x = k == 1 ? out.apex_x - base : negated(out.apex_x);
    const Real y = k == 1 ? out.apex_y : negated(out.apex_y);
    out.length[k] = root(x * x + y * y);
    const Real per_length = one / where_positive(out.area, out.length[k]);
    out.edge_x[k] = x * per_length;
    out.edge_y[k] = y * per_length;
  }
}

/// A triangle inside a ball: volume of its cones, solid angle, area, and ∫ (r² − |y − centre|²) dA.
struct DiscPart {
  Real cones, angle, area, second;
};

/// The disc in which a plane at height h cuts a ball of radius r.
struct DiscShape {
  Real h, r, rho2;
  DiscPart sector;  ///< of one radian
};

IST_FORMULA DiscShape disc_shape(Real h, Real r) {
  const Real cap = r - h, rho2 = cap * (r + h);
  // (r − h)² (2r + h) / 6: no difference of like numbers.
  return {h,
          r,
          rho2,
          {constant(1.0 / 6) * (cap * cap) * (r + (r + h)), cap / r, constant(0.5) * rho2,
           constant(0.25) * (rho2 * rho2)}};
}

IST_FORMULA void add_sector(const DiscShape& disc, Real phi, DiscPart& sum) {
  sum.cones = sum.cones + phi * disc.sector.cones;
  sum.angle = sum.angle + phi * disc.sector.angle;
  sum.area = sum.area + phi * disc.sector.area;
  sum.second = sum.second + phi * disc.sector.second;
}

/// Adds the triangle of the foot and the points `low` and `high` along an edge at distance m, which
/// the centre sees under the solid angle `omega`.
IST_FORMULA void add_triangle(const DiscShape& disc, Real omega, Real m, Real low, Real high,
                              DiscPart& sum) {
  const Real cross = m * (high - low), area = constant(0.5) * cross;
  const Real spread = constant(1.0 / 12) * cross *
                      ((low * low + low * high) + (high * high + constant(3.0) * (m * m)));
  sum.cones = sum.cones + constant(1.0 / 3) * (disc.r * (disc.r * disc.r) * omega - disc.h * area);
  sum.angle = sum.angle + omega;
  sum.area = sum.area + area;
  sum.second = sum.second + (disc.rho2 * area - spread);
}

/// The part of an edge in the disc, and two angles as points (x, y): the sum of both sectors beside
/// this part, and half the solid angle of the triangle between it and the foot.
struct EdgeInDisc {
  Real low, high;
  Real sectors_x, sectors_y, half_x, half_y;
};

/// `m`: the signed distance of the edge from the foot, positive if the foot is within.
IST_FORMULA EdgeInDisc edge_in_disc(const DiscShape& disc, Real m, Real begin, Real end) {
  const Real m2 = m * m;
  const Real half = root(greater(disc.rho2 - m2, constant(0.0)));
  const Real low = lesser(greater(negated(half), begin), end);
  const Real high = lesser(greater(half, begin), end);
  const Real x1 = m2 + begin * low, y1 = m * (low - begin);
  const Real x2 = m2 + high * end, y2 = m * (end - high);
  const Real flat = m2 + disc.h * disc.h;
  const Real a = root(low * low + flat), b = root(high * high + flat);
  return {low,
          high,
          x1 * x2 - y1 * y2,
          x1 * y2 + y1 * x2,
          (a * b + disc.h * (a + b)) + (low * high + flat),
          m * (high - low)};
}
