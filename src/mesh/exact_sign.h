#pragma once

namespace ist {

/// Sign (−1, 0, 1) of the area of (a, b, q) in the plane: +1 where q lies left of a → b. Exact,
/// over- and underflow aside: a bound on the rounding error decides nearly always, else expansions
/// do.
int orient2d_sign(const double a[2], const double b[2], const double q[2]);

/// Sign of the volume of (a, b, c, q): +1 where q lies behind abc (inside, for an outward
/// triangle), −1 where abc is seen counter-clockwise from q. Exact in the same sense.
int orient3d_sign(const double a[3], const double b[3], const double c[3], const double q[3]);

}  // namespace ist
