#pragma once

#include <cmath>
#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/solid_ref.h"
#include "query/base/pair_place.h"
#include "query/lod/level_chain.h"
#include "query/lod/level_pair.h"

// Pairs of trees that need several levels of detail: under a pair budget, and copies of one asset
// that nearly coincide. This is blend_levels() (query/lod/level_blend.h) by one team, in double,
// with sums in A's unit frame.

namespace ist::gpu {

struct FilledMemory {
  FilledBall ball[2][kMostFilled];
};

/// A coarse estimate of the overlap of two assets from their coarsest levels, A's unit frame.
struct QuickLook {
  double volume;
  PoseSlope slope;
};

/// quick_look() (query/kernel/look_kernel.cpp) by a team, in double.
template <class Team>
class QuickLooker {
 public:
  IST_HD QuickLooker(const Team& team, const AssetDetails& a, const AssetDetails& b,
                     const Similarity& map, FilledMemory& memory)
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
    map_.apply_fused(centre_b, middle_b);
    const int count_a = place(0, middle_b, b_.filled_reach * map_.scale);
    const int count_b = place(1, middle_a, a_.filled_reach);
    double volume = 0, force[3] = {0, 0, 0}, torque[3] = {0, 0, 0};
    for (int k = team_.lane(); k < count_a * count_b; k += Team::kWidth) {
      const FilledBall &a = m_.ball[0][k % count_a], &b = m_.ball[1][k / count_a];
      const double d[3] = {b.x[0] - a.x[0], b.x[1] - a.x[1], b.x[2] - a.x[2]};
      const double reach = a.r + b.r, step = a.r > b.r ? a.r - b.r : b.r - a.r;
      double distance = sqrt((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
      // A ball inside the other is treated as one that touches it from inside.
      distance = distance > step ? distance : step;
      if (!(distance < reach)) continue;
      distance = distance > kLeastDistance ? distance : kLeastDistance;
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
  /// Lists the balls of a side that come within a reach of a point, and returns their number.
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
          map_.apply_fused(from, ball.x);
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
  const Similarity& map_;
  FilledMemory& m_;
};

struct DetailMemory {
  PairMemory pair;
  LevelChain chain;
  LevelWeight share[LevelChain::kMost];  ///< of the pairs of levels, from the coarse sum
  FilledMemory filled;
  LensTotals coarse, part, result;
  std::uint32_t spheres, visits;  ///< of all sums together
};

template <class Team>
class DetailSums {
 public:
  IST_HD DetailSums(const Team& team, const BatchArrays& batch, std::uint32_t pair,
                    DetailMemory& memory)
      : team_(team),
        batch_(batch),
        pair_(pair),
        m_(memory),
        a_(solid_of(batch, batch.pairs.a, pair).details),
        b_(solid_of(batch, batch.pairs.b, pair).details) {}

  /// False if the finest levels alone answer the pair.
  IST_HD bool run() {
    const double budget = batch_.pair_budget;
    if (team_.lane() == 0) {
      place_pair(batch_, pair_, m_.pair.place);
      m_.chain.plan(
          a_.coarser, [&](std::uint32_t i) { return a_.level[i].level; }, b_.coarser,
          [&](std::uint32_t i) { return b_.level[i].level; }, m_.pair.place.a_from_b.scale);
      m_.spheres = m_.visits = 0;
    }
    team_.sync();
    const std::size_t size = budget > 0 ? m_.chain.size() : 1;
    QuickLooker<Team> looker(team_, a_, b_, m_.pair.place.a_from_b, m_.filled);
    LevelWeight sure = {1, 0};
    if (size > 1) sure = m_.chain.quick_weight(looker.look(false).volume, budget);
    const bool blends = sure.weight < 1;
    if (!blends && coincidence(m_.chain[0]).weight == 0) return false;
    if (team_.lane() == 0) {
      m_.coarse.clear();
      m_.result.clear();
    }
    double slope = 0,
           sure_slope = 0;  // derivatives of the blend by the coarse sum and by the coarse estimate
    // The coarse sum comes first, then the CPU's order of additions. A single call of ask() serves
    // all of them: several would not fit the instruction cache.
    IST_ROLLED
    for (std::size_t i = blends ? size + 1 : 1; i-- > 0;) {
      const bool estimates = i == size;
      const LevelPair& levels = m_.chain[estimates ? size - 1 : i];
      const LevelWeight share = blends && !estimates ? m_.share[i] : LevelWeight{1, 0};
      const double alone = i == 0 ? 1 : 0;
      const double weight = sure.weight * alone + (1 - sure.weight) * share.weight;
      if (weight == 0 && share.slope == 0) continue;
      const bool have = blends && i + 1 == size && coincidence(levels).weight == 0;
      if (!have) ask(levels, estimates);
      const LensTotals& part = have ? m_.coarse : m_.part;
      if (estimates) {
        if (team_.lane() == 0) {
          m_.coarse = m_.part;
          m_.chain.share(
              volume_of(m_.coarse), budget,
              [](std::size_t k) {
                return LevelWeight{k == 0 ? 1.0 : 0.0, 0};
              },
              [&](std::size_t k, const LevelWeight& found) { m_.share[k] = found; });
        }
      } else {
        slope += (1 - sure.weight) * share.slope * volume_of(part);
        sure_slope += sure.slope * (alone - share.weight) * volume_of(part);
        if (team_.lane() == 0) add_part(part, weight, m_.result);
      }
      team_.sync();
    }
    QuickLook seen = {};
    if (sure_slope != 0) seen = looker.look(true);
    if (team_.lane() == 0) {
      for (int k = 0; k < 6; ++k) m_.result.term[kForce + k] += slope * m_.coarse.term[kForce + k];
      add_slope(seen.slope, sure_slope, m_.result);
    }
    team_.sync();
    finish(m_.result);
    return true;
  }

 private:
  IST_HD static double volume_of(const LensTotals& totals) { return kPi / 3 * totals.term[kCaps]; }

  IST_HD static void add_part(const LensTotals& part, double weight, LensTotals& sum) {
    for (int k = 0; k < kTerms; ++k) sum.term[k] += weight * part.term[k];
  }

  /// `step`: the change of the sum as the weight with this slope goes from 0 to 1.
  IST_HD static void add_slope(const PoseSlope& slope, double step, LensTotals& sum) {
    for (int k = 0; k < 3; ++k) {
      sum.term[kForce + k] += -1 / (2 * kPi) * step * slope.by_translation[k];
      sum.term[kTorque + k] += -1 / (2 * kPi) * step * slope.by_rotation[k];
    }
  }

  IST_HD CoincidenceWeight coincidence(const LevelPair& levels) const {
    const DetailRef& tree = a_.level[levels.a];
    const bool alike = a_.first_alike == b_.first_alike && a_.coarser > 0 && levels.a == levels.b;
    return coincidence_weight(tree.tree.root, alike ? tree.level.mean_radius : 0,
                              m_.pair.place.a_from_b);
  }

  /// Writes the sum of two levels to m_.part. If copies nearly coincide and this is no estimate,
  /// unlike levels are summed.
  IST_HD void ask(const LevelPair& levels, bool estimates) {
    const CoincidenceWeight same = estimates ? CoincidenceWeight() : coincidence(levels);
    const std::uint32_t a = levels.a, b = levels.b, other = a < a_.coarser ? a + 1 : a - 1;
    if (team_.lane() == 0) m_.part.clear();
    double unlike = 0;
    IST_ROLLED
    for (int k = same.weight > 0 ? 0 : 2; k < (same.weight == 1 ? 2 : 3); ++k) {
      if (k == 2 && same.weight > 0) {
        unlike = volume_of(m_.part);
        team_.sync();
        if (team_.lane() == 0)
          for (double& term : m_.part.term) term *= same.weight;
      }
      descend(k == 1 ? other : a, k == 0 ? other : b);
      if (team_.lane() == 0) add_part(m_.pair.totals, k < 2 ? 0.5 : 1 - same.weight, m_.part);
      team_.sync();
    }
    if (same.weight > 0 && same.weight < 1 && team_.lane() == 0)
      add_slope(same.slope, unlike - volume_of(m_.pair.totals), m_.part);
    team_.sync();
  }

  /// Writes the complete sum of two levels to m_.pair.totals.
  IST_HD void descend(std::uint32_t a, std::uint32_t b) {
    team_.sync();
    copy_words(team_, a_.level[a].tree, m_.pair.tree[0]);
    copy_words(team_, b_.level[b].tree, m_.pair.tree[1]);
    team_.sync();
    PairDescent<Team> descent(team_, m_.pair);
    descent.start();
    descent.run(0, ~0u);
    if (team_.lane() == 0) {
      m_.spheres += m_.pair.totals.spheres;
      m_.visits += m_.pair.totals.visits;
    }
    team_.sync();
  }

  IST_HD void finish(LensTotals& totals) {
    if (team_.lane() == 0) {
      totals.spheres = m_.spheres;
      totals.visits = m_.visits;
      write_answer(batch_.answers, pair_, world_sums(m_.pair.place, totals), totals);
    }
    team_.sync();
  }

  const Team& team_;
  const BatchArrays& batch_;
  const std::uint32_t pair_;
  DetailMemory& m_;
  const AssetDetails& a_;
  const AssetDetails& b_;
};

/// Sums pair i at the levels that it needs, or lists it among those of the finest levels.
template <class Team>
IST_HD void sum_details(const Team& team, const BatchArrays& batch, std::uint32_t i,
                        DetailMemory& memory) {
  if (DetailSums<Team>(team, batch, i, memory).run()) return;
  if (team.lane() == 0) {
    const std::uint32_t meet = sift_finest(batch, i, memory.pair.place);
    if (meet > 0) list_pair(batch, i, meet, atomic_add(&batch.counters->listed, 1));
  }
  team.sync();
}

}  // namespace ist::gpu
