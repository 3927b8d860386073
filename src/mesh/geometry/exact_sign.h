#pragma once

#include <cmath>

#include "base/host_device.h"

// Orientation predicates, for host and device. A bound on the rounding error nearly always decides
// (J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric
// Predicates", 1997); else the determinant's exact terms are summed by S. M. Rump's extraction
// ("Ultimately Fast Accurate Summation", 2009), which needs no memory: a GPU reserves the memory
// that one thread may need for all threads that it can run.

namespace ist {
namespace exact_sign {

constexpr double kEpsilon = 0x1p-53;
constexpr double kOrient2dBound = (3 + 16 * kEpsilon) * kEpsilon;
constexpr double kOrient3dBound = (7 + 56 * kEpsilon) * kEpsilon;

IST_HD inline int sign_of(double value) { return (value > 0) - (value < 0); }
IST_HD inline double magnitude_of(double value) { return value < 0 ? -value : value; }

/// a × b, and a bound for the rounding of its product with a third vector.
struct BoundedCross {
  double value[3], magnitude[3];

  BoundedCross() = default;
  BoundedCross(const double* a, const double* b) {
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      const double left = a[i] * b[j], right = a[j] * b[i];
      value[k] = left - right;
      magnitude[k] = magnitude_of(left) + magnitude_of(right);
    }
  }

  /// Sign of the triple product with d; 0 if rounding may have decided it.
  int side_of(const double* d) const {
    constexpr double kUnderflow = 1e-290;
    double product = 0, bound = 0;
    for (int k = 0; k < 3; ++k) {
      product += d[k] * value[k];
      bound += magnitude_of(d[k]) * magnitude[k];
    }
    return magnitude_of(product) > kOrient3dBound * bound + kUnderflow ? sign_of(product) : 0;
  }
};

/// A product of three doubles as a sum of four.
struct ProductTerms {
  double term[4];

  IST_HD ProductTerms(double a, double b, double c) {
    const double high = a * b, low = std::fma(a, b, -high);
    term[0] = high * c;
    term[1] = std::fma(high, c, -term[0]);
    term[2] = low * c;
    term[3] = std::fma(low, c, -term[2]);
  }
};

/// The smallest power of two above a positive, normal number.
IST_HD inline double power_above(double x) {
  double power = 1;
  while (power <= x) power *= 2;
  while (power > 2 * x) power /= 2;
  return power;
}

/// Exact sign of the sum of the products terms.product(0) … terms.product(kCount − 1), which are
/// recomputed whenever they are needed. Assumes no over- or underflow.
template <int kCount, class Terms>
IST_HD int sign_of_sum(const Terms& terms) {
  static_assert(4 * kCount + 2 <= 128);
  constexpr double kHeadroom = 128;  // ≥ number of terms + 2
  double largest = 0;
  for (int i = 0; i < kCount; ++i) {
    const ProductTerms product = terms.product(i);
    for (const double term : product.term)
      largest = magnitude_of(term) > largest ? magnitude_of(term) : largest;
  }
  if (!(largest > 0)) return 0;
  // Every term is cut at multiples of σ 2^-53, its remainder at multiples of σ 2^-99, and so on.
  // The pieces of one level sum without error. `sum` stays exact while it is small; once it is not,
  // the remainders cannot change its sign.
  const double first_sigma = power_above(largest) * kHeadroom;
  double sum = 0, sigma = first_sigma;
  for (int level = 0;; ++level) {
    double pieces = 0, most_left = 0;
    for (int i = 0; i < kCount; ++i) {
      const ProductTerms product = terms.product(i);
      for (double left : product.term) {
        double piece = 0, cut = first_sigma;
        for (int k = 0; k <= level; ++k) {
          piece = (cut + left) - cut;
          left -= piece;
          cut *= kHeadroom * kEpsilon;
        }
        pieces += piece;
        most_left = magnitude_of(left) > most_left ? magnitude_of(left) : most_left;
      }
    }
    sum += pieces;
    if (most_left == 0 || magnitude_of(sum) >= kHeadroom * kHeadroom * kEpsilon * sigma)
      return sign_of(sum);
    sigma *= kHeadroom * kEpsilon;
  }
}

/// a × b + b × q + q × a.
struct Area {
  const double *a, *b, *q;

