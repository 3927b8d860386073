#pragma once

#include <ist/asset_layout.h>
#include <array>
#include <cmath>
#include <span>
#include <vector>

namespace ist {

/// A ball in double, unit frame.
struct Ball {
  double x = 0, y = 0, z = 0, r = 0;
};

/// The smallest ball that contains the given balls, to about 1e-9 of its radius. Deterministic;
/// uses only + − × ÷ sqrt. The set must not be empty.
Ball bounding_ball(std::span<const Ball> balls);

/// Smallest radius about (x, y, z) that contains the ball, before rounding.
inline double reach(double x, double y, double z, const Ball& ball) {
  const double dx = ball.x - x;
  const double dy = ball.y - y;
  const double dz = ball.z - z;
  return std::sqrt(dx * dx + dy * dy + dz * dz) + ball.r;
}

/// κ of every node of a tree: certified upper bounds on the number of its spheres that cover one
/// point. `spheres` are in tree order; `balls[k]` are the balls around each 16^(k+1) consecutive
/// ones. Returns bounds of the same shape as `balls`, followed by one entry {κ of the whole set}.
std::vector<std::vector<float>> overlap_bounds(std::span<const Ball> spheres,
                                               const std::vector<std::vector<Ball>>& balls);

/// One to sixteen balls, coordinate by coordinate; unused lanes repeat the first.
struct BallLanes {
  alignas(64) std::array<double, kWidth> x, y, z, r;
  std::size_t count = 0;

  Ball ball(std::size_t lane) const { return {x[lane], y[lane], z[lane], r[lane]}; }

  void put(std::size_t lane, const Ball& ball) {
    x[lane] = ball.x;
    y[lane] = ball.y;
    z[lane] = ball.z;
    r[lane] = ball.r;
  }

  /// Finishes a set whose balls are in lanes 0 … balls − 1.
  void close(std::size_t balls) {
    count = balls;
    for (std::size_t lane = balls; lane < kWidth; ++lane) put(lane, ball(0));
  }
};

inline constexpr int kMaxSupport =
    4;  ///< a smallest ball in space touches at most four from inside
inline constexpr double kBallSlack = 1e-10;  ///< relative to a ball's radius

/// The balls that touch a smallest ball.
struct Support {
  std::array<Ball, kMaxSupport> balls;
  int count = 0;
};

/// The step from one smallest ball to the next: `ball` becomes the smallest one of the support and
/// `added`, which it does not contain, and `support` the balls that touch it. False, without a
/// change, if there is none.
bool grow(Support& support, const Ball& added, Ball& ball);

}  // namespace ist
