#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

#include "query/kernel/lens.h"

// The overlap of two balls against 100 decimal digits, for exactly the given radii and distance:
// random ones and such as are made to lose digits.

namespace ist {
namespace {

using Exact = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>,
                                            boost::multiprecision::et_off>;

constexpr std::size_t kTriples = 1'000'000;

struct ExactLens {
  Exact volume, circle;
};

/// The differences below are exact or lose nothing that 100 digits show: what cancels is taken
/// first.
template <class T>
ExactLens exact_lens(T ra, T rb, T distance) {
  static const Exact pi = boost::math::constants::pi<Exact>();
  const Exact a = std::max(ra, rb), b = std::min(ra, rb), d = distance;
  const Exact difference = a - b;
  const Exact g = b - (d - a), f = d - difference, e = difference + d;
  if (g <= 0) return {0, 0};
  if (f <= 0) return {4 * pi / 3 * b * b * b, 0};
  const Exact half = Exact(0.5) / d;
  const Exact ha = f * g * half, hb = e * g * half;
  return {pi / 3 * (ha * ha * (3 * a - ha) + hb * hb * (3 * b - hb)), ha * (2 * a - ha)};
}

template <class T>
struct Promise;
template <>
struct Promise<double> {
  static constexpr double kRelative = 1e-12;
  static constexpr double kLeastExponent = -1074, kMostExponent = 330;  // cubes stay finite
};
template <>
struct Promise<float> {
  static constexpr double kRelative = 1e-5;
  static constexpr double kLeastExponent = -149, kMostExponent = 40;
};

template <class T>
class Triples {
 public:
  struct Triple {
    T a = 0, b = 0, d = 0;
  };

  Triple next() {
    T a = radius(), b = a * static_cast<T>(power_of_ten(-12, 0));
    switch (random_() % 10) {
      case 0:  // anything
        return {radius(), radius(), radius()};
      case 1:
        return {a, b, within(a - b, a + b)};
      case 2:  // near tangency, by a factor
        return {a, b, (a + b) * (1 - small())};
      case 3:  // near containment
        return {a, b, (a - b) * (1 + small())};
      case 4:  // near either, by a share of the small ball
        return {a, b,
                a + b * static_cast<T>(std::cos(uniform() * 3.2) * (1 - power_of_ten(-16, 0)))};
      case 5:  // a few units in the last place about tangency
        return {a, b, steps_from(a + b)};
      case 6:  // and about containment
        return {a, b, steps_from(a - b)};
      case 7:  // almost equal, almost coincident
        b = steps_from(a);
        return {a, b, std::abs(a - b) + a * small()};
      case 8:  // equal
        return {a, a, a * static_cast<T>(power_of_ten(-40, 0.3))};
      default:  // denormal or about to be
        return {bits_near_zero(), bits_near_zero(), bits_near_zero()};
    }
  }

 private:
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  double power_of_ten(double low, double high) {
    return std::pow(10, low + uniform() * (high - low));
  }
  T small() { return static_cast<T>(power_of_ten(-18, 0)); }
  T within(T low, T high) { return low + (high - low) * static_cast<T>(uniform()); }
  /// Half of them of everyday size, the others of any that T and its cube allow.
  T radius() {
    const double exponent =
        random_() % 2 == 0 ? 10 * (uniform() - 0.5)
                           : Promise<T>::kLeastExponent + uniform() * (Promise<T>::kMostExponent -
                                                                       Promise<T>::kLeastExponent);
    return static_cast<T>(std::exp2(exponent) * (1 + uniform()));
  }
  T steps_from(T value) {
    const T toward = random_() % 2 == 0 ? T(0) : std::numeric_limits<T>::max();
    for (std::size_t i = random_() % 5; i > 0; --i) value = std::nextafter(value, toward);
    return value;
  }
  T bits_near_zero() {
    return std::numeric_limits<T>::min() * static_cast<T>(power_of_ten(-16, 1) * (1 + uniform()));
  }

  std::mt19937_64 random_{17};
};

template <class T>
double relative_excess(T got, const Exact& want) {
  // A subnormal result has lost its digits, which is allowed for.
  const Exact floor = 8 * Exact(std::numeric_limits<T>::min());
  const Exact excess = abs(Exact(got) - want) - floor;
  return excess <= 0 ? 0 : static_cast<double>(excess / want);
}

template <class T>
void expect_precision() {
  Triples<T> triples;
  double worst_volume = 0, worst_circle = 0;
  for (std::size_t i = 0; i < kTriples; ++i) {
    const auto [a, b, d] = triples.next();
    if (!(d >= 0)) continue;
    const Lens<T> got = lens(a, b, d);
    const ExactLens want = exact_lens(a, b, d);
    // Not negative, and not NaN, which fails this too. Underflow aside, nothing is lost or made up.
    ASSERT_TRUE(got.cap_a >= 0 && got.cap_b >= 0 && got.circle >= 0 && got.volume() >= 0)
        << a << ' ' << b << ' ' << d;
    const double volume = relative_excess(got.volume(), want.volume);
    // At a distance that is no normal number the centres coincide: equal balls push nowhere there.
    const bool coincide = d < std::numeric_limits<T>::min();
    const double circle = relative_excess(got.circle, coincide ? Exact(0) : want.circle);
    EXPECT_TRUE(volume <= Promise<T>::kRelative && circle <= Promise<T>::kRelative)
        << std::hexfloat << a << ' ' << b << ' ' << d << " volume " << volume << " circle "
        << circle;
    worst_volume = std::max(worst_volume, volume);
    worst_circle = std::max(worst_circle, circle);
    if (::testing::Test::HasFailure()) return;
  }
  std::printf("%zu triples, worst relative error: volume %.3g, circle %.3g\n", kTriples,
              worst_volume, worst_circle);
}

TEST(LensPrecision, DoubleAgainstHundredDigits) { expect_precision<double>(); }
TEST(LensPrecision, FloatAgainstHundredDigits) { expect_precision<float>(); }

}  // namespace
}  // namespace ist
