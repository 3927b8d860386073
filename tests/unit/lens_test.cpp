#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "query/kernel/lens.h"
#include "support/float_traps.h"
#include "support/quad.h"

namespace ist {
namespace {

using testing::Quad;

/// The textbook volume, which loses digits where the balls are near tangency or of unlike size.
Quad textbook_volume(Quad a, Quad b, Quad d) {
  const Quad gap = a + b - d;
  const Quad pi = M_PI + Quad(1.2246467991473532e-16);
  return pi * gap * gap * (d * d + 2 * d * (a + b) - 3 * (a - b) * (a - b)) / (12 * d);
}

/// Volume and squared circle radius in 113 bits from exactly the given numbers.
template <class T>
Lens<Quad> exact(T ra, T rb, T d) {
  const Quad a = ra > rb ? ra : rb, b = ra > rb ? rb : ra, x = d;
  const Quad g = a - x + b, f = x - a + b, e = a - b + x;
  if (g <= 0) return {0, 0, 0};
  if (f <= 0) return {0, 4 * b * b * b, 0};
  const Quad ha = f * g / (2 * x), hb = e * g / (2 * x);
  return {ha * ha * (3 * a - ha), hb * hb * (3 * b - hb), ha * (2 * a - ha)};
}

/// Worst relative errors of volume and circle over adversarial triples.
template <class T>
struct Worst {
  double volume = 0, circle = 0;

