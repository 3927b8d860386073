#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/part_sums.h"

// The result of a traversal: balls that triangles intersect, each with the triangles that may.

namespace ist::gpu {

constexpr int kHeldBalls = 128;
constexpr int kPairCapacity = 256;  ///< of balls and triangles
constexpr int kPairsAtFirst = 128;  ///< no block's test begins with more
constexpr std::uint8_t kNotHeld = 255;
static_assert(kHeldBalls % 32 == 0 && kHeldBalls <= kNotHeld);
static_assert(kItems == 32 && kPairsAtFirst + kItems <= kPairCapacity);  // a word has a bit an item

/// A ball of a tree, 16 · block + lane, and whether its centre is inside, in one word.
using MetBall = std::uint32_t;
constexpr MetBall kCentreInside = MetBall{1} << 31;

/// A view of such balls and pairs. `Id`: the type of a triangle's name.
template <class Id>
struct MetView {
  const MetBall* balls;
  const Id* triangles;          ///< [pairs]
  const std::uint8_t* of_ball;  ///< [pairs]
  int ball_count, pair_count;
};

template <class Id>
struct MetBalls {
  MetBall balls[kHeldBalls];
  Id triangles[kPairCapacity];
  std::uint8_t of_ball[kPairCapacity];
};

/// Adds a ball that is inside or outside except for cones over the triangles that intersect it. Its
/// centre is at x, field's frame.
IST_HD inline void add_ball(const Similarity& a_from_b, const double (&x)[3], double r, bool inside,
                            double cones, PartSums& sums) {
  const double whole = ball_volume(r);
  const double part = (inside ? whole : 0) + cones;
  const double volume = part < 0 ? 0 : part > whole ? whole : part;
  const double none[3] = {0, 0, 0};
  const double at[3] = {x[0] - a_from_b.t[0], x[1] - a_from_b.t[1], x[2] - a_from_b.t[2]};
  sums.add(at, volume, none, none);
  sums.spheres += inside && cones == 0 ? 1 : 0;
}

}  // namespace ist::gpu
