#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "query/shape/plain_shapes.h"

// A ball cut by a plane, against arithmetic of 100 digits.

namespace ist {
namespace {

using Exact = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>,
                                            boost::multiprecision::et_off>;

double relative(double got, const Exact& want) {
  if (want == 0) return got == 0 ? 0 : 1;
  return static_cast<double>(abs((Exact(got) - want) / want));
}

TEST(Cap, AgainstHundredDigits) {
  const Exact pi = boost::math::constants::pi<Exact>();
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  double volume = 0, derivative = 0, moment = 0;
  for (int i = 0; i < 400'000; ++i) {
    const double r = std::pow(10.0, 18 * uniform(random) - 9);
    double d = 0;
    switch (i % 6) {
      case 0:  // anywhere
        d = r * (2 * uniform(random) - 1);
        break;
      case 1:  // grazing
        d = -r * (1 - std::pow(10.0, -16 * uniform(random)));
        break;
      case 2:  // nearly whole
        d = r * (1 - std::pow(10.0, -16 * uniform(random)));
        break;
      case 3:  // about half
        d = r * std::pow(10.0, -20 * uniform(random)) * (i % 12 < 6 ? 1 : -1);
        break;
      case 4:  // steps from tangency
        d = -r;
        for (unsigned n = static_cast<unsigned>(random() % 4); n > 0; --n) d = std::nextafter(d, r);
        break;
      default:
        d = r;
        for (unsigned n = static_cast<unsigned>(random() % 4); n > 0; --n)
          d = std::nextafter(d, -r);
    }
    const Cap got = cap(r, d);
    const Exact R = r, D = d;
    volume = std::max(volume, relative(got.volume, pi / 3 * (R + D) * (R + D) * (2 * R - D)));
    derivative = std::max(derivative, relative(got.derivative, pi * (R - D) * (R + D)));
    moment = std::max(moment, relative(got.moment, pi / 4 * (R - D) * (R - D) * (R + D) * (R + D)));
  }
  std::printf("worst relative error: volume %.2g, derivative %.2g, moment %.2g\n", volume,
              derivative, moment);
  // A dozen roundings.
  EXPECT_LE(volume, 2e-15);
  EXPECT_LE(derivative, 2e-15);
  EXPECT_LE(moment, 2e-15);
}

TEST(Cap, BeyondThePlaneIsAllOrNothing) {
  for (const double r : {1e-9, 1.0, 1e9}) {
    EXPECT_EQ(cap(r, -r).volume, 0);
    EXPECT_EQ(cap(r, -2 * r).volume, 0);
    EXPECT_EQ(cap(r, 2 * r).volume, cap(r, r).volume);
    EXPECT_EQ(cap(r, 2 * r).derivative, 0);
    EXPECT_EQ(cap(r, 2 * r).moment, 0);
  }
  EXPECT_EQ(cap(0, -1).volume, 0);
  EXPECT_EQ(cap(0, 1).volume, 0);
}

}  // namespace
}  // namespace ist
