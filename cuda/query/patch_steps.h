#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/patch_arrays.h"
#include "cuda/query/patch_division.h"

// The steps of a batch of contact patches, as batch_steps.h has penetrations. One team processes a
// pair from beginning to end.

namespace ist::gpu {

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

/// Sums pair i and divides it.
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
