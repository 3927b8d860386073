#pragma once

#include <cmath>
#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "cuda/base/atomics.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/patch_memory.h"

// The steps of a batch of contact patches; batch_steps.h has those of penetrations. One team
// processes a pair from beginning to end.

namespace ist::gpu {

/// Adds value(k, term) to target(key(k))[term] for k < count, in this order. Each term belongs to
/// one lane, which loads and stores the target when the key changes.
template <class Team, class Key, class Value, class Target>
IST_HD void add_by_runs(const Team& team, int count, const Key& key, const Value& value,
                        const Target& target) {
  for (int term = team.lane(); count > 0 && term < kTerms; term += Team::kWidth) {
    int run = key(0);
    double sum = value(0, term);
    IST_ROLLED
    for (int k = 1; k < count; ++k) {
      const int next = key(k);
      if (next != run) {
        target(run)[term] += sum;
        sum = 0;
        run = next;
      }
      sum += value(k, term);
    }
    target(run)[term] += sum;
  }
  team.sync();
}

/// Receives a traversal's lenses: adds them to the bins of one of the trees, in double.
template <class Team>
class BinSums {
 public:
  /// Clears the bins, which are B's if `of_b`.
  IST_HD BinSums(const Team& team, PatchMemory& memory, PatchBin* bins, const CutsRef& cuts,
                 bool of_b)
      : team_(team), m_(memory), bins_(bins), rank_(cuts.rank), shift_(cuts.shift), of_b_(of_b) {
    for (int w = team.lane(); w < words_of(cuts); w += Team::kWidth) m_.marked[w] = 0;
  }

  IST_HD float (&begin())[kTerms] {
    for (float& s : term_) s = 0;
    return term_;
  }

  IST_HD void end(bool flag, std::uint32_t number_a, std::uint32_t number_b) {
    const bool adds = flag && term_[kCaps] > 0;
    int total = 0;
    const int place = team_.exclusive_count(adds, total);
    const std::uint32_t bin =
        adds ? in_global_memory(rank_)[(of_b_ ? number_b : number_a) >> shift_] : 0;
    const std::uint32_t bit = 1u << bin % 32;
    const bool fresh = adds && (m_.marked[bin / 32] & bit) == 0;
    if (adds) {
      m_.bin[place] = static_cast<int>(bin);
      for (int t = 0; t < kTerms; ++t) m_.term[place][t] = term_[t];
    }
    if (team_.any(fresh) && fresh) {
      for (double& t : in_global_memory(bins_)[bin].term) t = 0;
      atomic_or(&m_.marked[bin / 32], bit);
    }
    team_.sync();
    add_by_runs(
        team_, total, [&](int k) { return m_.bin[k]; },
        [&](int k, int term) { return static_cast<double>(m_.term[k][term]); },
        [&](int run) { return in_global_memory(bins_)[run].term; });
  }

  IST_HD bool full() const { return false; }
  IST_HD void fold() {}

 private:
  const Team& team_;
  PatchMemory& m_;
  PatchBin* bins_;
  const std::uint16_t* rank_;
  int shift_;
  bool of_b_;
  float term_[kTerms] = {};  ///< this lane's
};

/// Divides the binned sums into parts: ContactDivision (query/contact/write_patches.cpp) by a
/// team, along the regions of CutsRef.
template <class Team>
class PatchDivision {
 public:
  /// `radius`: that of the divided tree's root, A's unit frame.
  IST_HD PatchDivision(const Team& team, PatchMemory& memory, const PatchWorkspace& work,
                       const CutsRef& cuts, double radius)
      : team_(team),
        m_(memory),
        work_(work),
        cuts_(cuts),
        bend_cost_(kContactBend * radius * radius) {
    list_bins();
    finish_bins();
    add_up_pulls();
  }

  /// The sums of all bins, A's unit frame.
  IST_HD void add_up(double (&sum)[kTerms]) const {
    for (double& s : sum) s = 0;
    for (int k = team_.lane(); k < bins_; k += Team::kWidth)
      for (int t = 0; t < kTerms; ++t) sum[t] += bin(k).term[t];
    for (double& s : sum) s = team_.sum(s);
  }

