#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/answers.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/exact_insides.h"
#include "query/exact/exact_in_world.h"

// A batch of pairs by Measure::exact, step by step: what a kernel's threads and warps do, and a
// test's on the host.

namespace ist::gpu {

IST_HD_COLD bool place_exactly(const SolidPairs& batch, std::uint32_t i, PairPlace& place) {
  return place.place(solid_of(batch, batch.pairs.a, i).frame, pose_of(batch.pairs.a, i),
                     scale_of(batch.pairs.a, i), solid_of(batch, batch.pairs.b, i).frame,
                     pose_of(batch.pairs.b, i), scale_of(batch.pairs.b, i));
}

/// Whether the boxes of two meshes meet in A's frame.
IST_HD inline bool boxes_meet(const MeshTree& a, const MeshTree& b, const Similarity& a_from_b) {
  double middle[3], half[3], at[3];
  for (int k = 0; k < 3; ++k) {
    middle[k] = 0.5 * (double{b.low[k]} + b.high[k]);
    half[k] = 0.5 * (double{b.high[k]} - b.low[k]);
  }
  a_from_b.apply(middle, at);
  for (int k = 0; k < 3; ++k) {
    const double reach =
        (std::abs(a_from_b.m[3 * k]) * half[0] + std::abs(a_from_b.m[3 * k + 1]) * half[1]) +
        std::abs(a_from_b.m[3 * k + 2]) * half[2];
    const double pad = 1e-12 * (reach + std::abs(at[k]) + a.extent());
    if (at[k] - reach - pad > a.high[k] || at[k] + reach + pad < a.low[k]) return false;
  }
  return true;
}

/// Whether pair i is to be asked; else it is answered. One thread a pair.
IST_HD inline bool sift_exact(const ExactArrays& batch, std::uint32_t i) {
  const PairKind kind = kind_of(batch, i);
  PairPlace place;
  QueryStatus status = QueryStatus::ok;
  if (kind == PairKind::missing)
    status = QueryStatus::invalid_input;
  else if (kind != PairKind::trees)
    status = QueryStatus::missing_data;
  else if (!place_exactly(batch, i, place))
    status = QueryStatus::invalid_input;
  if (status == QueryStatus::ok) {
    const MeshTree& a = solid_of(batch, batch.pairs.a, i).mesh;
    const MeshTree& b = solid_of(batch, batch.pairs.b, i).mesh;
    if (a.header == nullptr || b.header == nullptr)
      status = QueryStatus::missing_data;
    else if (boxes_meet(a, b, place.a_from_b) && boxes_meet(b, a, place.b_from_a))
      return true;
  }
  write_nothing(batch.answers, i, status);
  return false;
}

/// Readies a team's memory for pair i.
template <class Team>
IST_HD void load_meshes(const Team& team, const ExactArrays& batch, std::uint32_t i,
                        ExactMemory& memory) {
  team.sync();
  copy_words(team, solid_of(batch, batch.pairs.a, i).mesh, memory.mesh[0]);
  copy_words(team, solid_of(batch, batch.pairs.b, i).mesh, memory.mesh[1]);
  if (team.lane() == 0) place_exactly(batch, i, memory.place);
  for (auto& sums : memory.sum)
    for (int k = team.lane(); k < 32; k += Team::kWidth) sums[k] = 0;
  team.sync();
  const MeshTree &a = memory.mesh[0], &b = memory.mesh[1];
  const PairPlace& place = memory.place;
  if (team.lane() == 0) {
    const auto offset = [&](const GpuPlacedSolids& side) {
      return scale_of(side, i) * norm(solid_of(batch, side, i).frame.centre);
    };
    const MoveAside aside = aside_of(a, b, place.a_from_b);
    memory.aside = aside.by;
    memory.origin = {0, 0, 0};
    memory.moved[0] = moved_in_mesh(a);
    memory.moved[1] =
        moved_by_poses(pose_of(batch.pairs.a, i).t, offset(batch.pairs.a),
                       pose_of(batch.pairs.b, i).t, offset(batch.pairs.b), b.extent(), place) +
        place.a_from_b.scale * moved_in_mesh(b) + aside.far;
    memory.reach[0] = static_cast<float>(2 * (memory.moved[0] + memory.moved[1]) * (1 + 1e-6));
    memory.reach[1] = memory.reach[0] * static_cast<float>(place.b_from_a.scale) * (1 + 1e-6f);
    memory.pad[0] = placing_pad(place.b_from_a.scale, place.b_from_a.t, a);
    memory.pad[1] = placing_pad(place.a_from_b.scale, place.a_from_b.t, b);
    const double still[3] = {0, 0, 0};
    memory.slack = 2 * memory.pad[1] + 2 * placing_pad(1, still, a) + 2 * memory.reach[0];
  }
  for (int k = team.lane(); k < 24; k += Team::kWidth) {
    const Similarity& map = k < 12 ? place.b_from_a : place.a_from_b;
    const int n = k % 12;
    memory.map[k / 12][n] = static_cast<float>(n < 9 ? map.m[n] : map.t[n - 9]);
    if (k >= 12 && n < 9) memory.turn[n] = static_cast<float>(map.m[n] / map.scale);
  }
  team.sync();
}

/// Adds what the lanes have summed, always in one order, and answers pair i.
template <class Team>
IST_HD void write_exact(const Team& team, const ExactArrays& batch, std::uint32_t i,
                        ExactMemory& memory, std::uint32_t visits, std::uint32_t crossings) {
  team.sync();
  const int lane = team.lane();
  double(&sum)[ExactSum::kCount][32] = memory.sum;
  double high = sum[ExactSum::kHigh][lane], low = sum[ExactSum::kLow][lane];
  for (int apart = Team::kWidth / 2; apart > 0; apart /= 2) {
    const double other = team.broadcast(high, lane ^ apart);
    const double other_low = team.broadcast(low, lane ^ apart);
    double rest;
    exact::two_sum(high, other, high, rest);
    low = low + (other_low + rest);
  }
  double total[ExactSum::kCount];
  for (int k = ExactSum::kRounding; k < ExactSum::kCount; ++k) total[k] = team.sum(sum[k][lane]);
  if (lane != 0) return;
  const auto vector = [&](int k) { return Vec3{total[k], total[k + 1], total[k + 2]}; };
  const double volume = (high + low) / 6;
  const ExactInWorld sums(volume, vector(ExactSum::kMoment), vector(ExactSum::kPush),
                          vector(ExactSum::kTurn), memory.origin, memory.place);
  const SolidRef &a = solid_of(batch, batch.pairs.a, i), &b = solid_of(batch, batch.pairs.b, i);
  const auto solid = [&](const SolidRef& of, const GpuPlacedSolids& side) {
    const double scale = scale_of(side, i);
    return of.volume * (scale * scale * scale);
  };
  const double most = std::fmin(solid(a, batch.pairs.a), solid(b, batch.pairs.b));
  const double error = (1.01 * (total[ExactSum::kRounding] / 6 + total[ExactSum::kLayers]) +
                        4 * exact::kHalfUnit * std::abs(volume)) *
                           memory.place.unit3() +
                       std::fmax(0.0, -sums.volume);
  PenetrationRow row = {};
  row.volume = std::fmax(0.0, sums.volume);
  row.volume_min = std::fmin(most, std::fmax(0.0, row.volume - error));
  row.volume_max = std::fmin(most, row.volume + error);
  row.volume = std::fmin(most, row.volume);
  if (row.volume > 0) row.centroid = sums.centroid;
  row.force = -sums.force;
  row.torque = -sums.torque;
  row.status = QueryStatus::ok;
  row.node_visits = visits;
  row.sphere_pairs = crossings;
  write_row(batch.answers, i, row);
}

/// Clears what a pair has left in the room.
template <class Team>
IST_HD void clear_room(const Team& team, const ExactRoom& room, std::uint32_t records) {
  team.sync();
  for (std::uint32_t r = static_cast<std::uint32_t>(team.lane()); r < records;
       r += static_cast<std::uint32_t>(Team::kWidth))
    room.record[room.records[r].of_b][room.records[r].block] = 0;
  for (int side = 0; side < 2; ++side)
    for (std::uint32_t w = static_cast<std::uint32_t>(team.lane()); w < room.words;
         w += static_cast<std::uint32_t>(Team::kWidth))
      room.near[side][w] = room.pierced[side][w] = room.inside[side][w] = 0;
  team.sync();
}

/// Answers pair i if it can: ok.
template <bool kExactly, class Team>
IST_HD ExactState ask_exactly(const Team& team, const ExactArrays& batch, std::uint32_t i,
                              const ExactRoom& room, ExactMemory& memory) {
  load_meshes(team, batch, i, memory);
  ExactSearch<Team> search(team, memory, room);
  ExactCrossings<Team, kExactly> crossings(team, memory, room);
  ExactState state = ExactState::ok;
  while (!search.ended() && state == ExactState::ok) {
    const std::uint32_t blocks = search.next();
    state = blocks == kNoRoom ? ExactState::no_room : crossings.run(blocks, search.ended());
    team.sync();
  }
  team.sync();
  if (state == ExactState::ok &&
      !ExactInsides<Team, kExactly>(team, memory, room, crossings.records(), crossings.count() > 0)
           .run())
    state = ExactState::unsure;
  if (state == ExactState::ok)
    write_exact(team, batch, i, memory, search.visits(), crossings.count());
  clear_room(team, room, crossings.records());
  return state;
}

/// A pass over the k-th of its pairs: what it cannot answer goes to the next pass. All of a team
/// together.
template <int kPass, class Team>
IST_HD void ask_pass(const Team& team, const ExactArrays& batch, std::uint32_t k,
                     const ExactRoom& room, ExactMemory& memory) {
  const std::uint32_t i = batch.list[kPass % 2][k];
  const ExactState state = ask_exactly<(kPass > 0)>(team, batch, i, room, memory);
  if (state == ExactState::ok || team.lane() != 0) return;
  if constexpr (kPass + 1 < kExactPasses)
    batch.list[(kPass + 1) % 2][atomic_add(&batch.counters->listed[kPass + 1], 1)] = i;
  else
    write_nothing(batch.answers, i, QueryStatus::budget_exhausted);
}

}  // namespace ist::gpu
