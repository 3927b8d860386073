#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/query/exact_overlap_ref.h"
#include "cuda/query/exact_steps.h"
#include "query/exact/keep_largest.h"

// The steps of a batch of contact patches by Measure::exact. A team searches a pair, sums it, keeps
// its crossings and divides it. exact_steps.h has all steps before the division.

namespace ist::gpu {

/// True if pair i needs a search; else writes its answer. One thread per pair.
IST_HD inline bool sift_exact_patches(const ExactPatchArrays& batch, std::uint32_t i) {
  if (batch.patches.count != nullptr) batch.patches.count[i] = 0;
  return sift_exact(batch, i);
}

/// Writes the parts that are kept as patches of pair i, in order of their ids.
template <class Team>
IST_HD void write_parts(const Team& team, const ExactPatchArrays& batch, std::uint32_t i,
                        const PairPlace& place, const exact::Point& origin, double whole,
                        const ExactPart* parts, std::uint32_t size) {
  team.sync();
  const double deepest =
      exact_deepest(std::fmin(smaller_volume(batch, i), std::fmax(0.0, whole * place.unit3())));
  const Vec3 origin_b = vec3(pose_of(batch.pairs.b, i).t);
  std::uint32_t mine = 0;
  for (auto p = static_cast<std::uint32_t>(team.lane()); p < size;
       p += static_cast<std::uint32_t>(Team::kWidth)) {
    const ExactPart& part = parts[p];
    if (part.kept != p) continue;
    ++mine;
    std::uint32_t before = 0;
    for (std::uint32_t q = 0; q < size; ++q)
      before += parts[q].kept == q && (parts[q].id < part.id || (parts[q].id == part.id && q < p));
    const ExactInWorld sums(part.sums.volume(), part.sums.moment, part.sums.force, part.sums.torque,
                            origin, place);
    const Vec3 force = -sums.force, torque = -sums.torque;
    write_row(batch.patches, std::uint64_t{i} * batch.patches.most + before,
              PatchRow{PatchAxis::of(sums.volume, sums.centroid, force, torque, origin_b, deepest),
                       part.id, sums.volume, sums.centroid, force, torque});
  }
  const int count = team.sum(static_cast<int>(mine));
  if (team.lane() == 0 && batch.patches.count != nullptr)
    batch.patches.count[i] = static_cast<std::uint32_t>(count);
}

/// Divides the overlap of pair i into patches; false if the arena is too small. `touching`: there
/// is no volume.
template <class Team>
IST_HD bool divide_pair(const Team& team, const ExactPatchArrays& batch, std::uint32_t i,
                        const PairPlace& place, OverlapOctants<OverlapRef<Team>>& overlap,
                        bool touching, Arena& arena) {
  const std::uint32_t most = batch.patches.most;
  if (most == 0) return true;
  if (!overlap.place_parts(arena)) return false;
  if (touching) overlap.whole().six_volumes = {};
  const double whole = team.broadcast(overlap.whole().volume(), 0);
  ExactPart* parts = overlap.parts();
  std::uint32_t size = team.broadcast(overlap.divide(), 0), kept = 0;
  if (team.lane() == 0) {
    kept = keep_largest(parts, size, most, false);
    if (most > 1)
      join_parts(parts, size);
    else
      for (std::uint32_t p = 0; p < size; ++p) parts[p].id *= 8;
  }
  kept = team.broadcast(kept, 0);
  if (most > 1) {
    if (!overlap.place_octants(arena, kept)) return false;
    const SolidRef &a = solid_of(batch, batch.pairs.a, i), &b = solid_of(batch, batch.pairs.b, i);
    const double scale_a = scale_of(batch.pairs.a, i), scale_b = scale_of(batch.pairs.b, i);
    const bool by_b =
        b.volume * (scale_b * scale_b * scale_b) <= a.volume * (scale_a * scale_a * scale_a);
    const double radius = (by_b ? scale_b * b.radius : scale_a * a.radius) / place.unit_a;
    size = team.broadcast(overlap.split(size, by_b, kNearOctants * radius, most), 0);
    parts = overlap.octants();
    if (team.lane() == 0) keep_largest(parts, size, most, true);
  }
  if (team.lane() == 0) join_parts(parts, size);
  write_parts(team, batch, i, place, overlap.origin(), whole, parts, size);
  return true;
}

/// The work of a pass on the k-th of its pairs. Called by the whole team.
template <class Team>
IST_HD void patch_pass(const Team& team, const ExactPatchArrays& batch, int pass, std::uint32_t k,
                       const ExactWorkspace& work, Arena parts, ExactWholeMemory& memory) {
  const std::uint32_t i = batch.list[pass][k];
  std::uint32_t visits = 0;
  ExactState state = ExactState::out_of_memory;
  if (search_pair(team, batch, i, work, memory, visits)) {
    const ExactChain crossing = memory.search.crossing, near = memory.search.near;
    const std::size_t half = static_cast<std::size_t>(parts.end - parts.at) / 2;
    auto* const kept = reinterpret_cast<CrossingRef*>(parts.at);
    ExactCrossings<Team, true, KeepCrossings<Team>> crossings(
        team, memory.pair, memory.sum, work,
        {team, kept, static_cast<std::uint32_t>(half / sizeof(CrossingRef))});
    state = sum_marked(team, batch, i, work, memory.pair, memory.sum, work.pool, crossing, near,
                       visits, crossings);
    if (state == ExactState::ok || state == ExactState::nothing) {
      team.sync();  // one lane has written ExactLeft
      const ExactLeft left = memory.sum.left;
      const exact::Point origin = memory.sum.origin;
      const bool touching =
          state == ExactState::nothing && find_contact(team, batch, i, memory.pair, memory.search,
                                                       left, work.waiting, work.most_waiting);
      team.sync();
      parts.take<CrossingRef>(crossings.count());
      OverlapOctants<OverlapRef<Team>> overlap(team, memory.pair, work, crossings.records(), kept,
                                               crossings.count(), origin, memory.pieces);
      state = divide_pair(team, batch, i, memory.pair.place, overlap, touching, parts)
                  ? ExactState::ok
                  : ExactState::out_of_memory;
    }
    clear_workspace(team, work, crossings.records());
  }
  if (state != ExactState::ok && team.lane() == 0) leave_to_next(batch, pass, i);
}

}  // namespace ist::gpu
