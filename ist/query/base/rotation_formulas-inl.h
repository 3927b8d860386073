// Rotations and boxes for Real and Vec3: doubles (query/base/pair_place.h) or lanes of doubles
// (scene/box_kernel.cpp). No guard: each includes it in a namespace of its own.

/// The matrix of a unit quaternion, row by row. Sums are in Eigen's order.
IST_FORMULA void rotation_matrix(const Real& w, const Vec3& v, Real (&m)[9]) {
  const Vec3 twice = v + v, by_w = w * twice;
  const Real xx = twice.x * v.x, yy = twice.y * v.y, zz = twice.z * v.z;
  const Real xy = twice.y * v.x, xz = twice.z * v.x, yz = twice.z * v.y;
  const Real one = constant(1);
  m[0] = one - (yy + zz), m[1] = xy - by_w.z, m[2] = xz + by_w.y;
  m[3] = xy + by_w.z, m[4] = one - (xx + zz), m[5] = yz - by_w.x;
  m[6] = xz - by_w.y, m[7] = yz + by_w.x, m[8] = one - (xx + yy);
}

/// M x, M stored row by row. Sums are in Eigen's order.
IST_FORMULA Vec3 turned(const Real (&m)[9], const Vec3& x) {
  return {(m[0] * x.x + m[1] * x.y) + m[2] * x.z, (m[3] * x.x + m[4] * x.y) + m[5] * x.z,
          m[6] * x.x + (m[7] * x.y + m[8] * x.z)};
}

/// The world box of a turned box of this centre and half extent, wider by `wider` on each side.
IST_FORMULA void box_around(const Real& w, const Vec3& v, const Vec3& t, const Vec3& middle,
                            const Vec3& half, const Real& wider, Vec3& low, Vec3& high) {
  Real m[9];
  rotation_matrix(w, v, m);
  const Vec3 at = turned(m, middle) + t;
  for (Real& x : m) x = magnitude(x);
  const Vec3 reach = turned(m, half) + Vec3{wider, wider, wider};
  low = at - reach;
  high = at + reach;
}
