#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/answers.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/exact_contact.h"
#include "cuda/query/exact_crossings.h"
#include "cuda/query/exact_insides.h"
#include "cuda/query/exact_search.h"
#include "query/exact/exact_sums.h"

// The steps of a batch by Measure::exact, for the threads and warps of kernels and for tests on the
// host.

namespace ist::gpu {

/// How far the surfaces of pair i are from their true places relative to each other, A's unit
/// frame.
IST_HD inline void moved_exactly(const ExactArrays& batch, std::uint32_t i, const PairPlace& place,
                                 double (&moved)[2]) {
  const MeshTree& b = solid_of(batch, batch.pairs.b, i).mesh;
  const auto offset = [&](const GpuPlacedSolids& side) {
    return scale_of(side, i) * norm(solid_of(batch, side, i).frame.centre);
  };
  moved[0] = moved_in_mesh(solid_of(batch, batch.pairs.a, i).mesh);
  moved[1] = moved_by_poses(pose_of(batch.pairs.a, i).t, offset(batch.pairs.a),
                            pose_of(batch.pairs.b, i).t, offset(batch.pairs.b), b.extent(), place) +
             place.a_from_b.scale * moved_in_mesh(b);
}

/// True if boxes around pair i show that there is nothing to search for.
IST_HD inline bool boxes_apart(const ExactArrays& batch, std::uint32_t i, const PairPlace& place) {
  const SolidRef& a = solid_of(batch, batch.pairs.a, i);
  const SolidRef& b = solid_of(batch, batch.pairs.b, i);
  double moved[2];
  moved_exactly(batch, i, place, moved);
  const double touch = touching_distance(moved[0] + moved[1], a.mesh, b.mesh, place.a_from_b);
  return ist::boxes_apart(a.box, b.box, place, touch);
}

/// True if pair i needs a search, and its place; else writes its answer. One thread per pair.
IST_HD inline bool sift_exact(const ExactArrays& batch, std::uint32_t i, PairPlace& place) {
  const PairKind kind = kind_of(batch, i);
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
    else if (!boxes_apart(batch, i, place))
      return true;
  }
  write_nothing(batch.answers, i, status);
  return false;
}

IST_HD inline bool sift_exact(const ExactArrays& batch, std::uint32_t i) {
  PairPlace place;
  return sift_exact(batch, i, place);
}

/// Computes the input of pair i's steps from its place. One thread per pair.
IST_HD inline void frame_exactly(const ExactArrays& batch, std::uint32_t i, ExactFrame& frame) {
  const PairPlace& place = frame.place;
  const MeshTree& a = solid_of(batch, batch.pairs.a, i).mesh;
  const MeshTree& b = solid_of(batch, batch.pairs.b, i).mesh;
  const MoveAside aside = aside_of(a, b, place.a_from_b);
  frame.aside = aside.by;
  moved_exactly(batch, i, place, frame.moved);
  frame.touch = touching_distance(frame.moved[0] + frame.moved[1], a, b, place.a_from_b);
  frame.moved[1] += aside.far;
  frame.reach[0] = static_cast<float>(2 * (frame.moved[0] + frame.moved[1]) * (1 + 1e-6));
  frame.reach[1] = frame.reach[0] * static_cast<float>(place.b_from_a.scale) * (1 + 1e-6f);
  frame.pad[0] = placing_pad(place.b_from_a.scale, place.b_from_a.t, a);
  frame.pad[1] = placing_pad(place.a_from_b.scale, place.a_from_b.t, b);
  const double still[3] = {0, 0, 0};
  frame.slack = 2 * frame.pad[1] + 2 * placing_pad(1, still, a) + 2 * frame.reach[0];
}

/// Places the k-th pair of a round, which is pair `listed` of the whole list. One thread per pair.
IST_HD inline void place_query(const ExactArrays& batch, std::uint32_t k, std::uint32_t listed) {
  ExactQuery& query = batch.queries[k];
  query.pair = batch.list[0][listed % batch.pairs.count];
  place_exactly(batch, query.pair, query.frame.place);
  frame_exactly(batch, query.pair, query.frame);
}

