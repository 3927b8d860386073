#pragma once

#include <array>

#include "bake/cluster/bounding_ball.h"

namespace ist {

inline constexpr int kMaxSupport =
    4;  ///< a smallest ball in space touches at most four from inside
inline constexpr double kBallSlack = 1e-10;  ///< relative to a ball's radius

/// Balls that a smallest ball touches.
struct Support {
  std::array<Ball, kMaxSupport> balls;
  int count = 0;
};

/// The step from one smallest ball to the next: `ball` becomes the smallest one of the support and
/// `added`, which `ball` does not contain, and `support` what that touches. False, and nothing is
/// changed, if there is none.
bool grow(Support& support, const Ball& added, Ball& ball);

}  // namespace ist