  /// Divides until there are `wanted` parts or none can be divided. Returns their number.
  IST_HD int run(int wanted) {
    if (bins_ == 0 || wanted == 0) return 0;
    for (int k = team_.lane(); k < bins_; k += Team::kWidth) work_.member[k] = 0;
    team_.sync();
    set_part(0, 0);
    int size = 1;
    while (size < wanted) {
      const int worst = next_to_divide(size);
      if (worst < 0) break;
      if (divide(worst, size)) ++size;
    }
    for (int p = team_.lane(); p < size; p += Team::kWidth)
      for (double& t : work_.parts->part[p].term) t = 0;
    team_.sync();
    add_by_runs(
        team_, bins_, [&](int k) { return static_cast<int>(work_.member[k]); },
        [&](int k, int term) { return bin(k).term[term]; },
        [&](int p) { return work_.parts->part[p].term; });
    return size;
  }

 private:
  IST_HD PatchBin& bin(int k) const { return work_.bin[work_.rank[k]]; }

  IST_HD void list_bins() {
    const int words = words_of(cuts_);
    team_.sync();
    for (int w = team_.lane(); w <= words; w += Team::kWidth) {
      int before = 0;
      for (int v = 0; v < w; ++v) before += count_bits(m_.marked[v]);
      m_.bins_before[w] = static_cast<std::uint16_t>(before);
      for (std::uint32_t left = w < words ? m_.marked[w] : 0; left != 0; left &= left - 1)
        work_.rank[before++] = static_cast<std::uint16_t>(32 * w + lowest_bit(left));
    }
    team_.sync();
    bins_ = m_.bins_before[words];
  }

  IST_HD void finish_bins() {
    const double back = 1 / m_.pair.unit;
    for (int k = team_.lane(); k < bins_; k += Team::kWidth) {
      PatchBin& of = bin(k);
      IST_ROLLED
      for (int t = 0; t < kTerms; ++t) of.term[t] *= term_factor(back, t);
      of.pull = std::sqrt(square(of.term[kForce], of.term[kForce + 1], of.term[kForce + 2]));
    }
    team_.sync();
  }

  IST_HD void add_up_pulls() {
    const int each = (bins_ + Team::kWidth - 1) / Team::kWidth;
    const int begin = each * team_.lane();
    const int end = begin + each < bins_ ? begin + each : bins_;
    double mine = 0, before = 0;
    for (int k = begin; k < end; ++k) mine += bin(k).pull;
    IST_ROLLED
    for (int lane = 0; lane < Team::kWidth; ++lane) {
      const double pull = team_.broadcast(mine, lane);
      total_ += pull;
      if (lane < team_.lane()) before += pull;
    }
    for (int k = begin; k < end; ++k) {
      bin(k).before = before;
      before += bin(k).pull;
    }
    team_.sync();
  }

  /// The number of non-empty bins of lower rank.
  IST_HD int bins_below(std::uint32_t rank) const {
    const std::uint32_t bit = rank % 32, below = bit == 0 ? 0 : m_.marked[rank / 32] << (32 - bit);
    return m_.bins_before[rank / 32] + count_bits(below);
  }
  IST_HD double pull_below(int k) const { return k < bins_ ? bin(k).before : total_; }

  IST_HD static double square(double x, double y, double z) { return (x * x + y * y) + z * z; }

  /// Sets part p, whose bins are marked, to a region.
  IST_HD void set_part(int p, std::uint32_t node) {
    double pull = 0, force[3] = {0, 0, 0}, mean[3] = {0, 0, 0};
    int count = 0;
    IST_ROLLED
    for (int k = team_.lane(); k < bins_; k += Team::kWidth) {
      if (work_.member[k] != p) continue;
      const PatchBin& of = bin(k);
      const double share = of.pull / of.term[kCaps];
      pull += of.pull;
      for (int i = 0; i < 3; ++i) {
        force[i] += of.term[kForce + i];
        mean[i] += share * of.term[kMoment + i];
      }
      ++count;
    }
    pull = team_.sum(pull);
    count = team_.sum(count);
    double loss = 0;
    if (count > 1 && pull > 0) {
      for (int i = 0; i < 3; ++i) {
        force[i] = team_.sum(force[i]);
        mean[i] = team_.sum(mean[i]) / pull;
      }
      IST_ROLLED
      for (int k = team_.lane(); k < bins_; k += Team::kWidth) {
        if (work_.member[k] != p) continue;
        const PatchBin& of = bin(k);
        const double per = 1 / of.term[kCaps];
        loss +=
            of.pull * square(of.term[kMoment] * per - mean[0], of.term[kMoment + 1] * per - mean[1],
                             of.term[kMoment + 2] * per - mean[2]);
      }
      const double bent = pull - std::sqrt(square(force[0], force[1], force[2]));
      loss = team_.sum(loss) + bend_cost_ * (bent > 0 ? bent : 0);
    }
    if (team_.lane() == 0) {
      PatchPart& part = work_.parts->part[p];
      part.loss = loss;
      part.pull = pull;
      part.node = node;
      part.bins = static_cast<std::uint32_t>(count);
    }
    team_.sync();
  }

