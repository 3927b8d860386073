#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/batch_steps.h"
#include "cuda/query/patch_arrays.h"
#include "cuda/query/patch_division.h"
#include "numerics/host_device.h"

// A batch of contact patches, step by step, as batch_steps.h has penetrations. A pair is one team's
// from beginning to end.

namespace ist::gpu {

/// Whether pair i is to be summed; else it is answered. One thread a pair.
IST_HD inline bool sift_patches(const PatchArrays& batch, std::uint32_t i) {
  PairPlace place;
  const QueryStatus status = place_trees(batch.pairs, i, place);
  const bool sums = status == QueryStatus::ok && sift_finest(batch.pairs, i, place) > 0;
  if (status != QueryStatus::ok) write_nothing(batch.pairs.answers, i, status);
  if (!sums && batch.patches.count != nullptr) batch.patches.count[i] = 0;
  return sums;
}

/// Whether contacts are divided along B's tree (divides_b(), query/contact_patches.cpp).
IST_HD inline bool divides_b(const TreeRef& a, const TreeRef& b, double scale) {
  const std::uint32_t blocks_a = a.leaf_blocks, blocks_b = b.leaf_blocks;
  const std::uint32_t fewer = blocks_a < blocks_b ? blocks_a : blocks_b;
  if (fewer < kFewContactBlocks && blocks_a != blocks_b) return blocks_b > blocks_a;
  return b.root[3] * scale <= a.root[3];
}

/// What the parts are in the world, their sums made to give the whole's but for the last digit
/// (write_patches(), query/contact/write_patches.cpp).
template <class Team>
class PatchWriter {
 public:
  IST_HD PatchWriter(const Team& team, const PatchMemory& memory, PatchParts& parts,
                     const CutsRef& cuts, int size)
      : team_(team), place_(memory.pair.place), parts_(parts), cuts_(cuts), size_(size) {
    const double a = memory.pair.tree[0].root[3];
    const double b = memory.pair.tree[1].root[3] * place_.a_from_b.scale;
    deepest_ = 2 * place_.unit_a * (a < b ? a : b);
    for (int k = 0; k < 3; ++k) {
      const double* const r = place_.rotation_a + 3 * k;
      const double(&t)[3] = place_.a_from_b.t;
      origin_b_[k] = place_.origin_a[k] +
                     place_.unit_a * (r[0] * t[0] + r[1] * t[1] + r[2] * t[2]) - place_.offset_b[k];
    }
  }

  IST_HD void write(const GpuContactPatches& to, std::uint32_t pair) {
    for (int p = team_.lane(); p < size_; p += Team::kWidth) {
      parts_.part[p].world = WorldSums::of(place_, parts_.part[p].term);
      int before = 0;
      for (int q = 0; q < size_; ++q) before += id(q) < id(p) ? 1 : 0;
      parts_.order[before] = static_cast<std::uint32_t>(p);
    }
    team_.sync();
    // One lane a number: volume, push, turn.
    constexpr int kNumbers = 7;
    for (int n = team_.lane(); n < kNumbers; n += Team::kWidth) complete(n);
    team_.sync();
    for (int k = team_.lane(); k < size_; k += Team::kWidth)
      write_patch(to, std::uint64_t{pair} * to.most + static_cast<std::uint64_t>(k), patch(k),
                  id(static_cast<int>(parts_.order[k])));
  }

 private:
  IST_HD std::uint64_t id(int part) const { return cuts_.node[parts_.part[part].node].id; }
  IST_HD WorldSums& patch(int k) const { return parts_.part[parts_.order[k]].world; }

  IST_HD static double& number(WorldSums& of, int n) {
    return n == 0 ? of.volume : n < 4 ? of.push[n - 1] : of.turn[n - 4];
  }