  void add(T a, T b, T d) {
    const Lens<T> got = lens(a, b, d);
    ASSERT_GE(got.cap_a, 0) << a << ' ' << b << ' ' << d;
    ASSERT_GE(got.cap_b, 0) << a << ' ' << b << ' ' << d;
    ASSERT_GE(got.circle, 0) << a << ' ' << b << ' ' << d;
    const Lens<Quad> want = exact(a, b, d);
    // Below this the cubes leave the range of normal numbers.
    const Quad floor = Quad(std::numeric_limits<T>::min()) * (Quad(1) / Quad(1e-10));
    const Quad volume = want.cap_a + want.cap_b;
    if (volume > floor && want.circle > floor) {
      const Quad dv = (Quad(got.cap_a) + Quad(got.cap_b) - volume) / volume;
      const Quad dc = (Quad(got.circle) - want.circle) / want.circle;
      this->volume = std::max(this->volume, std::abs(static_cast<double>(dv)));
      circle = std::max(circle, std::abs(static_cast<double>(dc)));
    } else if (volume == 0) {
      ASSERT_EQ(got.volume(), 0);
    }
  }
};

template <class T>
Worst<T> worst_of_random(int n) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(0, 1);
  Worst<T> worst;
  const T eps = std::numeric_limits<T>::epsilon();
  for (int i = 0; i < n; ++i) {
    // Ratios of radii to 1e12 (float: 1e6, whose cubes stay normal), sizes over many decades.
    const double size = std::pow(10, (uniform(random) - 0.5) * (sizeof(T) == 4 ? 4 : 60));
    const double ratio = std::pow(10, -uniform(random) * (sizeof(T) == 4 ? 6 : 12));
    const T a = static_cast<T>(size), b = static_cast<T>(size * ratio);
    const T near = static_cast<T>(std::pow(10, -uniform(random) * 16));
    for (const T d : {static_cast<T>((a - b) + 2 * b * static_cast<T>(uniform(random))),
                      static_cast<T>((a + b) * (1 - near)), static_cast<T>((a - b) * (1 + near)),
                      static_cast<T>((a + b) - b * near), static_cast<T>((a - b) + b * near),
                      static_cast<T>((a + b) * (1 + eps)), static_cast<T>((a - b) * (1 - eps))}) {
      if (d < 0) continue;
      worst.add(a, b, d);
      worst.add(b, a, d);
    }
    worst.add(a, a, static_cast<T>(a * near));
  }
  return worst;
}

TEST(Lens, DoubleKeepsAllDigits) {
  const auto worst = worst_of_random<double>(100'000);
  EXPECT_LE(worst.volume, 3e-15);
  EXPECT_LE(worst.circle, 3e-15);
}

TEST(Lens, FloatKeepsAllDigits) {
  const auto worst = worst_of_random<float>(100'000);
  EXPECT_LE(worst.volume, 1e-6);
  EXPECT_LE(worst.circle, 1e-6);
}

TEST(Lens, IsTheTextbookVolume) {
  for (const double b : {0.3, 0.9, 1.0})
    for (const double d : {0.75, 0.8, 1.0, 1.2})
      EXPECT_NEAR(lens(1.0, b, d).volume(), static_cast<double>(textbook_volume(1, b, d)), 1e-14);
}

TEST(Lens, DerivativeIsTheFiniteDifference) {
  for (const double b : {0.1, 0.7, 1.0}) {
    for (const double t : {0.05, 0.3, 0.8, 0.95}) {
      const double d = (1 - b) + 2 * b * t, h = 1e-5 * b;
      const double difference =
          (lens(1.0, b, d + h).volume() - lens(1.0, b, d - h).volume()) / (2 * h);
      EXPECT_NEAR(lens(1.0, b, d).derivative(), difference, 1e-8);
    }
  }
}

TEST(Lens, CapsSitWhereTheirBallsAre) {
  // Centroid by integrating discs along the axis.
  const double a = 1, b = 0.6, d = 0.9;
  const auto disc = [&](double x) {
    return std::max(0.0, std::min(a * a - x * x, b * b - (x - d) * (x - d)));
  };
  double volume = 0, moment = 0;
  const int n = 200'000;
  for (int i = 0; i < n; ++i) {
    const double x = d - b + (a - (d - b)) * (i + 0.5) / n;
    volume += disc(x);
    moment += disc(x) * x;
  }
  const auto l = lens(a, b, d);
  EXPECT_NEAR(l.cap_b * d / (l.cap_a + l.cap_b), moment / volume, 1e-8);
}

TEST(Lens, IsContinuousWhereItsBranchesMeet) {
  for (const double b : {1e-6, 0.5, 0.999}) {
    const double inside = 1 - b, outside = 1 + b, h = 1e-13 * b;
    const double whole = 4 * M_PI / 3 * b * b * b;
    EXPECT_NEAR(lens(1.0, b, inside - h).volume(), whole, 1e-9 * whole);
    EXPECT_NEAR(lens(1.0, b, inside + h).volume(), whole, 1e-9 * whole);
    EXPECT_LE(lens(1.0, b, outside - h).volume(), 1e-9 * whole);
    EXPECT_EQ(lens(1.0, b, outside + 2e-16).volume(), 0);
  }
  EXPECT_DOUBLE_EQ(lens(1.0, 1.0, 0.0).volume(), 4 * M_PI / 3);
  EXPECT_EQ(lens(1.0, 1.0, 0.0).derivative(), 0);
}

TEST(Lens, NeverNegativeOrNanAtTheEndsOfTheRange) {
  const testing::NoFloatTraps cubes_overflow;
  const double values[] = {0, 5e-324, 1e-310, 2.3e-308, 1e-160, 1e-100, 1e-8, 1, 1e8, 1e100, 1e150};
  for (const double a : values) {
    for (const double b : values) {
      for (const double d : values) {
        const auto l = lens(a, b, d);
        if (a < 1e100 && b < 1e100) {
          EXPECT_GE(l.volume(), 0) << a << ' ' << b << ' ' << d;
          EXPECT_LE(l.derivative(), 0) << a << ' ' << b << ' ' << d;
        }
        if (a == b && d < 1e-300 && a > 1e-90 && a < 1e90) {
          EXPECT_NEAR(l.volume() / (4 * M_PI / 3 * a * a * a), 1, 1e-12);
        }
      }
    }
  }
}

}  // namespace
}  // namespace ist
