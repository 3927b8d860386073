#pragma once

#include <cmath>

#include "base/host_device.h"

// Exact arithmetic with doubles: a number as a sum of doubles that do not overlap, the smallest
// first (Shewchuk, "Adaptive Precision Floating-Point Arithmetic", 1997). Plain numbers, no
// library: host, device and WebAssembly compile it. Nothing may be fused or re-associated here.

namespace ist::exact {

/// The relative rounding of a double: half a unit in the last place of 1.
inline constexpr double kHalfUnit = 0x1p-53;

/// high + low = a + b exactly.
IST_HD inline void two_sum(double a, double b, double& high, double& low) {
  high = a + b;
  const double part = high - a;
  low = (a - (high - part)) + (b - part);
}

/// high + low = a − b exactly.
IST_HD inline void two_difference(double a, double b, double& high, double& low) {
  high = a - b;
  const double part = a - high;
  low = (a - (high + part)) + (part - b);
}

IST_HD inline void split(double a, double& high, double& low) {
  const double c = 134217729.0 * a;  // 2^27 + 1
  high = c - (c - a);
  low = a - high;
}

/// high + low = a · b exactly, short of overflow and underflow.
IST_HD inline void two_product(double a, double b, double& high, double& low) {
  high = a * b;
  double ah, al, bh, bl;
  split(a, ah, al);
  split(b, bh, bl);
  low = al * bl - (((high - ah * bh) - al * bh) - ah * bl);
}

/// A sum of many numbers, nearly as exact as in twice the digits.
class CarefulSum {
 public:
  IST_HD inline void add(double x) {
    double rest;
    two_sum(high_, x, high_, rest);
    low_ += rest;
  }
  IST_HD inline double value() const { return high_ + low_; }

 private:
  double high_ = 0, low_ = 0;
};

/// A sum of at most kCapacity doubles that do not overlap, without zeros. An empty one is 0.
template <int kCapacity>
struct Expansion {
  int count = 0;
  double part[kCapacity];

  IST_HD inline int sign() const { return count == 0 ? 0 : part[count - 1] > 0 ? 1 : -1; }
  /// The nearest double, or nearly.
  IST_HD inline double value() const {
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += part[i];
    return sum;
  }
};

/// The parts of a + b, or of a − b where `factor` is −1, the smallest first.
template <int kA, int kB, class Take>
IST_HD inline void add_parts(const Expansion<kA>& a, const Expansion<kB>& b, double factor,
                             const Take& take) {
  int i = 0, j = 0;
  double carried = 0;
  for (int k = 0; k < a.count + b.count; ++k) {
    const double next = j == b.count || (i < a.count && std::abs(a.part[i]) < std::abs(b.part[j]))
                            ? a.part[i++]
                            : factor * b.part[j++];
    double rest;
    two_sum(carried, next, carried, rest);
    if (rest != 0) take(rest);
  }
  if (carried != 0) take(carried);
}
template <int kA, int kB>
IST_HD inline Expansion<kA + kB> sum(const Expansion<kA>& a, const Expansion<kB>& b,
                                     double factor = 1) {
  Expansion<kA + kB> out;
  add_parts(a, b, factor, [&](double part) { out.part[out.count++] = part; });
  return out;
}
template <int kA, int kB>
IST_HD inline int sign_of_sum(const Expansion<kA>& a, const Expansion<kB>& b, double factor) {
  double largest = 0;
  add_parts(a, b, factor, [&](double part) { largest = part; });
  return largest > 0 ? 1 : largest < 0 ? -1 : 0;
}

/// a · b.
template <int kA>
IST_HD inline Expansion<2 * kA> scaled(const Expansion<kA>& a, double b) {
  Expansion<2 * kA> out;
  if (a.count == 0 || b == 0) return out;
  double carried, rest;
  two_product(a.part[0], b, carried, rest);
  if (rest != 0) out.part[out.count++] = rest;
  for (int i = 1; i < a.count; ++i) {
    double high, low, middle;
    two_product(a.part[i], b, high, low);
    two_sum(carried, low, middle, rest);
    if (rest != 0) out.part[out.count++] = rest;
    two_sum(high, middle, carried, rest);
    if (rest != 0) out.part[out.count++] = rest;
  }
  if (carried != 0) out.part[out.count++] = carried;
  return out;
}

IST_HD inline Expansion<2> difference(double a, double b) {
  Expansion<2> out;
  double high, low;
  two_difference(a, b, high, low);
  if (low != 0) out.part[out.count++] = low;
  if (high != 0) out.part[out.count++] = high;
  return out;
}

template <int kA>
IST_HD inline Expansion<4 * kA> product(const Expansion<kA>& a, const Expansion<2>& b) {
  // Except in the rarest cases b has at least one part.
  if (b.count < 2) {
    Expansion<4 * kA> out;
    const Expansion<2 * kA> one = b.count == 0 ? Expansion<2 * kA>() : scaled(a, b.part[0]);
    out.count = one.count;
    for (int i = 0; i < one.count; ++i) out.part[i] = one.part[i];
    return out;
  }
  return sum(scaled(a, b.part[0]), scaled(a, b.part[1]));
}

/// a b − c d.
IST_HD inline Expansion<16> minor(const Expansion<2>& a, const Expansion<2>& b,
                                  const Expansion<2>& c, const Expansion<2>& d) {
  return sum(product(a, b), product(c, d), -1);
}

}  // namespace ist::exact
