// The formulas of an overlap's sums, once for lanes of the CPU and for a thread of the GPU. This is
// not a header of its own: the including file defines its numbers first. `Real`, `Mask` and `Vec3`
// are a number, a condition and three numbers, or lanes of them, with constant(), magnitude(),
// choose(), less() and equal(). IST_FORMULA precedes a function.

/// The point where an edge from p to q crosses a plane.
struct EdgeEnd {
  Vec3 from;         ///< the end of the edge that is nearer to the plane
  Vec3 offset;       ///< from there to the crossing: stays accurate next to the end
  Real share;        ///< the offset as a share of the edge
  Real heights;      ///< of both ends together; 1 if they are rounded to 0
  Mask flat;         ///< they are rounded to 0
  Mask from_second;  ///< the nearer end is q
};

/// Computes the point from heights above the plane. It starts from the nearer end, or if both are
/// equally near from the first in space, so that both triangles at an edge agree.
IST_FORMULA EdgeEnd edge_end(const Vec3& p, const Vec3& q, Real height_p, Real height_q) {
  const Real hp = magnitude(height_p), hq = magnitude(height_q), whole = hp + hq;
  const Mask before =
      either(less(q.x, p.x),
             both(equal(q.x, p.x), either(less(q.y, p.y), both(equal(q.y, p.y), less(q.z, p.z)))));
  const Mask turned = either(less(hq, hp), both(equal(hq, hp), before));
  // An edge in the plane has both ends on one side, but their heights may be rounded to 0.
  const Mask flat = equal(whole, constant(0.0));
  const Real divisor = choose(flat, constant(1.0), whole);
  const Real share = choose(flat, constant(0.5), lesser(hp, hq) / divisor);
  const Vec3 near = {choose(turned, q.x, p.x), choose(turned, q.y, p.y), choose(turned, q.z, p.z)};
  const Vec3 far = {choose(turned, p.x, q.x), choose(turned, p.y, q.y), choose(turned, p.z, q.z)};
  return {near, share * (far - near), share, divisor, flat, turned};
}

/// The apex of a triangle's cones, 0 … 2: the corner nearest to the origin, by its corners'
/// distances.
IST_FORMULA Real apex_of(Real first, Real second, Real third) {
  return choose(less(third, lesser(first, second)), constant(2.0),
                choose(less(second, first), constant(1.0), constant(0.0)));
}

/// The terms that a piece of the boundary adds to the sums, relative to the origin.
struct PieceTerms {
  Real six_volumes[3];  ///< of tetrahedra, which are summed one by one since they may cancel
  Vec3 moment, force, torque;
  Real rounding;  ///< six times the error bound of the volume
};

/// The terms of a segment that two triangles share, and of pierced edges opposite to an apex, from
/// their nearer ends on. A cone from the origin over a part of a triangle is made of tetrahedra
/// with an edge from the origin to the triangle's apex; shared segments bound the parts of both
/// triangles.
///
/// `near`: an end's nearer end of its edge; `apex`: of A's and of B's triangle; `by_b`: an end is
/// on B's edge; `opposite`: 1 if its edge is opposite to its triangle's apex and enters, −1 if it
/// leaves, else 0; `height_error`: of both ends of an edge together.
IST_FORMULA void segment_terms(const Vec3 (&near)[2], const Vec3 (&offset)[2],
                               const Vec3 (&apex)[2], const Mask (&by_b)[2],
                               const Real (&opposite)[2], const Real (&height_error)[2],
                               PieceTerms& out) {
  const Vec3 at[2] = {near[0] + offset[0], near[1] + offset[1]};
  const Vec3 &a = at[0], &b = at[1], &of_a = apex[0], &of_b = apex[1];
  const Vec3 along = b - a, c = cross(a, along), sum = a + b;
  const Real six_a = dot(c, of_a), six_b = dot(c, of_b);
  out.six_volumes[0] = dot(c, of_a - of_b);
  Vec3 moment = six_a * (of_a + sum) - six_b * (of_b + sum);
  // The rounding of the product, and the effect of rounded ends on the triangles at them.
  Real rounding = constant(exact::kHalfUnit) * length_bound(along) *
                  (constant(8.0) * length_bound(a) * length_bound(of_a - of_b) +
                   constant(6.0) * (length_bound(a) + length_bound(b)) *
                       (length_bound(of_a - a) + length_bound(of_b - a)));
  for (int e = 0; e < 2; ++e) {
    const Vec3 from = {choose(by_b[e], of_b.x, of_a.x), choose(by_b[e], of_b.y, of_a.y),
                       choose(by_b[e], of_b.z, of_a.z)};
    const Vec3 to = near[e] - from;
    const Real six = opposite[e] * dot(from, cross(offset[e], to));
    out.six_volumes[1 + e] = six;
    moment = moment + six * (from + (near[e] + at[e]));
    rounding = rounding + (magnitude(opposite[e]) * constant(20 * exact::kHalfUnit) *
                               (length_bound(from) + length_bound(to)) *
                               (length_bound(offset[e]) * length_bound(to)) +
                           constant(3.0) * height_error[e]);
  }
  out.moment = moment;
  out.force = constant(-0.5) * c;
  out.torque = (((dot(a, a) + dot(a, b)) + dot(b, b)) / constant(6.0)) * along;
  out.rounding = rounding;
}