  /// Adds what is missing of a number to the largest patch.
  IST_HD void complete(int n) {
    // By the terms: volumes are another lane's.
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

  IST_HD static void put(double* to, std::uint64_t at, double x) {
    if (to != nullptr) to[at] = x;
  }
  IST_HD static void put3(double* to, std::uint64_t at, const double (&x)[3], double factor) {
    if (to == nullptr) return;
    for (int k = 0; k < 3; ++k) to[3 * at + static_cast<std::uint64_t>(k)] = factor * x[k];
  }

  IST_HD void write_patch(const GpuContactPatches& to, std::uint64_t at, const WorldSums& sums,
                          std::uint64_t id) const {
    const double(&push)[3] = sums.push;
    double area = std::sqrt((push[0] * push[0] + push[1] * push[1]) + push[2] * push[2]);
    if (!(area > kPushRounding * std::cbrt(sums.volume * sums.volume))) area = 0;
    const double depth = area > 0 ? sums.volume / area : 0;
    if (to.id != nullptr) to.id[at] = id;
    put3(to.centroid, at, sums.centre, 1);
    put3(to.normal, at, push, area > 0 ? -1 / area : 0);
    put(to.area, at, area);
    put(to.depth, at, depth < deepest_ ? depth : deepest_);
    put(to.volume, at, sums.volume);
    put3(to.force, at, push, -1);
    put3(to.torque, at, sums.turn, -1);
    write_axis(to, at, sums, area);
  }

  /// The central axis of the patch's wrench (finish_patches(), query/contact/write_patches.cpp).
  IST_HD void write_axis(const GpuContactPatches& to, std::uint64_t at, const WorldSums& sums,
                         double area) const {
    double arm[3], moment[3], point[3], twist = 0;
    for (int k = 0; k < 3; ++k) arm[k] = sums.centre[k] - origin_b_[k];
    const double(&push)[3] = sums.push;
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      moment[k] = (arm[l] * push[m] - arm[m] * push[l]) - sums.turn[k];
    }
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      point[k] = sums.centre[k];
      if (!(area > 0)) continue;
      point[k] -= (push[l] * moment[m] - push[m] * moment[l]) / (area * area);
      twist -= push[k] * moment[k] / area;
    }
    put3(to.point, at, point, 1);
    put(to.twist, at, twist);
  }

  const Team& team_;
  const PairPlace& place_;
  PatchParts& parts_;
  const CutsRef& cuts_;
  const int size_;
  double deepest_;      ///< [u] of any patch
  double origin_b_[3];  ///< [u] world
};

/// Sums pair i and divides it.
template <class Team>
IST_HD void patch_pair(const Team& team, const PatchArrays& batch, std::uint32_t i,
                       const PatchRoom& room, PatchMemory& memory) {
  const BatchArrays& pairs = batch.pairs;
  PairMemory& pair = memory.pair;
  if (team.lane() == 0) place_pair(pairs, i, pair.place);
  load_trees(team, pairs, i, pair);
  const double scale = pair.place.a_from_b.scale;
  const bool of_b = divides_b(pair.tree[0], pair.tree[1], scale);
  const CutsRef cuts = pairs.solids[(of_b ? pairs.pairs.b : pairs.pairs.a).solid[i]]
                           .cuts[static_cast<int>(pairs.measure)];
  {
    PairDescent<Team, BinSums<Team>> descent(team, pair,
                                             BinSums<Team>(team, memory, room.bin, cuts, of_b));
    descent.start();
    descent.run(0, ~0u);
  }
  PatchDivision<Team> division(team, memory, room, cuts,
                               of_b ? pair.tree[1].root[3] * scale : pair.tree[0].root[3]);
  double sum[kTerms];
  division.add_up(sum);
  if (team.lane() == 0) {
    for (int t = 0; t < kTerms; ++t) pair.totals.term[t] = sum[t];
    room.parts->whole = WorldSums::of(pair.place, pair.totals.term);
    write_answer(pairs.answers, i, world_sums(pair.place, pair.totals), pair.totals);
  }
  team.sync();
  const int size = division.run(static_cast<int>(batch.patches.most));
  if (team.lane() == 0 && batch.patches.count != nullptr)
    batch.patches.count[i] = static_cast<std::uint32_t>(size);
  if (size > 0) PatchWriter<Team>(team, memory, *room.parts, cuts, size).write(batch.patches, i);
  team.sync();
}

}  // namespace ist::gpu
