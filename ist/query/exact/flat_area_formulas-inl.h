// The common area of triangles in one plane, once for lanes of the CPU and for a thread of the GPU,
// in the terms of overlap_formulas-inl.h.

/// Points in the plane of two coordinates, and an edge between two of them.
struct FlatPoint {
  Real x, y;
};
struct FlatEdge {
  Real low, high;  ///< of x
  Real x, y, slope;
  Real turn;  ///< 1 where it goes up in x, -1 where down, 0 where neither
};
IST_FORMULA FlatEdge flat_edge(const FlatPoint& p, const FlatPoint& q) {
  const Real dx = q.x - p.x, zero = constant(0.0), one = constant(1.0);
  const Mask upright = at_most(magnitude(dx), constant(1e-200));
  return {lesser(p.x, q.x),
          greater(p.x, q.x),
          p.x,
          p.y,
          (q.y - p.y) / choose(upright, one, dx),
          choose(upright, zero, choose(less(dx, zero), constant(-1.0), one))};
}
IST_FORMULA Real height_at(const FlatEdge& e, Real where) { return e.y + (where - e.x) * e.slope; }

/// Selects one of three numbers by the largest coordinate of a normal.
struct LargestAxis {
  Mask by_x, by_y;
};
IST_FORMULA Real one_of(const LargestAxis& axis, Real if_x, Real if_y, Real if_z) {
  return choose(axis.by_x, if_x, choose(axis.by_y, if_y, if_z));
}

/// The common area of triangles in one plane.
struct CommonArea {
  Real over_normal;  ///< its area, over the length of A's normal
  Vec3 centre;       ///< seen from A's first corner
};

/// The area that triangles in one plane have in common, over the length of `normal`, A's.
/// A triangle is the signed sum of the areas below its edges, by their direction in x. Two such
/// areas have the integral of the lower edge in common. Terms that depend on one edge alone cancel,
/// which leaves ∫ min(e − f, 0) over the x of both. No point is classified, so edges and corners
/// that coincide need no special case.
IST_FORMULA CommonArea common_area(const Vec3 (&a)[3], const Vec3 (&b)[3], const Vec3& normal) {
  const Real zero = constant(0.0), one = constant(1.0);
  const Real nx = magnitude(normal.x), ny = magnitude(normal.y), nz = magnitude(normal.z);
  const LargestAxis axis = {both(less(ny, nx), less(nz, nx)), less(nz, ny)};
  FlatPoint at[2][3];
  Real low = zero, high = zero, left = zero, right = zero;
  for (int s = 0; s < 2; ++s)
    for (int c = 0; c < 3; ++c) {
      const Vec3 r = (s == 0 ? a[c] : b[c]) - a[0];
      at[s][c] = {one_of(axis, r.y, r.z, r.x), one_of(axis, r.z, r.x, r.y)};
      left = lesser(left, at[s][c].x);
      right = greater(right, at[s][c].x);
      low = lesser(low, at[s][c].y);
      high = greater(high, at[s][c].y);
    }
  Real twice = zero, moment_x = zero, moment_y = zero;
  for (int i = 0; i < 3; ++i) {
    const FlatEdge e = flat_edge(at[0][i], at[0][(i + 1) % 3]);
    for (int j = 0; j < 3; ++j) {
      const FlatEdge f = flat_edge(at[1][j], at[1][(j + 1) % 3]);
      const Real from = greater(e.low, f.low), to = lesser(e.high, f.high);
      // Outside the common range of x nothing is below.
      const Mask over = less(from, to);
      const Real first = choose(over, height_at(e, from) - height_at(f, from), zero),
                 last = choose(over, height_at(e, to) - height_at(f, to), zero);
      const Real below = greater(zero - first, zero) + greater(zero - last, zero);
      const Real whole = magnitude(first) + magnitude(last);
      const Real share = (to - from) / choose(less(zero, whole), whole, one),
                 turn = e.turn * f.turn;
      twice = twice + turn * (share * (below * below));
      // ∫ x (e − f) and ∫ (e² − f²) / 2 between the places where e − f is below 0.
      const Real root = from + share * magnitude(first);
      const Real p = choose(less(first, zero), from, root), q = choose(less(last, zero), to, root);
      const Real dp = lesser(first, zero), dq = lesser(last, zero);
      const Real at_p = (dp + dp) + dq, at_q = dp + (dq + dq), half = constant(0.5);
      const Real mean_p = height_at(f, p) + half * dp, mean_q = height_at(f, q) + half * dq;
      const Real turned = turn * (p - q);
      moment_x = moment_x + turned * (at_p * p + at_q * q);
      moment_y = moment_y + turned * (at_p * mean_p + at_q * mean_q);
    }
  }
  // An area within rounding is 0.
  const Real found = magnitude(twice), least = constant(1e-14) * ((right - left) * (high - low));
  const Real size = one_of(axis, nx, ny, nz);
  const Mask counts = both(less(least, found), less(zero, size));
  const Real divisor = choose(counts, size, one);
  // The sums are six times the moments, and twice the area.
  const Real thrice = constant(3.0) * choose(counts, twice, one);
  const Real x = moment_x / thrice, y = moment_y / thrice;
  // In the plane: the third coordinate is by the normal.
  const Real along_x = one_of(axis, normal.y, normal.z, normal.x),
             along_y = one_of(axis, normal.z, normal.x, normal.y);
  const Real along = one_of(axis, normal.x, normal.y, normal.z);
  const Real z = (zero - (along_x * x + along_y * y)) / choose(counts, along, one);
  return {choose(counts, constant(0.5) * found / divisor, zero),
          {one_of(axis, z, y, x), one_of(axis, x, z, y), one_of(axis, y, x, z)}};
}