/// Loads pair i, whose frame is set, into a team's memory.
template <class Team>
IST_HD void load_pair(const Team& team, const ExactArrays& batch, std::uint32_t i,
                      ExactPair& pair) {
  copy_words(team, solid_of(batch, batch.pairs.a, i).mesh, pair.mesh[0]);
  copy_words(team, solid_of(batch, batch.pairs.b, i).mesh, pair.mesh[1]);
  if (team.lane() == 0) {
    pair.in_floats[0] = solid_of(batch, batch.pairs.a, i).in_floats;
    pair.in_floats[1] = solid_of(batch, batch.pairs.b, i).in_floats;
  }
  team.sync();
  for (int k = team.lane(); k < 24; k += Team::kWidth) {
    const int side = k / 12, row = k % 12 / 4, n = k % 4;
    const Similarity& map = side == 0 ? pair.place.b_from_a : pair.place.a_from_b;
    pair.row[side][row].x[n] = static_cast<float>(n < 3 ? map.m[3 * row + n] : map.t[row]);
    if (n < 3) pair.turn[side][row].x[n] = static_cast<float>(map.m[3 * row + n] / map.scale);
  }
  team.sync();
}

/// Loads a query of a round into a team's memory.
template <class Team>
IST_HD void load_query(const Team& team, const ExactArrays& batch, const ExactQuery& query,
                       ExactPair& pair) {
  team.sync();
  copy_words(team, query.frame, static_cast<ExactFrame&>(pair));
  load_pair(team, batch, query.pair, pair);
}

/// Adds the lanes' sums, always in one order, and writes the answer of pair i. True if its volume
/// is within the rounding of the sums.
template <class Team>
IST_HD bool write_exact(const Team& team, const ExactArrays& batch, std::uint32_t i,
                        const ExactPair& pair, ExactSumMemory& memory, std::uint32_t visits,
                        std::uint32_t crossings) {
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
  const double volume = (high + low) / 6, rounding = 1.01 * (total[ExactSum::kRounding] / 6);
  const bool nothing = team.broadcast(std::abs(volume) <= rounding ? 1 : 0, 0) != 0;
  if (lane != 0) return nothing;
  const auto vector = [&](int k) { return Vec3{total[k], total[k + 1], total[k + 2]}; };
  const ExactInWorld sums(volume, vector(ExactSum::kMoment), vector(ExactSum::kPush),
                          vector(ExactSum::kTurn), memory.origin, pair.place);
  const double most = smaller_volume(batch, i);
  memory.left.volume = volume;
  memory.left.error = 1.01 * (total[ExactSum::kRounding] / 6 + total[ExactSum::kLayers]) +
                      4 * exact::kHalfUnit * std::abs(volume);
  memory.left.push = exact::length_bound(vector(ExactSum::kPush));
  const double error = memory.left.error * pair.place.unit3() + std::fmax(0.0, -sums.volume);
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
  return nothing;
}

/// Clears the marks of a workspace that no pair has used yet.
template <class Team>
IST_HD void clear_marks(const Team& team, const ExactWorkspace& work) {
  const std::ptrdiff_t words = work.flood - work.record[0];
  for (std::ptrdiff_t w = team.lane(); w < words; w += Team::kWidth) work.record[0][w] = 0;
  team.sync();
}

/// Clears the marks that a pair has left.
template <class Team>
IST_HD void clear_workspace(const Team& team, const ExactWorkspace& work, std::uint32_t records) {
  team.sync();
  for (std::uint32_t r = static_cast<std::uint32_t>(team.lane()); r < records;
       r += static_cast<std::uint32_t>(Team::kWidth))
    work.record[work.records[r].of_b][work.records[r].block] = 0;
  for (int side = 0; side < 2; ++side)
    for (std::uint32_t w = static_cast<std::uint32_t>(team.lane()); w < work.words;
         w += static_cast<std::uint32_t>(Team::kWidth))
      work.near[side][w] = work.pierced[side][w] = work.inside[side][w] = 0;
  team.sync();
}

/// Sums pair i from its candidates and writes its answer if the state is `ok` or `nothing`. Marks
/// remain.
template <class Team, bool kExactly, class Keep>
IST_HD ExactState sum_marked(const Team& team, const ExactArrays& batch, std::uint32_t i,
                             const ExactWorkspace& work, const ExactPair& pair,
                             ExactSumMemory& memory, const ExactPool& pool,
                             const ExactChain& crossing, const ExactChain& near,
                             std::uint32_t visits,
                             ExactCrossings<Team, kExactly, Keep>& crossings) {
  team.sync();
  for (auto& sums : memory.sum)
    for (int k = team.lane(); k < 32; k += Team::kWidth) sums[k] = 0;
  if (team.lane() == 0) memory.origin = {0, 0, 0};
  team.sync();
  ExactState state = crossings.run(pool, crossing, near);
  team.sync();
  if (state == ExactState::ok &&
      !ExactInsides<Team, kExactly>(team, pair, memory, work, crossings.records(),
                                    crossings.count() > 0)
           .run())
    state = ExactState::unsure;
  if (state == ExactState::ok &&
      write_exact(team, batch, i, pair, memory, visits, crossings.count()) && crossings.nearly())
    state = ExactState::nothing;
  return state;
}
template <bool kExactly, class Team>
IST_HD ExactState sum_exactly(const Team& team, const ExactArrays& batch, std::uint32_t i,
                              const ExactWorkspace& work, const ExactPair& pair,
                              ExactSumMemory& memory, const ExactPool& pool,
                              const ExactChain& crossing, const ExactChain& near,
                              std::uint32_t visits) {
  ExactCrossings<Team, kExactly> crossings(team, pair, memory, work);
  const ExactState state =
      sum_marked(team, batch, i, work, pair, memory, pool, crossing, near, visits, crossings);
  clear_workspace(team, work, crossings.records());
  return state;
}

