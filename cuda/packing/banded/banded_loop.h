#pragma once

#include "cuda/packing/banded/banded_cells.h"
#include "cuda/packing/banded/banded_control.h"
#include "packing/base/certificate.h"

// The step of a band that splits cells.

namespace ist::gpu {

// The steps of a round that choose among the candidates of the active cells, certify the winners
// and insert them. A step's teams do not wait for each other: certification takes the other winners
// at their candidates' radii, and a winner's place is the count of those that go before it.

using packing::Candidate;

/// Hangs the active cells' candidates into the chains of their buckets.
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

/// Calls visit(place, candidate) for those in the buckets around a candidate, the lanes going
/// through different buckets, until it returns false.
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

/// Finds the candidates that no overlapping one goes before.
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

/// The rank bucket of a candidate of this round; larger radii in higher ones.
IST_HD inline std::uint32_t rank_bucket(const BandedState& s, float radius) {
  const std::uint32_t least = bits_of(s.schedule.threshold);
  std::uint32_t shift = 0;
  while ((s.largest_radius - least) >> shift >= RankBuckets::kCount) ++shift;
  return (bits_of(radius) - least) >> shift;
}

/// Takes in a winner of which all is known. A cell whose winner is not accepted loses it.
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

/// Works out what radius the winners may keep. Three teams a winner: one finds on which side of the
/// surface it lies, one how far it is from it, one how far from spheres and other winners; who
/// comes last judges.
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
          const double room = packing::gap_to_sphere(
              me.centre, {other.centre.x, other.centre.y, other.centre.z, other.radius});
          gap = room < gap ? room : gap;
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

/// Inserts the accepted winners in their order, as many as may still come, and notes the blocks of
/// the sphere grid that they touch.
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
    atomic_exchange(&a.heads[bucket], 0);  // that of several, maybe
  });
}

/// Gives a slot to each lane that `keeps` its child, as take_slot() does.
template <class Team>
IST_HD std::uint32_t take_slots(const Team& team, const BandedArrays& a, bool keeps) {
  BandedState& s = *a.state;
  const std::uint32_t taken = append(team, keeps, &s.free_taken);
  const bool fresh = keeps && taken >= s.free;
  const std::uint32_t beyond = append(team, fresh, &s.slots);
  if (!keeps) return 0;
  return fresh ? beyond : a.free_list[taken % a.cell_capacity];
}

/// split_cells() with a team a child, for so few that no team has a second one.
template <class CoopLaunch, class Shape>
IST_HD void split_few(CoopLaunch& coop, const BandedArrays& a, const Shape& field) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const std::uint32_t i = coop.index();
  if (i >= 8 * s.splitting) return;
  const std::uint32_t entry = atomic_load(&a.splitting[i / 8]);
  const std::uint32_t parent_slot = entry & ((1u << BandedArrays::kCellBits) - 1);
  const std::uint32_t bit = 1u << (BandedArrays::kCellBits + i % 8);
  if (i % 8 == 0 && team.lane() == 0) {
    a.bounds[parent_slot] = 0;
    a.free_list[(s.free + i / 8) % a.cell_capacity] = parent_slot;
  }
  if ((entry & bit) == 0) return;
  const packing::Cell parent = packing::load_cell(team, a.cells[parent_slot], coop.scratch());
  const packing::Cell child =
      field.child(team, parent, static_cast<int>(i % 8), coop.scratch().ring,
                  &coop.scratch().sample[0], s.schedule.margin);
  const bool keeps = child.bound >= s.schedule.floor;
  std::uint32_t slot = 0;
  if (team.lane() == 0) {
    if (keeps)
      slot = take_slot(a);
    else if (child.bound > 0)
      atomic_max(&s.dropped, bits_of(child.bound));
  }
  slot = team.broadcast(slot, 0);
  const bool stored = keeps && slot < a.cell_capacity;
  if (stored) put_cell(team, a, child, coop.scratch(), slot);
  if (team.lane() != 0) return;
  if (stored) {
    atomic_add(&s.live, 1);
    if (child.bound >= s.schedule.margin)
      a.lists[s.frontier_array][atomic_add(&s.frontier, 1)] = slot;
  }
  if (stored || !keeps) atomic_and(&a.splitting[i / 8], ~bit);
}

