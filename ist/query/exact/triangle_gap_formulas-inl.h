// The nearest points of two triangles, once for lanes of the CPU and for a thread of the GPU: in
// the terms of overlap_formulas-inl.h.

/// a b − c e, rounded about once: products are split.
struct Halves {
  Real whole, high, low;
};
IST_FORMULA Halves halves_of(Real x) {
  const Real big = constant(134217729.0) * x;  // 2^27 + 1
  const Real high = big - (big - x);
  return {x, high, x - high};
}
IST_FORMULA Real rounding_of_product(const Halves& x, const Halves& y, Real product) {
  return ((x.high * y.high - product) + (x.high * y.low + x.low * y.high)) + x.low * y.low;
}
IST_FORMULA Real difference_of_products(const Halves& a, const Halves& b, const Halves& c,
                                        const Halves& e) {
  const Real ab = a.whole * b.whole, ce = c.whole * e.whole;
  return (ab - ce) + (rounding_of_product(a, b, ab) - rounding_of_product(c, e, ce));
}

/// Of a length that is not too small, else 0.
IST_FORMULA Real inverse_of(Real x) {
  const Real one = constant(1.0);
  const Mask long_enough = less(constant(1e-290), x);
  return choose(long_enough, one / choose(long_enough, x, one), constant(0.0));
}

/// A triangle with what its points are found by. Its normal keeps its digits however thin it is: it
/// is that of a triangle whose corners are off by roundings.
struct Flat {
  Vec3 corner[3], side[3];
  Real inverse[3];  ///< of squared sides; of no length: 0
  Vec3 other;       ///< from the first corner to the last
  Vec3 normal;
  Real squared_normal, inverse_normal;
};

/// Of its three corners.
IST_FORMULA void flatten(Flat& t) {
  for (int c = 0; c < 3; ++c) {
    t.side[c] = t.corner[(c + 1) % 3] - t.corner[c];
    t.inverse[c] = inverse_of(dot(t.side[c], t.side[c]));
  }
  t.other = t.corner[2] - t.corner[0];
  const Halves ux = halves_of(t.side[0].x), uy = halves_of(t.side[0].y),
               uz = halves_of(t.side[0].z), vx = halves_of(t.other.x), vy = halves_of(t.other.y),
               vz = halves_of(t.other.z);
  t.normal = {difference_of_products(uy, vz, uz, vy), difference_of_products(uz, vx, ux, vz),
              difference_of_products(ux, vy, uy, vx)};
  t.squared_normal = dot(t.normal, t.normal);
  t.inverse_normal = inverse_of(t.squared_normal);
}

/// The nearest two points so far.
struct NearestPoints {
  Real squared;
  Vec3 on_a, between;  ///< from there to B's
};

IST_FORMULA void take_nearer(NearestPoints& least, Real other, Mask valid, const Vec3& a,
                             const Vec3& way) {
  const Mask nearer = both(valid, less(other, least.squared));
  least.squared = choose(nearer, other, least.squared);
  least.on_a = {choose(nearer, a.x, least.on_a.x), choose(nearer, a.y, least.on_a.y),
                choose(nearer, a.z, least.on_a.z)};
  least.between = {choose(nearer, way.x, least.between.x), choose(nearer, way.y, least.between.y),
                   choose(nearer, way.z, least.between.z)};
}

/// A corner over a triangle. Its height comes back, times the normal's length.
template <bool kCornerOfA>
IST_FORMULA Real over_face(const Vec3& p, const Flat& t, NearestPoints& least) {
  const Real zero = constant(0.0);
  const Vec3 r = p - t.corner[0];
  const Real height = dot(r, t.normal);
  const Real v = dot(cross(r, t.other), t.normal), w = dot(cross(t.side[0], r), t.normal);
  const Mask inside = both(both(at_most(zero, v), at_most(zero, w)),
                           both(at_most(v + w, t.squared_normal), less(zero, t.inverse_normal)));
  const Real share = height * t.inverse_normal;
  const Vec3 up = share * t.normal;  // from the foot to the corner
  if constexpr (kCornerOfA)
    take_nearer(least, height * share, inside, p, constant(-1.0) * up);
  else
    take_nearer(least, height * share, inside, p - up, up);
  return height;
}

IST_FORMULA Real part_of_edge(Real x) { return lesser(greater(x, constant(0.0)), constant(1.0)); }

/// An edge u of A from `p`, and an edge v of B from `q`: where the lines are nearest, by products
/// of vectors, which keep the digits of nearly parallel ones; then each is brought to the other's
/// point in turn.
IST_FORMULA void along_edges(const Vec3& p, const Vec3& u, Real inverse_u, const Vec3& q,
                             const Vec3& v, Real inverse_v, NearestPoints& least) {
  const Vec3 w = q - p;
  const Vec3 n = cross(u, v);
  Real s = part_of_edge(dot(cross(w, v), n) * inverse_of(dot(n, n)));
  const Real t = part_of_edge(dot(s * u - w, v) * inverse_v);
  const Vec3 way = w + t * v;
  s = part_of_edge(dot(way, u) * inverse_u);
  const Vec3 su = s * u;
  const Vec3 between = way - su;
  take_nearer(least, dot(between, between), at_most(s, s), p + su, between);
}

/// The nearest points of two triangles that do not cross. `unclear`: they may, as each reaches to
/// both sides of the other's plane, where coordinates may be off by `slack`.
IST_FORMULA NearestPoints nearest_points(const Flat& a, const Flat& b, double slack,
                                         Mask& unclear) {
  NearestPoints least{constant(HUGE_VAL), a.corner[0], a.corner[0]};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      along_edges(a.corner[i], a.side[i], a.inverse[i], b.corner[j], b.side[j], b.inverse[j],
                  least);
  Real of_a[3], of_b[3];
  for (int k = 0; k < 3; ++k) {
    of_a[k] = over_face<true>(a.corner[k], b, least);
    of_b[k] = over_face<false>(b.corner[k], a, least);
  }
  const Real over_b = constant(slack) * length_bound(b.normal),
             over_a = constant(slack) * length_bound(a.normal), zero = constant(0.0);
  unclear = both(both(at_most(lesser(of_a[0], lesser(of_a[1], of_a[2])), over_b),
                      at_most(zero - over_b, greater(of_a[0], greater(of_a[1], of_a[2])))),
                 both(at_most(lesser(of_b[0], lesser(of_b[1], of_b[2])), over_a),
                      at_most(zero - over_a, greater(of_b[0], greater(of_b[1], of_b[2])))));
  return least;
}