/// Leaves a pair that needs more memory to the next pass.
IST_HD inline void leave_to_next(const ExactArrays& batch, int pass, std::uint32_t i) {
  if (pass + 1 < kExactPasses)
    batch.list[pass + 1][atomic_add(&batch.counters->listed[pass + 1], 1)] = i;
  else
    write_nothing(batch.answers, i, QueryStatus::budget_exhausted);
}

IST_HD inline ExactRound& round_of(const ExactArrays& batch, std::uint32_t n) {
  return batch.counters->round[n % 2];
}
/// The number of pairs of a round that begins at `first` of the list.
IST_HD inline std::uint32_t pairs_from(const ExactArrays& batch, std::uint32_t first) {
  const std::uint32_t left = batch.counters->listed[0] - first;
  return left < batch.query_capacity ? left : batch.query_capacity;
}
IST_HD inline std::uint32_t searched_of(const ExactRound& round) {
  return round.searched < round.count ? round.searched : round.count;
}
/// The position in the list at which the next round begins.
IST_HD inline std::uint32_t end_of(const ExactRound& round) {
  return round.first + searched_of(round);
}

/// Estimates whether round n has memory for one more pair. Each pair in progress may take as many
/// chunks as one of the last round did or, in the first round, as one that is finished. Teams that
/// begin at the same time do not see each other's chunks, so each counts the teams `before` it.
IST_HD inline bool goes_on(const ExactArrays& batch, std::uint32_t n, std::uint32_t before) {
  constexpr std::uint32_t kLeastChunks = 4;
  const ExactRound &last = round_of(batch, n + 1), &round = round_of(batch, n);
  const ExactRound& by = n > 0 && last.found > 0 ? last : round;
  const std::uint32_t taken = atomic_load(&by.chunks) / (atomic_load(&by.found) + 1) + 1;
  const std::uint32_t each = taken > kLeastChunks ? taken : kLeastChunks;
  const std::uint32_t found = atomic_load(&round.found), searched = atomic_load(&round.searched);
  const std::uint32_t busy = searched - found > before ? searched - found : before;
  const std::uint32_t chunks = atomic_load(&round.chunks);
  return (busy == 0 && chunks == 0) ||
         chunks + std::uint64_t{busy + 1} * each <= batch.pool.capacity;
}

/// Stores the result of the search of a round's k-th pair. `all`: its pending nodes fitted.
template <class Team>
IST_HD void end_search(const Team& team, const ExactArrays& batch, ExactRound& round,
                       std::uint32_t k, const ExactSearchMemory& memory, bool all,
                       std::uint32_t visits) {
  if (team.lane() != 0) return;
  ExactQuery& query = batch.queries[k];
  const ExactPool& pool = memory.pool;
  const bool fits = all && held(pool, memory.crossing) && held(pool, memory.near);
  query.state = fits ? ExactState::ok : ExactState::out_of_memory;
  // A pair for which no chunks were left is listed again.
  if (!fits && round.chunks > batch.pool.capacity) {
    query.state = ExactState::later;
    batch.list[0][atomic_add(&batch.counters->listed[0], 1) % batch.pairs.count] = query.pair;
  }
  query.visits = visits;
  query.crossing = memory.crossing;
  query.near = memory.near;
  atomic_add(&round.found, 1);
}

template <class Team>
IST_HD void search_query(const Team& team, const ExactArrays& batch, ExactRound& round,
                         std::uint32_t k, ExactPair& pair, ExactSearchMemory& memory) {
  load_query(team, batch, batch.queries[k], pair);
  ExactPool pool = batch.pool;
  pool.taken = &round.chunks;
  ExactSearch<Team> search(team, pair, memory, memory.waiting, ExactSearchMemory::kWaiting, pool);
  const bool all = search.run([&](std::uint32_t first, std::uint32_t count) {
    sift_triangles(team, pair, memory, first, count);
    return true;
  });
  end_search(team, batch, round, k, memory, all, search.visits);
}