  /// The part with the largest loss, among equals that with the lowest id; −1 if no part has a
  /// loss.
  IST_HD int next_to_divide(int size) const {
    const PatchPart* const parts = work_.parts->part;
    double most = 0;
    for (int p = team_.lane(); p < size; p += Team::kWidth)
      most = parts[p].loss > most ? parts[p].loss : most;
    most = team_.max(most);
    if (!(most > 0)) return -1;
    std::uint64_t id = ~std::uint64_t{0};
    int found = size;
    for (int p = team_.lane(); p < size; p += Team::kWidth) {
      if (parts[p].loss != most || cuts_.node[parts[p].node].id >= id) continue;
      id = cuts_.node[parts[p].node].id;
      found = p;
    }
    const std::uint64_t least = team_.min(id);
    return team_.min(id == least ? found : size);
  }

  /// Divides part p into itself and part `other`. False if it cannot be divided.
  IST_HD bool divide(int p, int other) {
    const PatchPart& part = work_.parts->part[p];
    const CutNode* const nodes = in_global_memory(cuts_.node);
    const double least = kLeastContactShare * total_, pull = part.pull;
    const int all = static_cast<int>(part.bins);
    std::uint32_t at = part.node;  // descends while everything that counts is on one side
    int begin = bins_below(nodes[at].begin), middle = 0;
    for (;;) {
      const std::uint32_t rest = nodes[at].rest;
      if (rest == 0) {
        team_.sync();
        if (team_.lane() == 0) work_.parts->part[p].loss = 0;
        team_.sync();
        return false;
      }
      middle = bins_below(nodes[at + 1].end);
      const double on_side = pull_below(middle) - pull_below(begin);
      if (middle - begin == all || pull - on_side < least) {
        ++at;
      } else if (middle == begin || on_side < least) {
        at = rest;
        begin = middle;
      } else {
        const std::uint32_t side = at + 1;
        team_.sync();
        for (int k = begin + team_.lane(); k < middle; k += Team::kWidth)
          work_.member[k] = static_cast<std::uint8_t>(other);
        team_.sync();
        set_part(other, side);
        set_part(p, rest);
        return true;
      }
    }
  }

  const Team& team_;
  PatchMemory& m_;
  const PatchWorkspace& work_;
  const CutsRef& cuts_;
  const double bend_cost_;  ///< per unit of pull that cancels
  double total_ = 0;        ///< Σ pull
  int bins_ = 0;            ///< non-empty
};

/// True if pair i needs a sum; else writes its answer. One thread per pair.
IST_HD inline bool sift_patches(const PatchArrays& batch, std::uint32_t i) {
  PairPlace place;
  const QueryStatus status = place_trees(batch.pairs, i, place);
  const bool sums = status == QueryStatus::ok && sift_finest(batch.pairs, i, place) > 0;
  if (status != QueryStatus::ok) write_nothing(batch.pairs.answers, i, status);
  if (!sums && batch.patches.count != nullptr) batch.patches.count[i] = 0;
  return sums;
}

/// Converts parts to world units and corrects their sums so that they equal the whole's except for
/// the last digit (write_patches(), query/contact/write_patches.cpp).
template <class Team>
class PatchWriter {
 public:
  /// `origin_b`: [u] B's origin, world.
  IST_HD PatchWriter(const Team& team, const PatchMemory& memory, PatchParts& parts,
                     const CutsRef& cuts, int size, const Vec3& origin_b)
      : team_(team),
        place_(memory.pair.place),
        parts_(parts),
        cuts_(cuts),
        size_(size),
        origin_b_(origin_b) {
    const double a = memory.pair.tree[0].root[3];
    const double b = memory.pair.tree[1].root[3] * place_.a_from_b.scale;
    deepest_ = 2 * place_.unit_a * (a < b ? a : b);
  }

