#pragma once

#include "cuda/packing/banded/banded_control.h"
#include "packing/base/certificate.h"

// The steps of a round that select among the candidates of the active cells, certify the winners
// and insert them. A step's teams do not wait for each other: certification assumes the other
// winners at their candidates' radii, and a winner's position is the number of those that precede
// it.

namespace ist::gpu {

using packing::Candidate;

/// Links the active cells' candidates into the chains of their buckets.
template <class CoopLaunch>
IST_HD void collect_candidates(CoopLaunch& coop, const BandedArrays& a) {
  BandedState& s = *a.state;
  const std::uint32_t* const active = a.lists[1 - s.frontier_array];
  const std::uint64_t seed = s.schedule.limits.seed;
  distribute_to_lanes(coop, s.active, [&](std::uint32_t i) {
    if (i >= s.active) return;
    const packing::Cell& cell = a.cells[active[i]].cell;
    BucketNode node;
    node.candidate = {cell.prototype, cell.radius,
                      packing::candidate_key(cell.radius, cell.centre, seed), cell.centre};
    node.cell = active[i];
    const std::uint32_t bucket = s.buckets.bucket_of(node.candidate.centre, 0, 0, 0);
    node.next = atomic_exchange(&a.heads[bucket], i + 1);
    a.nodes[i] = node;
    a.won[i] = 0;
  });
  distribute_to_lanes(coop, RankBuckets::kCount, [&](std::uint32_t i) {
    if (i < RankBuckets::kCount) a.ranks->size[i] = a.ranks->head[i] = 0;
  });
}

/// Calls visit(place, candidate) for the candidates in the buckets around a candidate until it
/// returns false. Lanes visit different buckets.
template <class Team, class Visit>
IST_HD void for_neighbours(const Team& team, const BandedArrays& a, Float3 centre,
                           const Visit& visit) {
  for (int n = team.lane(); n < 27; n += Team::kWidth) {
    const std::uint32_t bucket =
        a.state->buckets.bucket_of(centre, n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    for (std::uint32_t at = a.heads[bucket]; at != 0; at = a.nodes[at - 1].next)
      if (!visit(at - 1, a.nodes[at - 1].candidate)) return;
  }
}

/// Finds the candidates that no overlapping one outranks.
template <class CoopLaunch>
IST_HD void find_winners(CoopLaunch& coop, const BandedArrays& a) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  distribute_statically(coop, s.active, [&](std::uint32_t i) {
    const Candidate me = a.nodes[i].candidate;
    bool lost = false;
    for_neighbours(team, a, me.centre, [&](std::uint32_t place, const Candidate& other) {
      lost = place != i && packing::goes_before(other, me) && packing::overlap(me, other);
      return !lost;
    });
    if (!team.any(lost) && team.lane() == 0) {
      a.won[i] = 1;
      a.winners[atomic_add(&s.winners, 1)] = {me.key, i, 0, 0, 0, 0};
    }
  });
}

/// The rank bucket of a candidate of this round; larger radii have higher ones.
IST_HD inline std::uint32_t rank_bucket(const BandedState& s, float radius) {
  const std::uint32_t least = bits_of(s.schedule.threshold);
  std::uint32_t shift = 0;
  while ((s.largest_radius - least) >> shift >= RankBuckets::kCount) ++shift;
  return (bits_of(radius) - least) >> shift;
}

/// Accepts or rejects a winner once all its checks are done. A cell loses its rejected winner.
IST_HD inline void judge_winner(const BandedArrays& a, std::uint32_t w, bool inside) {
  BandedState& s = *a.state;
  Winner& winner = a.winners[w];
  const float by_surface = load_fresh(&winner.by_surface);
  const float by_spheres = load_fresh(&winner.by_spheres);
  if (inside && s.schedule.accepts(by_surface < by_spheres ? by_surface : by_spheres)) {
    atomic_add(&s.accepted, 1);
    const std::uint32_t bucket = rank_bucket(s, a.nodes[winner.node].candidate.radius);
    atomic_add(&a.ranks->size[bucket], 1);
    winner.next = atomic_exchange(&a.ranks->head[bucket], w + 1);
  } else {
    winner.key = 0;
    const std::uint32_t slot = a.nodes[winner.node].cell;
    packing::Cell& cell = a.cells[slot].cell;
    cell.bound = a.bounds[slot] = s.schedule.refused_bound();
    cell.radius = 0;
  }
}

/// Computes the radius that each winner may keep. Three teams work on a winner: one finds its side
/// of the surface, one its distance from the surface, one its distance from spheres and other
/// winners. The last to finish judges.
template <class CoopLaunch, class Surface>
IST_HD void certify_winners(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const ListedSpheres spheres = listed_spheres(a);
  distribute_dynamically(coop, 3 * s.winners, &s.taken, [&](std::uint32_t item) {
    Winner& winner = a.winners[item / 3];
    const Candidate me = a.nodes[winner.node].candidate;
    std::uint32_t found = 0;
    if (item % 3 == 0) {
      const double gap = packing::gap_to_surface(
          surface.exact_distance(team, me.centre, packing::clearance_limit(me.radius)));
      const double radius = me.radius;
      if (team.lane() == 0) winner.by_surface = rounded_down(gap < radius ? gap : radius);
      found = Winner::kBySurface;
    } else if (item % 3 == 1) {
      double gap = me.radius;
      for_neighbours(team, a, me.centre, [&](std::uint32_t place, const Candidate& other) {
        if (a.won[place] != 0 && place != winner.node && packing::goes_before(other, me)) {
          const double to_sphere = packing::gap_to_sphere(
              me.centre, {other.centre.x, other.centre.y, other.centre.z, other.radius});
          gap = to_sphere < gap ? to_sphere : gap;
        }
        return true;
      });
      const float radius = packing::certified_radius(team, me.centre, me.radius, gap, spheres);
      if (team.lane() == 0) winner.by_spheres = radius;
      found = Winner::kBySpheres;
    } else {
      found = surface.inside(team, me.centre) ? Winner::kInside : Winner::kOutside;
    }
    if (team.lane() != 0) return;
    publish();
    const std::uint32_t before = atomic_or(&winner.checks, found);
    if (Winner::all_known(before | found))
      judge_winner(a, item / 3, ((before | found) & Winner::kInside) != 0);
  });
}

/// Inserts the accepted winners in order, up to the limits, and lists the blocks of the sphere grid
/// that they touch.
template <class CoopLaunch>
IST_HD void insert_winners(CoopLaunch& coop, const BandedArrays& a) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const SphereLists grid = a.grid();
  const std::uint64_t most = spheres_left(s);
  const float top =
      bits_of(s.schedule.margin) > s.largest_bound ? s.schedule.margin : float_of(s.largest_bound);
  distribute_statically(coop, s.winners, [&](std::uint32_t w) {
    const Winner winner = a.winners[w];
    if (winner.key == 0) return;
    const Candidate me = a.nodes[winner.node].candidate;
    const std::uint32_t bucket = rank_bucket(s, me.radius);
    int before = 0;
    for (std::uint32_t b = bucket + 1 + static_cast<std::uint32_t>(team.lane());
         b < RankBuckets::kCount; b += CoopLaunch::Team::kWidth)
      before += static_cast<int>(a.ranks->size[b]);
    before = team.sum(before);
    for (std::uint32_t at = a.ranks->head[bucket]; at != 0; at = a.winners[at - 1].next) {
      const Winner& other = a.winners[at - 1];
      if (other.key > winner.key || (other.key == winner.key && at - 1 != w &&
                                     packing::goes_before(a.nodes[other.node].candidate, me)))
        ++before;
    }
    const auto rank = static_cast<std::uint32_t>(before);
    if (rank >= most) return;
    const std::uint32_t index = static_cast<std::uint32_t>(s.schedule.spheres) + rank;
    const float r = winner.radius();
    if (team.lane() == 0) {
      a.spheres[index] = {me.centre.x, me.centre.y, me.centre.z, r};
      a.kept[index] = r < top ? r / top : 1.0f;
      atomic_add(&s.volume, packing::fixed_ball_volume(r, s.schedule.volume_unit));
    }
    grid.touch_blocks(team, index, {me.centre.x, me.centre.y, me.centre.z, r});
  });
  distribute_to_lanes(coop, s.active, [&](std::uint32_t i) {
    if (i >= s.active) return;
    const std::uint32_t bucket = s.buckets.bucket_of(a.nodes[i].candidate.centre, 0, 0, 0);
    atomic_exchange(&a.heads[bucket], 0);  // several may reset the same bucket
  });
}

}  // namespace ist::gpu