/// Sums the k-th pair of a round, or the k-th of those that doubles do not decide.
template <bool kExactly, class Team>
IST_HD void sum_query(const Team& team, const ExactArrays& batch, ExactRound& round,
                      std::uint32_t k, const ExactWorkspace& work, ExactPair& pair,
                      ExactSumMemory& memory) {
  if constexpr (kExactly) k = batch.queries[k].unsure;
  ExactQuery& query = batch.queries[k];
  ExactState state = query.state;
  if (state == ExactState::ok) {
    load_query(team, batch, query, pair);
    state = sum_exactly<kExactly>(team, batch, query.pair, work, pair, memory, batch.pool,
                                  query.crossing, query.near, query.visits);
  }
  if (state == ExactState::ok || state == ExactState::later || team.lane() != 0) return;
  if (!kExactly && state == ExactState::unsure)
    batch.queries[atomic_add(&round.unsure, 1)].unsure = k;
  else if (state == ExactState::nothing) {
    query.left = memory.left;
    batch.queries[atomic_add(&round.nothing, 1)].nothing = k;
  } else
    leave_to_next(batch, 0, query.pair);
}

/// Decides if the k-th of a round's pairs without volume touches.
template <class Team>
IST_HD void touch_query(const Team& team, const ExactArrays& batch, std::uint32_t k,
                        ExactPair& pair, ExactContactMemory& memory) {
  const ExactQuery& query = batch.queries[batch.queries[k].nothing];
  load_query(team, batch, query, pair);
  find_contact(team, batch, query.pair, pair, memory, query.left, memory.waiting,
               ExactSearchMemory::kWaiting);
}

/// The number of pairs of a later pass. The first of these also takes the pairs after the last of
/// `rounds`.
IST_HD inline std::uint32_t pairs_of_pass(const ExactArrays& batch, int pass,
                                          std::uint32_t rounds) {
  const ExactCounters& counters = *batch.counters;
  return counters.listed[pass] +
         (pass == 1 ? counters.listed[0] - end_of(round_of(batch, rounds + 1)) : 0);
}

/// Searches pair i for triangles that may cross, into the workspace's pool. False if they do not
/// fit.
template <class Team>
IST_HD bool search_pair(const Team& team, const ExactArrays& batch, std::uint32_t i,
                        const ExactWorkspace& work, ExactWholeMemory& memory,
                        std::uint32_t& visits) {
  team.sync();
  if (team.lane() == 0) {
    place_exactly(batch, i, memory.pair.place);
    frame_exactly(batch, i, memory.pair);
    *work.pool.taken = 0;
  }
  load_pair(team, batch, i, memory.pair);
  ExactSearch<Team> search(team, memory.pair, memory.search, work.waiting, work.most_waiting,
                           work.pool);
  const bool all = search.run([&](std::uint32_t first, std::uint32_t count) {
    sift_triangles(team, memory.pair, memory.search, first, count);
    return true;
  });
  visits = search.visits;
  return all && held(work.pool, memory.search.crossing) && held(work.pool, memory.search.near);
}

/// The work of a later pass on the k-th of its pairs. `listed`: their number. Called by the whole
/// team.
template <class Team>
IST_HD void ask_pass(const Team& team, const ExactArrays& batch, int pass, std::uint32_t rounds,
                     std::uint32_t listed, std::uint32_t k, const ExactWorkspace& work,
                     ExactWholeMemory& memory) {
  const std::uint32_t i =
      k < listed
          ? batch.list[pass][k]
          : batch.list[0][(end_of(round_of(batch, rounds + 1)) + (k - listed)) % batch.pairs.count];
  std::uint32_t visits = 0;
  const bool all = search_pair(team, batch, i, work, memory, visits);
  const ExactChain crossing = memory.search.crossing, near = memory.search.near;
  ExactState state = ExactState::out_of_memory;
  if (all)
    state = sum_exactly<true>(team, batch, i, work, memory.pair, memory.sum, work.pool, crossing,
                              near, visits);
  if (state == ExactState::nothing) {
    const ExactLeft left = memory.sum.left;
    find_contact(team, batch, i, memory.pair, memory.search, left, work.waiting, work.most_waiting);
  } else if (state != ExactState::ok && team.lane() == 0)
    leave_to_next(batch, pass, i);
}

}  // namespace ist::gpu