/// The cone over the edge opposite to a triangle's apex, `count` times. It has neither force nor
/// torque, and only one tetrahedron.
IST_FORMULA void cone_terms(Real count, const Vec3& apex, const Vec3& next, const Vec3& last,
                            PieceTerms& out) {
  const Vec3 u = next - apex, v = last - apex;
  const Real six = count * dot(apex, cross(u, v));
  out.six_volumes[0] = six;
  out.rounding = magnitude(count) * constant(20 * exact::kHalfUnit) *
                 ((length_bound(apex) + length_bound(u) + length_bound(v)) *
                  (length_bound(u) * length_bound(v)));
  out.moment = six * (apex + (next + last));
}

/// The terms that a piece of a surface adds to the sums of an octant, relative to the centre of its
/// part.
struct OctantTerms {
  Real six_volumes;
  Vec3 moment, area, torque;
};

/// `half`: 0.5 times how often it counts. `share`: the factor of its torque, a third of the
/// octant's share in a surface, negative for A's.
IST_FORMULA OctantTerms octant_terms(Real half, Real share, const Vec3& p, const Vec3& q,
                                     const Vec3& r) {
  const Vec3 area = half * cross(q - p, r - p), three = p + (q + r);
  const Real six = constant(2.0) * dot(p, area);
  return {six, six * three, area, share * cross(three, area)};
}

/// The terms that a crossing adds to octants: the triangles of A and of B between the segment and
/// the apex, those between the apex and a pierced edge opposite to it, at each end, and all of them
/// together.
struct OctantTriangles {
  OctantTerms of[4], all;
  Vec3 area[2];  ///< of all, A's and B's
};

/// `corner`: the apexes of A and of B, the ends, and the nearer ends of their edges. `by_b`: an end
/// is on B's edge. `times`: how often its triangle counts.
IST_FORMULA void octant_triangles(const Vec3 (&corner)[6], const Mask (&by_b)[2],
                                  const Real (&times)[2], OctantTriangles& out) {
  const Real half = constant(0.5), third = constant(0.5 / 3), less_third = constant(-0.5 / 3);
  out.of[0] = octant_terms(half, less_third, corner[0], corner[2], corner[3]);
  out.of[1] = octant_terms(half, third, corner[1], corner[3], corner[2]);
  OctantTerms& all = out.all;
  all.six_volumes = out.of[0].six_volumes + out.of[1].six_volumes;
  all.moment = out.of[0].moment + out.of[1].moment;
  all.torque = out.of[0].torque + out.of[1].torque;
  for (int s = 0; s < 2; ++s) out.area[s] = out.of[s].area;
  for (int e = 0; e < 2; ++e) {
    const Vec3 apex = {choose(by_b[e], corner[1].x, corner[0].x),
                       choose(by_b[e], corner[1].y, corner[0].y),
                       choose(by_b[e], corner[1].z, corner[0].z)};
    const OctantTerms& terms = out.of[2 + e] = octant_terms(
        half * times[e], choose(by_b[e], third, less_third), apex, corner[2 + e], corner[4 + e]);
    const Real b = choose(by_b[e], constant(1.0), constant(0.0));
    all.six_volumes = all.six_volumes + terms.six_volumes;
    all.moment = all.moment + terms.moment;
    all.torque = all.torque + terms.torque;
    out.area[0] = out.area[0] + (constant(1.0) - b) * terms.area;
    out.area[1] = out.area[1] + b * terms.area;
  }
}
