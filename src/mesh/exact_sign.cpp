#include "mesh/exact_sign.h"

#include <array>
#include <cmath>
#include <cstddef>

// Error bounds and expansions after J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic
// and Fast Robust Geometric Predicates", 1997.

namespace ist {
namespace {

constexpr double kEpsilon = 0x1p-53;
constexpr double kOrient2dBound = (3 + 16 * kEpsilon) * kEpsilon;
constexpr double kOrient3dBound = (7 + 56 * kEpsilon) * kEpsilon;

int sign_of(double value) { return (value > 0) - (value < 0); }

struct TwoTerms {
  double high, low;
};

TwoTerms two_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

TwoTerms two_product(double a, double b) {
  const double product = a * b;
  return {product, std::fma(a, b, -product)};
}

/// An exact sum of doubles, kept as non-overlapping components of increasing size.
template <std::size_t kCapacity>
class ExactSum {
 public:
  void add(double term) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const TwoTerms s = two_sum(term, components_[i]);
      term = s.high;
      if (s.low != 0) components_[kept++] = s.low;
    }
    if (term != 0) components_[kept++] = term;
    count_ = kept;
  }

  void add_product(double a, double b) {
    const TwoTerms ab = two_product(a, b);
    add(ab.low);
    add(ab.high);
  }

  void add_product(double a, double b, double c) {
    const TwoTerms ab = two_product(a, b);
    add_product(ab.low, c);
    add_product(ab.high, c);
  }

  int sign() const { return count_ == 0 ? 0 : sign_of(components_[count_ - 1]); }

 private:
  std::array<double, kCapacity> components_;
  std::size_t count_ = 0;
};

int orient2d_exact(const double a[2], const double b[2], const double q[2]) {
  ExactSum<16> sum;  // a × b + b × q + q × a
  const double* cycle[4] = {a, b, q, a};
  for (int i = 0; i < 3; ++i) {
    sum.add_product(cycle[i][0], cycle[i + 1][1]);
    sum.add_product(-cycle[i][1], cycle[i + 1][0]);
  }
  return sum.sign();
}

void add_determinant(ExactSum<128>& sum, double factor, const double a[3], const double b[3],
                     const double c[3]) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    sum.add_product(factor * a[i], b[j], c[k]);
    sum.add_product(-factor * a[i], b[k], c[j]);
  }
}

int orient3d_exact(const double a[3], const double b[3], const double c[3], const double q[3]) {
  ExactSum<128> sum;
  add_determinant(sum, 1, a, b, c);
  add_determinant(sum, -1, a, b, q);
  add_determinant(sum, 1, a, c, q);
  add_determinant(sum, -1, b, c, q);
  return sum.sign();
}

}  // namespace

int orient2d_sign(const double a[2], const double b[2], const double q[2]) {
  const double left = (a[0] - q[0]) * (b[1] - q[1]);
  const double right = (a[1] - q[1]) * (b[0] - q[0]);
  const double area = left - right;
  if (std::abs(area) > kOrient2dBound * (std::abs(left) + std::abs(right))) return sign_of(area);
  return orient2d_exact(a, b, q);
}

int orient3d_sign(const double a[3], const double b[3], const double c[3], const double q[3]) {
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
    magnitude += std::abs(p[0][i]) * (std::abs(left) + std::abs(right));
  }
  if (std::abs(volume) > kOrient3dBound * magnitude) return sign_of(volume);
  return orient3d_exact(a, b, c, q);
}

}  // namespace ist
