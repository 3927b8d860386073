// The nearest points of two triangles, once for lanes of the CPU and for a thread of the GPU: in
// the terms of overlap_formulas-inl.h, with
// those of careful_cross-inl.h and edge_gap_formulas-inl.h before.

/// A triangle with the data for its nearest points. A careful product keeps the digits of its
/// normal however thin it is: the normal belongs to a triangle whose corners differ by rounding.
struct Flat {
  Vec3 corner[3], side[3];
  Real inverse[3];  ///< of squared sides; 0 if a side has no length
  Vec3 other;       ///< from the first corner to the last
  Vec3 normal;
  Real squared_normal, inverse_normal;
};

/// Sets the data from its three corners.
IST_FORMULA void flatten(Flat& t) {
  for (int c = 0; c < 3; ++c) {
    t.side[c] = t.corner[(c + 1) % 3] - t.corner[c];
    t.inverse[c] = inverse_of(dot(t.side[c], t.side[c]));
  }
  t.other = t.corner[2] - t.corner[0];
  t.normal = careful_cross(t.side[0], t.other);
  t.squared_normal = dot(t.normal, t.normal);
  t.inverse_normal = inverse_of(t.squared_normal);
}

/// Takes a corner above a triangle. Returns its height times the normal's length.
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

/// The nearest points of two triangles that do not cross. `unclear`: they may cross, since each
/// reaches to both sides of the other's plane, for coordinates with errors up to `slack`.
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
