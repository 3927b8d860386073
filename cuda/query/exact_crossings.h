#pragma once

#include <cstdint>

#include "base/bits.h"
#include "cuda/base/atomics.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"

namespace ist::gpu {

/// True if a lane's triangles, which do not cross, might if points moved within the tolerance.
IST_HD_COLD bool nearly_cross(const CornerView& view, const exact::Point& aside, double tolerance) {
  PiercingEdge end[2];
  return cross_pair<Signs::settled>(view, aside, end, tolerance) != PairSays::apart;
}

struct KeepNone {
  IST_HD bool operator()(bool, const std::uint32_t (&)[2], const PiercingEdge (&)[2],
                         const exact::EdgeEnd (&)[2]) {
    return true;
  }
};

/// Finds the crossing pairs among candidates, a team's width at a time and in their order. Adds the
/// terms of their segments to the sums, and counts how often each edge is pierced. All lanes call
/// keep(crosses, pair, end, at), which is false if its memory is full.
template <class Team, bool kExactly, class Keep = KeepNone>
class ExactCrossings {
 public:
  IST_HD ExactCrossings(const Team& team, const ExactPair& pair, ExactSumMemory& memory,
                        const ExactWorkspace& work, const Keep& keep = {})
      : team_(team), pair_(pair), memory_(memory), work_(work), keep_(keep) {}

  IST_HD ExactState run(const ExactPool& pool, const ExactChain& crossing, const ExactChain& near) {
    const auto each = [&](const ExactChain& chain, const auto& work) {
      std::uint32_t chunk = chain.first;
      for (std::uint32_t n = 0; n < chain.count && state_ == ExactState::ok; n += kBatch) {
        if (n % ExactChunk::kPairs == 0 && n > 0) chunk = pool.next[chunk];
        const std::uint32_t at = n + static_cast<std::uint32_t>(team_.lane());
        const bool has = at < chain.count;
        const std::uint32_t(&from)[2] = pool.chunks[chunk].pair[has ? at % ExactChunk::kPairs : 0];
        const std::uint32_t pair[2] = {from[0], from[1]};
        if (has)
          for (int side = 0; side < 2; ++side) {
            const std::uint32_t block = pair[side] / kWidth;
            atomic_or(&work_.near[side][block / 32], 1u << block % 32);
          }
        work(has, pair);
      }
    };
    nearly_ = near.count > 0;
    each(near, [](bool, const std::uint32_t(&)[2]) {});
    each(crossing, [&](bool has, const std::uint32_t(&pair)[2]) { cross(has, pair); });
    return state_;
  }

  IST_HD std::uint32_t count() const { return crossings_; }
  IST_HD std::uint32_t records() const { return records_; }
  /// True if some triangles cross, or nearly do.
  IST_HD bool nearly() const { return nearly_; }

 private:
  static constexpr auto kBatch = static_cast<std::uint32_t>(Team::kWidth);
  static_assert(ExactChunk::kPairs % kBatch == 0);

  /// Makes records of the blocks of crossing triangles, in the order of the lanes.
  IST_HD void mark(int side, bool crosses, std::uint32_t block) {
    bool fresh = crosses && work_.record[side][block] == 0;
    for (;;) {
      int waiting = 0;
      const int next = team_.first(fresh, waiting);
      if (next < 0) break;
      if (records_ == work_.most_records) {
        state_ = ExactState::out_of_memory;
        return;
      }
      const std::uint32_t made = team_.broadcast(block, next);
      auto* const words = reinterpret_cast<std::uint32_t*>(work_.records + records_);
      constexpr int kWords = sizeof(CrossedRef) / 4;
      for (int w = team_.lane(); w < kWords; w += Team::kWidth)
        words[w] = w == 0 ? made : w == 1 ? static_cast<std::uint32_t>(side) << 16 : 0;
      ++records_;
      if (team_.lane() == 0) work_.record[side][made] = records_;
      fresh = fresh && block != made;
    }
    team_.sync();
  }