  IST_HD ProductTerms product(int i) const {
    const double* from = i < 2 ? a : i < 4 ? b : q;
    const double* to = i < 2 ? b : i < 4 ? q : a;
    return i % 2 == 0 ? ProductTerms(from[0], to[1], 1) : ProductTerms(-from[1], to[0], 1);
  }
};

/// One of the six products of det(x, y, z).
IST_HD inline ProductTerms determinant_product(const double* x, const double* y, const double* z,
                                               double sign, int i) {
  const int column = i / 2, j = (column + 1) % 3, k = (column + 2) % 3;
  return i % 2 == 0 ? ProductTerms(sign * x[column], y[j], z[k])
                    : ProductTerms(-sign * x[column], y[k], z[j]);
}

/// |a b c| − |a b q| + |a c q| − |b c q|.
struct Volume {
  const double *a, *b, *c, *q;

  IST_HD ProductTerms product(int i) const {
    const int minor = i / 6;
    return determinant_product(minor == 3 ? b : a, minor < 2 ? b : c, minor == 0 ? c : q,
                               minor % 2 == 0 ? 1 : -1, i % 6);
  }
};

/// |a−q b−q c−q|, if these differences are exact: a quarter of the products.
struct VolumeSeen {
  double p[3][3];

  IST_HD ProductTerms product(int i) const { return determinant_product(p[0], p[1], p[2], 1, i); }

  /// p = from − q; false if it is rounded.
  IST_HD bool set(int row, const double from[3], const double q[3]) {
    bool exact = true;
    for (int k = 0; k < 3; ++k) {
      const double difference = from[k] - q[k];
      const double q_part =
          difference - from[k];  // the part of −q that was added (Knuth's two-sum)
      exact = exact && from[k] == difference - q_part && q_part == -q[k];
      p[row][k] = difference;
    }
    return exact;
  }
};

IST_HD_COLD int orient2d_exact(const double a[2], const double b[2], const double q[2]) {
  return sign_of_sum<6>(Area{a, b, q});
}

IST_HD_COLD int orient3d_exact(const double a[3], const double b[3], const double c[3],
                               const double q[3]) {
  VolumeSeen seen;
  if (seen.set(0, a, q) && seen.set(1, b, q) && seen.set(2, c, q)) return sign_of_sum<6>(seen);
  return sign_of_sum<24>(Volume{a, b, c, q});
}

}  // namespace exact_sign

/// Sign (−1, 0, 1) of the area of (a, b, q): +1 if q lies left of a → b. Exact unless it overflows.
IST_HD inline int orient2d_sign(const double a[2], const double b[2], const double q[2]) {
  using namespace exact_sign;
  const double left = (a[0] - q[0]) * (b[1] - q[1]);
  const double right = (a[1] - q[1]) * (b[0] - q[0]);
  const double area = left - right;
  if (magnitude_of(area) > kOrient2dBound * (magnitude_of(left) + magnitude_of(right)))
    return sign_of(area);
  return orient2d_exact(a, b, q);
}

/// Sign of the volume of (a, b, c, q): +1 if q lies behind abc (inside, for an outward triangle),
/// −1 if abc appears counter-clockwise from q. Exact in the same sense.
IST_HD inline int orient3d_sign(const double a[3], const double b[3], const double c[3],
                                const double q[3]) {
  using namespace exact_sign;
  double volume = 0, magnitude = 0;
  double p[3][3];
  for (int k = 0; k < 3; ++k) {
    p[0][k] = a[k] - q[k];
    p[1][k] = b[k] - q[k];
    p[2][k] = c[k] - q[k];
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double left = p[1][j] * p[2][k], right = p[1][k] * p[2][j];
    volume += p[0][i] * (left - right);
    magnitude += magnitude_of(p[0][i]) * (magnitude_of(left) + magnitude_of(right));
  }
  if (magnitude_of(volume) > kOrient3dBound * magnitude) return sign_of(volume);
  return orient3d_exact(a, b, c, q);
}

}  // namespace ist