/// Replaces cells by those of their children that still count, a lane a child: bounding one has
/// little to share among lanes. Slots come from the free list, a queue; the parents' own go to its
/// end, for later steps. A child for which there is no slot stays to be made, and the step is done
/// again when there are more.
template <class CoopLaunch, class Surface>
IST_HD void split_cells(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const ListedSpheres spheres = listed_spheres(a);
  const packing::PrototypeField field(surface, spheres);
  if (8 * s.splitting <= coop.size()) return split_few(coop, a, field);
  const float margin = s.schedule.margin, floor = s.schedule.floor;
  std::uint32_t* const frontier = a.lists[s.frontier_array];
  float dropped = 0;
  int live = 0;
  distribute_to_lanes(coop, 8 * s.splitting, [&](std::uint32_t i) {
    const bool valid = i < 8 * s.splitting;
    const std::uint32_t entry = valid ? atomic_load(&a.splitting[i / 8]) : 0;
    const std::uint32_t parent_slot = entry & ((1u << BandedArrays::kCellBits) - 1);
    const std::uint32_t bit = 1u << (BandedArrays::kCellBits + i % 8);
    const bool due = (entry & bit) != 0;
    if (valid && i % 8 == 0) {
      a.bounds[parent_slot] = 0;
      a.free_list[(s.free + i / 8) % a.cell_capacity] = parent_slot;
    }
    BandedArrays::Cell child;
    child.cell.bound = 0;
    if (due) {
      const BandedArrays::Cell& parent = a.cells[parent_slot];
      packing::SampleMemory memory;
      for (int k = 0; k < packing::kRingCapacity; ++k) child.ring[k] = parent.ring[k];
      child.cell = field.child(typename CoopLaunch::Lane{}, parent.cell, static_cast<int>(i % 8),
                               child.ring, &memory, margin);
      if (child.cell.bound < floor && child.cell.bound > dropped) dropped = child.cell.bound;
    }
    team.sync();
    const bool keeps = due && child.cell.bound >= floor;
    const std::uint32_t slot = take_slots(team, a, keeps);
    const bool stored = keeps && slot < a.cell_capacity;
    if (stored) {
      a.cells[slot] = child;
      a.bounds[slot] = child.cell.bound;
      ++live;
    }
    const bool active = stored && child.cell.bound >= margin;
    const std::uint32_t place = append(team, active, &s.frontier);
    if (active) frontier[place] = slot;
    if (due && (stored || !keeps)) atomic_and(&a.splitting[i / 8], ~bit);
  });
  dropped = team.max(dropped);
  live = team.sum(live);
  if (team.lane() == 0) {
    atomic_max(&s.dropped, bits_of(dropped));
    atomic_add(&s.live, static_cast<std::uint32_t>(live));
  }
}

/// Zeroes the sphere grid for its new layout.
template <class CoopLaunch>
IST_HD void clear_grid(CoopLaunch& coop, const BandedArrays& a) {
  const SphereLists grid = a.grid();
  const std::uint32_t blocks = grid.layout.block_count();
  distribute_to_lanes(coop, blocks, [&](std::uint32_t i) {
    if (i < blocks) grid.blocks[i] = 0;
  });
  const std::uint32_t used =
      grid.use->cell_blocks < grid.block_capacity ? grid.use->cell_blocks : grid.block_capacity;
  const std::uint32_t cells = used * SphereLists::kCellsPerBlock;
  distribute_to_lanes(coop, cells, [&](std::uint32_t i) {
    if (i < cells) grid.cells[i] = {0, 0};
  });
}

/// Does the sphere grid's pass `step` over all shares of all pairs that were noted. Few pairs are
/// shared by teams that would have none: what a pass takes is the time of its longest chain of
/// atomics.
template <class CoopLaunch>
IST_HD void pass_over_pairs(CoopLaunch& coop, const BandedArrays& a, Step step) {
  const SphereLists grid = a.grid();
  const std::uint32_t shares = grid.use->pairs < coop.size() ? 8 : 1;
  distribute_statically(coop, shares * grid.use->pairs, [&](std::uint32_t i) {
    const SphereLists::Pair pair = grid.pairs[i / shares];
    const Sphere sphere = a.spheres[pair.sphere].sphere();
    const SphereLists::Share share{i % shares, shares};
    if (step == Step::count) grid.count_in_cells(coop.team(), pair, sphere, share);
    if (step == Step::make_room) grid.make_room(coop.team(), pair, sphere, share);
    if (step == Step::fill) grid.fill_cells(coop.team(), pair, sphere, share);
  });
}

/// The whole packing (BandedPacker on the CPU, the same spheres bit for bit), from the step that
/// the state says until it is finished or needs something of the host.
template <class CoopLaunch, class Surface>
IST_HD void pack_banded(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  for (;;) {
    const Step step = s.step;
    if (step == Step::finished || s.need != Need::nothing) return;
    switch (step) {
      case Step::start:
        plant_root(coop, a, surface);
        break;
      case Step::sweep:
        sweep_cells(coop, a);
        break;
      case Step::clear_grid:
        clear_grid(coop, a);
        break;
      case Step::touch_all: {
        const SphereLists grid = a.grid();
        distribute_dynamically(
            coop, static_cast<std::uint32_t>(s.schedule.spheres), &s.taken,
            [&](std::uint32_t i) { grid.touch_blocks(coop.team(), i, a.spheres[i].sphere()); });
        break;
      }
      case Step::count:
      case Step::make_room:
      case Step::fill:
        pass_over_pairs(coop, a, step);
        break;
      case Step::activate:
        activate_cells(coop, a);
        break;
      case Step::refresh:
        refresh_cells(coop, a, surface);
        break;
      case Step::confine:
        confine_cells(coop, a, surface);
        break;
      case Step::work:
        work_on_cells(coop, a, surface);
        break;
      case Step::split:
        split_cells(coop, a, surface);
        break;
      case Step::collect:
        collect_candidates(coop, a);
        break;
      case Step::dominate:
        find_winners(coop, a);
        break;
      case Step::certify:
        certify_winners(coop, a, surface);
        break;
      case Step::insert:
        insert_winners(coop, a);
        break;
      case Step::finished:
        break;
    }
    coop.sync([&] {
      s.taken = 0;
      after_step(a, step);
    });
  }
}

}  // namespace ist::gpu