  IST_HD void cross(bool has, const std::uint32_t (&pair)[2]) {
    const CornerView view = {memory_.corners, team_.lane()};
    PiercingEdge end[2] = {};
    PairSays says = PairSays::apart;
    if (has)
      for (int side = 0; side < 2; ++side)
        for (int k = 0; k < 3; ++k) view.set(side, k, pair_.corner(side, pair[side], k));
    if constexpr (kExactly)
      says = cross_exactly(team_, has, view, pair_.aside, end);
    else if (has)
      says = cross_pair<Signs::doubles>(view, pair_.aside, end);
    if (team_.any(says == PairSays::unsure)) {
      state_ = ExactState::unsure;
      return;
    }
    if (team_.any(says == PairSays::wrong)) {
      state_ = ExactState::wrong;
      return;
    }
    const bool crosses = says == PairSays::crosses;
    int total = 0;
    const int first = team_.first(crosses, total);
    nearly_ = nearly_ || total > 0 ||
              team_.any(has && nearly_cross(view, pair_.aside, double{pair_.reach[0]}));
    if (total == 0) return;
    exact::EdgeEnd at[2] = {};
    if (crosses)
      for (int e = 0; e < 2; ++e) {
        const int s = static_cast<int>(end[e].of_b), k = static_cast<int>(end[e].edge),
                  next = k == 2 ? 0 : k + 1;
        at[e] = exact::edge_end(view.corner(s, k), view.corner(s, next), view.value(s, k),
                                view.value(s, next));
      }
    if (crossings_ == 0) {
      const exact::Point here = at[0].from + at[0].offset;
      const exact::Point origin = {team_.broadcast(here.x, first), team_.broadcast(here.y, first),
                                   team_.broadcast(here.z, first)};
      if (team_.lane() == 0) memory_.origin = origin;
      team_.sync();
    }
    crossings_ += static_cast<std::uint32_t>(total);
    for (int side = 0; side < 2; ++side) {
      mark(side, crosses, pair[side] / kWidth);
      if (state_ != ExactState::ok) return;
    }
    if (crosses) add(pair, view, end, at);
    if (!keep_(crosses, pair, end, at)) state_ = ExactState::out_of_memory;
  }

  IST_HD void add(const std::uint32_t (&pair)[2], const CornerView& view,
                  const PiercingEdge (&end)[2], const exact::EdgeEnd (&at)[2]) {
    const exact::Point o = memory_.origin;
    exact::Point apex[2];
    std::uint32_t opposite[2];  // the edge opposite to the apex
    for (int s = 0; s < 2; ++s) {
      const auto far = [&](int k) { return exact::length_bound(view.corner(s, k) - o); };
      const auto which = static_cast<int>(exact::apex_of(far(0), far(1), far(2)));
      apex[s] = view.corner(s, which) - o;
      opposite[s] = which == 2 ? 0 : static_cast<std::uint32_t>(which) + 1;
    }
    double counts[2];
    for (std::uint32_t e = 0; e < 2; ++e) {
      const bool enters = e != end[e].of_b;
      const bool is_opposite = (end[e].of_b != 0 ? opposite[1] : opposite[0]) == end[e].edge;
      counts[e] = is_opposite ? (enters ? 1.0 : -1.0) : 0.0;
      note(end[e].of_b, end[e].of_b != 0 ? pair[1] : pair[0], end[e].edge, enters,
           !at[e].from_second);
    }
    exact::PieceTerms terms;
    exact::segment_terms({at[0].from - o, at[1].from - o}, {at[0].offset, at[1].offset}, apex,
                         {end[0].of_b != 0, end[1].of_b != 0}, counts,
                         {error_of(view, end[0]), error_of(view, end[1])}, terms);
    const int lane = team_.lane();
    for (const double six : terms.six_volumes) memory_.add(lane, six);
    memory_.sum[ExactSum::kRounding][lane] += terms.rounding;
    memory_.add(lane, ExactSum::kMoment, terms.moment);
    memory_.add(lane, ExactSum::kPush, terms.force);
    memory_.add(lane, ExactSum::kTurn, terms.torque);
  }

  /// The error of both ends' heights together.
  IST_HD static double error_of(const CornerView& view, const PiercingEdge& edge) {
    const int s = static_cast<int>(edge.of_b), k = static_cast<int>(edge.edge);
    return view.error(s, k) + view.error(s, k == 2 ? 0 : k + 1);
  }

  /// Counts that an edge is pierced.
  IST_HD void note(std::uint32_t of_b, std::uint32_t triangle, std::uint32_t edge, bool enters,
                   bool from_first) {
    CrossedRef& record = work_.records[work_.record[of_b][triangle / kWidth] - 1];
    const std::uint32_t number = 3 * (triangle % kWidth) + edge;
    const std::uint32_t sign = enters ? 1u : ~0u;
    atomic_or(&record.pierced[number / 32], 1u << number % 32);
    atomic_add(&record.edge[number], (sign << 16) + (from_first ? sign : 0));
  }

  const Team& team_;
  const ExactPair& pair_;
  ExactSumMemory& memory_;
  const ExactWorkspace& work_;
  Keep keep_;
  ExactState state_ = ExactState::ok;
  std::uint32_t crossings_ = 0, records_ = 0;
  bool nearly_ = false;
};

}  // namespace ist::gpu