  IST_HD void write(const GpuContactPatches& to, std::uint32_t pair) {
    for (int p = team_.lane(); p < size_; p += Team::kWidth) {
      parts_.part[p].world = world_sums(place_, parts_.part[p].term);
      int before = 0;
      for (int q = 0; q < size_; ++q) before += id(q) < id(p) ? 1 : 0;
      parts_.order[before] = static_cast<std::uint32_t>(p);
    }
    team_.sync();
    // One lane for each number of volume, push and turn.
    constexpr int kNumbers = 7;
    for (int n = team_.lane(); n < kNumbers; n += Team::kWidth) complete(n);
    team_.sync();
    for (int k = team_.lane(); k < size_; k += Team::kWidth)
      write_row(to, std::uint64_t{pair} * to.most + static_cast<std::uint64_t>(k),
                row(patch(k), id(static_cast<int>(parts_.order[k]))));
  }

 private:
  IST_HD std::uint64_t id(int part) const { return cuts_.node[parts_.part[part].node].id; }
  IST_HD WorldSums& patch(int k) const { return parts_.part[parts_.order[k]].world; }

  IST_HD static double& number(WorldSums& of, int n) {
    return n == 0  ? of.volume
           : n < 4 ? of.translation_gradient[n - 1]
                   : of.rotation_gradient[n - 4];
  }

  /// Adds a number's missing part to the largest patch.
  IST_HD void complete(int n) {
    // Compared by the terms, since another lane writes the volumes.
    int largest = 0;
    for (int k = 1; k < size_; ++k)
      if (caps(k) > caps(largest)) largest = k;
    const double whole = number(parts_.whole, n);
    for (int round = 0; round < 2; ++round) {
      double missing = whole;
      for (int k = 0; k < size_; ++k) missing -= number(patch(k), n);
      number(patch(largest), n) += missing;
    }
  }
  IST_HD double caps(int k) const { return parts_.part[parts_.order[k]].term[kCaps]; }

  IST_HD PatchRow row(const WorldSums& sums, std::uint64_t id) const {
    const Vec3 force = -sums.translation_gradient, torque = -sums.rotation_gradient;
    return {PatchAxis::of(sums.volume, sums.centroid, force, torque, origin_b_, deepest_),
            id,
            sums.volume,
            sums.centroid,
            force,
            torque};
  }

  const Team& team_;
  const PairPlace& place_;
  PatchParts& parts_;
  const CutsRef& cuts_;
  const int size_;
  const Vec3 origin_b_;
  double deepest_;  ///< [u] of any patch
};

template <class Team>
IST_HD void patch_pair(const Team& team, const PatchArrays& batch, std::uint32_t i,
                       const PatchWorkspace& work, PatchMemory& memory) {
  const BatchArrays& pairs = batch.pairs;
  PairMemory& pair = memory.pair;
  if (team.lane() == 0) place_pair(pairs, i, pair.place);
  load_trees(team, pairs, i, pair);
  const double scale = pair.place.a_from_b.scale;
  const bool of_b = divides_b(pair.tree[0].leaf_blocks, pair.tree[0].root[3],
                              pair.tree[1].leaf_blocks, pair.tree[1].root[3] * scale);
  const CutsRef cuts = pairs.solids[(of_b ? pairs.pairs.b : pairs.pairs.a).solid[i]]
                           .cuts[static_cast<int>(pairs.measure)];
  {
    PairDescent<Team, BinSums<Team>> descent(team, pair,
                                             BinSums<Team>(team, memory, work.bin, cuts, of_b));
    descent.start();
    descent.run(0, ~0u);
  }
  PatchDivision<Team> division(team, memory, work, cuts,
                               of_b ? pair.tree[1].root[3] * scale : pair.tree[0].root[3]);
  double sum[kTerms];
  division.add_up(sum);
  if (team.lane() == 0) {
    for (int t = 0; t < kTerms; ++t) pair.totals.term[t] = sum[t];
    work.parts->whole = world_sums(pair.place, pair.totals.term);
    write_answer(pairs.answers, i, world_sums(pair.place, pair.totals), pair.totals);
  }
  team.sync();
  const int size = division.run(static_cast<int>(batch.patches.most));
  if (team.lane() == 0 && batch.patches.count != nullptr)
    batch.patches.count[i] = static_cast<std::uint32_t>(size);
  if (size > 0)
    PatchWriter<Team>(team, memory, *work.parts, cuts, size, vec3(pose_of(pairs.pairs.b, i).t))
        .write(batch.patches, i);
  team.sync();
}

}  // namespace ist::gpu
