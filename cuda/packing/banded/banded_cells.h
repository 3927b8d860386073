#pragma once

#include <cstring>

#include "cuda/packing/banded/banded_state.h"
#include "packing/banded/prototype.h"

// The steps of a band that process cells (BandedPacker on the CPU). Each is written for a launch;
// `a` are the arrays, `s` = *a.state. The order of threads affects only positions in arrays.

namespace ist::gpu {

using packing::CellState;

/// Stores a cell and its bound, each in its array.
template <class Team, class Scratch>
IST_HD void put_cell(const Team& team, const BandedArrays& a, const packing::Cell& cell,
                     const Scratch& scratch, std::uint32_t slot) {
  packing::store_cell(team, cell, scratch, a.cells[slot]);
  if (team.lane() == 0) a.bounds[slot] = cell.bound;
}

/// Begins with the root cell alone; spheres and grid are kept.
template <class CoopLaunch, class Surface>
IST_HD void plant_root(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  distribute_to_lanes(coop, s.slots, [&](std::uint32_t i) {
    if (i > 0 && i < s.slots) a.bounds[i] = 0;
  });
  if (coop.index() == 0) {
    packing::Cell root = packing::Cell{};
    root.inside = surface.inside(coop.team(), root.centre);
    for (int i = coop.team().lane(); i < packing::kRingCapacity; i += CoopLaunch::Team::kWidth)
      coop.scratch().ring[i] = 0;
    put_cell(coop.team(), a, root, coop.scratch(), 0);
  }
}

/// Frees the cells below the floor; finds the largest bound of the others.
template <class CoopLaunch>
IST_HD void sweep_cells(CoopLaunch& coop, const BandedArrays& a) {
  BandedState& s = *a.state;
  const float floor = s.schedule.floor;
  float top = 0, dropped = 0;
  int live = 0;
  distribute_to_lanes(coop, s.slots, [&](std::uint32_t i) {
    const float bound = i < s.slots ? a.bounds[i] : 0;
    const bool dead = i < s.slots && bound < floor;
    if (dead) {
      dropped = bound > dropped ? bound : dropped;
      if (bound > 0) a.bounds[i] = 0;
    } else if (i < s.slots) {
      top = bound > top ? bound : top;
      ++live;
    }
    const std::uint32_t place = append(coop.team(), dead, &s.free);
    if (dead) a.free_list[place] = i;
  });
  top = coop.team().max(top);
  dropped = coop.team().max(dropped);
  live = coop.team().sum(live);
  if (coop.team().lane() == 0) {
    atomic_max(&s.top, bits_of(top));
    atomic_max(&s.dropped, bits_of(dropped));
    atomic_add(&s.live, static_cast<std::uint32_t>(live));
  }
}

/// Makes the cells that reach the margin the frontier.
template <class CoopLaunch>
IST_HD void activate_cells(CoopLaunch& coop, const BandedArrays& a) {
  BandedState& s = *a.state;
  const float margin = s.schedule.margin;
  std::uint32_t* const frontier = a.lists[s.frontier_array];
  distribute_to_lanes(coop, s.slots, [&](std::uint32_t i) {
    const bool active = i < s.slots && a.bounds[i] >= margin;
    const std::uint32_t place = append(coop.team(), active, &s.frontier);
    if (active) frontier[place] = i;
  });
}

/// Takes a slot for a kept child.
IST_HD inline std::uint32_t take_slot(const BandedArrays& a) {
  BandedState& s = *a.state;
  const std::uint32_t taken = atomic_add(&s.free_taken, 1);
  return taken < s.free ? a.free_list[taken % a.cell_capacity] : atomic_add(&s.slots, 1);
}

/// Loads a stored cell that another team may have written in this step, so it bypasses the
/// first-level cache. The loads depend on the cell's number, which orders them after it.
template <class Team>
IST_HD packing::Cell load_fresh_cell(const Team& team, const BandedArrays::Cell& from,
                                     packing::CellScratch<std::uint32_t>& scratch) {
  static_assert(sizeof(packing::Cell) % sizeof(Words4) == 0);
  constexpr int kWords = sizeof(packing::Cell) / sizeof(Words4);
  team.sync();
  const auto* words = reinterpret_cast<const Words4*>(&from.cell);
  Words4 copy[kWords];
  for (int i = 0; i < kWords; ++i) copy[i] = load_fresh(words + i);
  for (int i = team.lane(); i < packing::kRingCapacity; i += Team::kWidth)
    scratch.ring[i] = load_fresh(&from.ring[i]);
  packing::Cell cell;
  std::memcpy(static_cast<void*>(&cell), copy, sizeof cell);
  team.sync();
  return cell;
}

/// A child in the queue of children that a step creates and processes beside its frontier.
struct ChildCode {
  std::uint32_t parent, depth, octant;

  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;
  IST_HD static ChildCode of(std::uint32_t code) { return {code >> 5, code >> 3 & 3, code & 7}; }
  IST_HD std::uint32_t code() const { return parent << 5 | depth << 3 | octant; }
};

/// Queues a cell's children and frees its slot for later steps. `pending` then counts them instead
/// of the cell.
template <class Team>
IST_HD void queue_children(const Team& team, const BandedArrays& a, ChildCode first) {
  BandedState& s = *a.state;
  std::uint32_t place = 0;
  if (team.lane() == 0) {
    a.bounds[first.parent] = 0;
    a.free_list[(s.free + atomic_add(&s.cascaded, 1)) % a.cell_capacity] = first.parent;
    atomic_add(&s.pending, 7);
    place = atomic_add(&s.queued, 8);
  }
  place = team.broadcast(place, 0);
  team.sync();
  publish();
  for (int k = team.lane(); k < 8; k += Team::kWidth) {
    first.octant = static_cast<std::uint32_t>(k);
    atomic_exchange(&a.queue[place + first.octant], first.code());
  }
}

/// Waits for this team's entry of the queue; kNone if none will come.
template <class CoopLaunch>
IST_HD std::uint32_t wait_for_child(const CoopLaunch& coop, const BandedArrays& a,
                                    std::uint32_t place) {
  std::uint32_t code = ChildCode::kNone;
  if (coop.team().lane() == 0 && place < a.queue_capacity) {
    // `pending` is one word for all teams. It is read rarely, so as not to delay teams that update
    // it.
    constexpr std::uint32_t kSeldom = 8;
    for (std::uint32_t looks = 1; (code = atomic_load(&a.queue[place])) == ChildCode::kNone;
         ++looks) {
      if (looks % kSeldom == 0 && atomic_load(&a.state->pending) == 0) break;
      coop.pause();
    }
    if (code != ChildCode::kNone) atomic_exchange(&a.queue[place], ChildCode::kNone);
  }
  return coop.team().broadcast(code, 0);
}

/// Records the largest radius and bound, as bits, of cells that have candidates.
IST_HD inline void note_candidates(BandedState& s, std::uint32_t radius, std::uint32_t bound) {
  atomic_max(&s.largest_radius, radius);
  atomic_max(&s.largest_bound, bound);
}

/// The first part of the work on the frontier's cells of one class, one lane a cell: the bounds by
/// spheres and by remembered triangles offer little to share among lanes. The point where the bound
/// is attained is kept in place of the prototype, which an open cell does not have.
template <class CoopLaunch, class Surface>
IST_HD void refresh_cells(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const ListedSpheres spheres = listed_spheres(a);
  const packing::PrototypeField field(surface, spheres);
  const float threshold = s.schedule.threshold, margin = s.schedule.margin;
  const std::uint32_t* const frontier = a.lists[s.frontier_array];
  std::uint32_t* const active = a.lists[1 - s.frontier_array];
  std::uint32_t radius = 0, bound = 0;  // largest, bits
  distribute_to_lanes(coop, s.frontier, [&](std::uint32_t i) {
    const std::uint32_t slot = i < s.frontier ? frontier[i] : 0;
    packing::Cell cell;
    CellState state = CellState::settled;
    const bool due = i < s.frontier &&
                     (s.classes == 1 || packing::BandSchedule::class_of(a.cells[slot].cell.centre,
                                                                        s.classes) == s.cell_class);
    if (due) {
      packing::SampleMemory memory;
      typename decltype(field)::Bounded seen;
      cell = a.cells[slot].cell;
      state = field.refresh(typename CoopLaunch::Lane{}, cell, a.cells[slot].ring, &memory,
                            threshold, margin, seen);
      if (state == CellState::open) cell.prototype = seen.y;
      a.cells[slot].cell = cell;
      a.bounds[slot] = cell.bound;
    }
    team.sync();
    const bool candidate = due && state == CellState::candidate;
    if (candidate) {
      radius = bits_of(cell.radius) > radius ? bits_of(cell.radius) : radius;
      bound = bits_of(cell.bound) > bound ? bits_of(cell.bound) : bound;
    }
    const std::uint32_t place = append(team, candidate, &s.active);
    if (candidate) active[place] = slot;
    const bool open = due && state == CellState::open;
    const std::uint32_t left = append(team, open, &s.refreshed);
    if (open) a.refreshed[left] = slot;
  });
  radius = team.max(radius);
  bound = team.max(bound);
  if (team.lane() == 0 && radius > 0) note_candidates(s, radius, bound);
}

/// Records that a cell is to be split in the split step.
IST_HD inline void note_splitting(const BandedArrays& a, std::uint32_t slot) {
  a.splitting[atomic_add(&a.state->splitting, 1)] = slot | 0xFFu << BandedArrays::kCellBits;
}

/// The second part, for the cells that the first part left open.
template <class CoopLaunch, class Surface>
IST_HD void confine_cells(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const ListedSpheres spheres = listed_spheres(a);
  const packing::PrototypeField field(surface, spheres);
  const float margin = s.schedule.margin, largest = s.schedule.largest_half(s.frontier);
  distribute_dynamically(coop, s.refreshed, &s.taken, [&](std::uint32_t i) {
    const std::uint32_t slot = a.refreshed[i];
    packing::Cell cell = packing::load_cell(team, a.cells[slot], coop.scratch());
    const CellState outcome = field.confine(
        team, cell, coop.scratch(), field.look_again(team, cell, coop.scratch(), cell.prototype),
        margin, largest);
    put_cell(team, a, cell, coop.scratch(), slot);
    if (team.lane() != 0) return;
    if (outcome == CellState::open) a.confined[atomic_add(&s.confined, 1)] = slot;
    if (outcome == CellState::split) note_splitting(a, slot);
  });
}

/// Processes the frontier's cells of one class, or the last part of the work on those that are
/// still open. If no rule of the schedule can apply in between (state.depth), cells that are to be
/// split are split in the same step, and so on for that many levels: then a chain of splits waits
/// for itself alone.
template <class CoopLaunch, class Surface>
IST_HD void work_on_cells(CoopLaunch& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
  const ListedSpheres spheres = listed_spheres(a);
  const packing::PrototypeField field(surface, spheres);
  const float threshold = s.schedule.threshold, margin = s.schedule.margin;
  const float floor = s.schedule.floor, largest = s.schedule.largest_half(s.frontier);
  const bool in_parts = s.in_parts;
  const std::uint32_t frontier_size = in_parts ? s.confined : s.frontier, deepest = s.depth;
  const std::uint32_t* const frontier = in_parts ? a.confined : a.lists[s.frontier_array];
  std::uint32_t* const active = a.lists[1 - s.frontier_array];
  if (a.mailbox != nullptr && coop.index() + 1 == coop.size() && team.lane() == 0)
    s.stop_asked = a.mailbox->stop;
  for (std::uint32_t item = coop.index();;) {
    std::uint32_t slot = 0, depth = 0;
    packing::Cell cell;
    bool works = true;
    if (item < frontier_size) {
      slot = frontier[item];
      cell = packing::load_cell(team, a.cells[slot], coop.scratch());
      works = in_parts || s.classes == 1 ||
              packing::BandSchedule::class_of(cell.centre, s.classes) == s.cell_class;
    } else {
      if (deepest == 0) return;
      const std::uint32_t code = wait_for_child(coop, a, item - frontier_size);
      if (code == ChildCode::kNone) return;
      const ChildCode child = ChildCode::of(code);
      const packing::Cell parent = load_fresh_cell(team, a.cells[child.parent], coop.scratch());
      cell = field.child(team, parent, static_cast<int>(child.octant), coop.scratch().ring,
                         &coop.scratch().sample[0], margin);
      depth = child.depth;
      works = cell.bound >= margin;
      if (team.lane() == 0) {
        if (cell.bound < floor) {
          atomic_max(&s.dropped, bits_of(cell.bound > 0 ? cell.bound : 0.0f));
        } else {
          slot = take_slot(a);
          atomic_add(&s.live, 1);
        }
      }
      slot = team.broadcast(slot, 0);
      if (cell.bound >= floor && !works) put_cell(team, a, cell, coop.scratch(), slot);
    }
    bool queues = false;
    if (works) {
      const CellState outcome =
          in_parts && item < frontier_size
              ? field.climb(team, cell, coop.scratch(), threshold)
              : field.work(team, cell, coop.scratch(), threshold, margin, largest);
      put_cell(team, a, cell, coop.scratch(), slot);
      queues = outcome == CellState::split && depth < deepest;
      if (team.lane() == 0) {
        if (outcome == CellState::candidate) {
          active[atomic_add(&s.active, 1)] = slot;
          note_candidates(s, bits_of(cell.radius), bits_of(cell.bound));
        } else if (outcome == CellState::split && !queues) {
          note_splitting(a, slot);
        }
      }
    }
    if (queues) queue_children(team, a, {slot, depth + 1, 0});
    std::uint32_t next = 0;
    if (team.lane() == 0) {
      if (!queues && deepest > 0) atomic_add(&s.pending, 0xFFFFFFFFu);
      if (deepest > 0 || frontier_size > coop.size()) next = atomic_add(&s.taken, 1);
    }
    if (deepest == 0 && frontier_size <= coop.size()) return;
    item = coop.size() + team.broadcast(next, 0);
  }
}

}  // namespace ist::gpu
