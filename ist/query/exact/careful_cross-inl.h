// Products of vectors that keep their digits, in doubles: in the terms of overlap_formulas-inl.h.

/// a b − c e, rounded about once, by split products.
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

IST_FORMULA Vec3 careful_cross(const Vec3& u, const Vec3& v) {
  const Halves ux = halves_of(u.x), uy = halves_of(u.y), uz = halves_of(u.z), vx = halves_of(v.x),
               vy = halves_of(v.y), vz = halves_of(v.z);
  return {difference_of_products(uy, vz, uz, vy), difference_of_products(uz, vx, ux, vz),
          difference_of_products(ux, vy, uy, vx)};
}
IST_FORMULA Real least_inverted() { return constant(1e-290); }
