// The nearest points of two edges, once for lanes of the CPU and for a thread of the GPU: in the
// terms of overlap_formulas-inl.h, and least_inverted().

/// The inverse of x, or 0 if x is too small.
IST_FORMULA Real inverse_of(Real x) {
  const Real one = constant(1.0);
  const Mask long_enough = less(least_inverted(), x);
  return choose(long_enough, one / choose(long_enough, x, one), constant(0.0));
}

/// The nearest two points so far.
struct NearestPoints {
  Real squared;
  Vec3 on_a, between;  ///< from there to B's
};

IST_FORMULA void take_nearer(NearestPoints& least, Real other, Mask valid, const Vec3& a,
                             const Vec3& vector) {
  const Mask nearer = both(valid, less(other, least.squared));
  least.squared = choose(nearer, other, least.squared);
  least.on_a = {choose(nearer, a.x, least.on_a.x), choose(nearer, a.y, least.on_a.y),
                choose(nearer, a.z, least.on_a.z)};
  least.between = {choose(nearer, vector.x, least.between.x),
                   choose(nearer, vector.y, least.between.y),
                   choose(nearer, vector.z, least.between.z)};
}

IST_FORMULA Real part_of_edge(Real x) { return lesser(greater(x, constant(0.0)), constant(1.0)); }

/// The nearest points of an edge u of A from `p` and an edge v of B from `q`. Those of the lines
/// come from cross products, which keep the digits of nearly parallel ones; then each is moved to
/// the point nearest to the other in turn.
IST_FORMULA void along_edges(const Vec3& p, const Vec3& u, Real inverse_u, const Vec3& q,
                             const Vec3& v, Real inverse_v, NearestPoints& least) {
  const Vec3 w = q - p;
  const Vec3 n = cross(u, v);
  Real s = part_of_edge(dot(cross(w, v), n) * inverse_of(dot(n, n)));
  const Real t = part_of_edge(dot(s * u - w, v) * inverse_v);
  const Vec3 vector = w + t * v;
  s = part_of_edge(dot(vector, u) * inverse_u);
  const Vec3 su = s * u;
  const Vec3 between = vector - su;
  take_nearer(least, dot(between, between), at_most(s, s), p + su, between);
}
