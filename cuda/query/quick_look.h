#pragma once

#include <cmath>

#include "cuda/query/coincidence.h"
#include "cuda/query/detail_ref.h"
#include "numerics/host_device.h"
#include "query/asset/shared_constants.h"

namespace ist::gpu {

struct FilledMemory {
  FilledBall ball[2][kMostFilled];
};

/// What two assets overlap by as a quick look at their coarsest levels sees them, A's unit frame.
struct QuickLook {
  double volume;
  PairSlope slope;
};

/// quick_look() (query/kernel/look_kernel.h) by a team, in double.
template <class Team>
class QuickLooker {
 public:
  IST_HD QuickLooker(const Team& team, const AssetDetails& a, const AssetDetails& b,
                     const PairMap& map, FilledMemory& memory)
      : team_(team), a_(a), b_(b), map_(map), m_(memory) {}

  IST_HD QuickLook look(bool slopes) {
    QuickLook sum = {};
    const double(&root_a)[4] = a_.level[a_.coarser].tree.root;
    const double(&root_b)[4] = b_.level[b_.coarser].tree.root;
    const double reach_a = kPokeOut * root_a[3], reach_b = kPokeOut * (root_b[3] * map_.scale);
    if (!(reach_a > kSpeck * reach_b && reach_b > kSpeck * reach_a)) return sum;
    const double middle_a[3] = {root_a[0], root_a[1], root_a[2]};
    const double centre_b[3] = {root_b[0], root_b[1], root_b[2]};
    double middle_b[3];
    map_.apply(centre_b, middle_b);
    const int count_a = place(0, middle_b, b_.filled_reach * map_.scale);
    const int count_b = place(1, middle_a, a_.filled_reach);
    double volume = 0, force[3] = {0, 0, 0}, torque[3] = {0, 0, 0};
    for (int k = team_.lane(); k < count_a * count_b; k += Team::kWidth) {
      const FilledBall &a = m_.ball[0][k % count_a], &b = m_.ball[1][k / count_a];
      const double d[3] = {b.x[0] - a.x[0], b.x[1] - a.x[1], b.x[2] - a.x[2]};
      const double reach = a.r + b.r, step = a.r > b.r ? a.r - b.r : b.r - a.r;
      double distance = sqrt((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
      // A ball that the other holds overlaps as one that touches it from inside.
      distance = distance > step ? distance : step;
      if (!(distance < reach) || !(distance > 0)) continue;
      const double inverse = 1 / distance, depth = reach - distance;
      const double filled = b.fill * a.fill * depth;
      volume += filled * depth * ((distance + 2 * reach) - 3 * step * (step * inverse));
      if (!slopes) continue;
      const double pull =
          filled * (reach + distance) *
          (((distance - step) * inverse) * (((distance + step) * inverse) * inverse));
      const double arm[3] = {b.x[0] - map_.t[0], b.x[1] - map_.t[1], b.x[2] - map_.t[2]};
      for (int axis = 0; axis < 3; ++axis) {
        const int l = (axis + 1) % 3, m = (axis + 2) % 3;
        force[axis] += pull * d[axis];
        torque[axis] += arm[l] * (pull * d[m]) - arm[m] * (pull * d[l]);
      }
    }
    sum.volume = kPi / 12 * team_.sum(volume);
    for (int axis = 0; slopes && axis < 3; ++axis) {
      sum.slope.by_translation[axis] = -kPi / 4 * team_.sum(force[axis]);
      sum.slope.by_rotation[axis] = -kPi / 4 * team_.sum(torque[axis]);
    }
    team_.sync();
    return sum;
  }

 private:
  /// Lists the balls of a side that come within a reach of a point; returns how many.
  IST_HD int place(int side, const double (&middle)[3], double reach) {
    const AssetDetails& asset = side == 0 ? a_ : b_;
    int count = 0;
    for (int base = 0; base < static_cast<int>(asset.filled_count); base += Team::kWidth) {
      FilledBall ball = {};
      bool near = false;
      if (base + team_.lane() < static_cast<int>(asset.filled_count)) {
        ball = asset.filled[base + team_.lane()];
        if (side == 1) {
          const double from[3] = {ball.x[0], ball.x[1], ball.x[2]};
          map_.apply(from, ball.x);
          ball.r *= map_.scale;
        }
        const double d[3] = {ball.x[0] - middle[0], ball.x[1] - middle[1], ball.x[2] - middle[2]};
        const double sum = ball.r + reach;
        near = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2] <= sum * sum;
      }
      int total = 0;
      const int at = count + team_.exclusive_count(near, total);
      if (near) m_.ball[side][at] = ball;
      count += total;
    }
    team_.sync();
    return count;
  }

  const Team& team_;
  const AssetDetails& a_;
  const AssetDetails& b_;
  const PairMap& map_;
  FilledMemory& m_;
};

}  // namespace ist::gpu
