#pragma once

#include <ist/asset_layout.h>
#include <array>

#include "bake/cluster/bounding_ball.h"

namespace ist {

/// One to sixteen balls, coordinate by coordinate; lanes behind them repeat the first.
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

  /// The balls are lanes 0 … balls − 1, which are put already.
  void close(std::size_t balls) {
    count = balls;
    for (std::size_t lane = balls; lane < kWidth; ++lane) put(lane, ball(0));
  }
};

inline constexpr int kMaxSupport =
    4;  ///< a smallest ball in space touches at most four from inside
inline constexpr double kBallSlack = 1e-10;  ///< relative to a ball's radius

/// Balls that a smallest ball touches.
struct Support {
  std::array<Ball, kMaxSupport> balls;
  int count = 0;
};

/// The step from one smallest ball to the next: `ball` becomes the smallest one of the support and
/// `added`, which it does not contain, and `support` what that touches. False, and no change, if
/// there is none.
bool grow(Support& support, const Ball& added, Ball& ball);

}  // namespace ist
