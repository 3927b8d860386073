#pragma once

namespace ist {

/// On which side of the way from the origin to `d` the edge from a to b passes, where the edge's
/// line goes through the origin: that is moved a little along x, less along y, least along z, and
/// `d` likewise by far more. Turns over with the edge, digit for digit.
inline bool passes_left_in_line(const double (&d)[3], const double* a, const double* b) noexcept {
  const double e[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  for (int k = 0; k < 3; ++k) {
    const double turn = e[(k + 1) % 3] * d[(k + 2) % 3] - e[(k + 2) % 3] * d[(k + 1) % 3];
    if (turn != 0) return turn > 0;
  }
  // The way runs along the edge.
  if (e[2] != 0) return e[2] < 0;
  return e[1] != 0 ? e[1] > 0 : e[0] > 0;
}

/// The same for any edge. Two triangles that share it see it from opposite sides whatever the
/// rounding, and of edges that meet the way the same moves decide.
inline bool passes_left(const double (&d)[3], const double* a, const double* b) noexcept {
  double normal[3];
  for (int k = 0; k < 3; ++k)
    normal[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
  const double side = (d[0] * normal[0] + d[1] * normal[1]) + d[2] * normal[2];
  if (side != 0) return side > 0;
  for (const double n : normal)
    if (n != 0) return n > 0;
  return passes_left_in_line(d, a, b);
}

}  // namespace ist
