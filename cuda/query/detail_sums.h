#pragma once

#include <cstdint>

#include "cuda/query/batch_steps.h"
#include "cuda/query/coincidence.h"
#include "cuda/query/detail_chain.h"
#include "cuda/query/quick_look.h"
#include "numerics/host_device.h"

// Pairs of trees that are asked at several levels of detail: under a pair budget, and copies of one
// asset that all but coincide. blend_details() (query/detail/detail_blend.h) by one team, in
// double, of sums in A's unit frame.

namespace ist::gpu {

struct DetailMemory {
  PairMemory pair;
  DetailChain chain;
  FilledMemory filled;
  LensTotals coarse, part, result;
  std::uint32_t spheres, visits;  ///< of all that was asked
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

  /// False if the pair is one for the finest levels' lenses alone.
  IST_HD bool run() {
    const double budget = batch_.pair_budget;
    if (team_.lane() == 0) {
      place_pair(batch_, pair_, m_.pair.place);
      m_.chain.plan(a_, b_, m_.pair.place.a_from_b.scale);
      m_.spheres = m_.visits = 0;
    }
    team_.sync();
    const int size = budget > 0 ? m_.chain.size : 1;
    QuickLooker<Team> looker(team_, a_, b_, m_.pair.place.a_from_b, m_.filled);
    DetailWeight sure = {1, 0};
    if (size > 1) sure = m_.chain.sure(looker.look(false).volume, budget);
    if (sure.weight == 1) {
      if (coincidence(m_.chain.pair[0]).weight == 0) return false;
      ask(m_.chain.pair[0]);
      finish(m_.part);
      return true;
    }
    descend(m_.chain.pair[size - 1].a, m_.chain.pair[size - 1].b);
    if (team_.lane() == 0) {
      m_.coarse = m_.pair.totals;
      m_.result.clear();
    }
    team_.sync();
    double slope = 0, sure_slope = 0;  // of the blend by the coarse sum, and by the quick look
    for (int i = size; i-- > 0;) {     // the order of the CPU's additions
      const DetailPair& levels = m_.chain.pair[i];
      const DetailWeight share = m_.chain.share(i, volume_of(m_.coarse), budget);
      const double alone = i == 0 ? 1 : 0;
      const double weight = sure.weight * alone + (1 - sure.weight) * share.weight;
      if (weight == 0 && share.slope == 0) continue;
      const bool have = i + 1 == size && coincidence(levels).weight == 0;
      if (!have) ask(levels);
      const LensTotals& part = have ? m_.coarse : m_.part;
      slope += (1 - sure.weight) * share.slope * volume_of(part);
      sure_slope += sure.slope * (alone - share.weight) * volume_of(part);
      if (team_.lane() == 0) add_part(part, weight, m_.result);
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

  /// `step`: what the sum grows by as what has the slope goes from 0 to 1.
  IST_HD static void add_slope(const PairSlope& slope, double step, LensTotals& sum) {
    for (int k = 0; k < 3; ++k) {
      sum.term[kForce + k] += -1 / (2 * kPi) * step * slope.by_translation[k];
      sum.term[kTorque + k] += -1 / (2 * kPi) * step * slope.by_rotation[k];
    }
  }

  IST_HD Coincidence coincidence(const DetailPair& levels) const {
    const DetailRef& tree = a_.level[levels.a];
    const bool alike = a_.first_alike == b_.first_alike && a_.coarser > 0 && levels.a == levels.b;
    return Coincidence(tree.tree.root, alike ? tree.mean_radius : 0, m_.pair.place.a_from_b);
  }

  /// The sum of two levels, or of unlike ones where copies all but coincide: to m_.part.
  IST_HD void ask(const DetailPair& levels) {
    const Coincidence same = coincidence(levels);
    const std::uint32_t a = levels.a, b = levels.b, other = a < a_.coarser ? a + 1 : a - 1;
    if (team_.lane() == 0) m_.part.clear();
    double unlike = 0;
    if (same.weight > 0) {
      add_descent(a, other, 0.5);
      add_descent(other, b, 0.5);
      unlike = volume_of(m_.part);
      if (same.weight == 1) return;
      team_.sync();
      if (team_.lane() == 0)
        for (double& term : m_.part.term) term *= same.weight;
    }
    add_descent(a, b, 1 - same.weight);
    if (same.weight > 0 && team_.lane() == 0)
      add_slope(same.slope, unlike - volume_of(m_.pair.totals), m_.part);
    team_.sync();
  }

  IST_HD void add_descent(std::uint32_t a, std::uint32_t b, double weight) {
    descend(a, b);
    if (team_.lane() == 0) add_part(m_.pair.totals, weight, m_.part);
    team_.sync();
  }

  /// The whole sum of two levels: to m_.pair.totals.
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

/// Sums pair i at the levels that it needs, or lists it with the others.
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
