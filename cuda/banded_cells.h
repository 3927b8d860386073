#pragma once

#include "banded_state.h"
#include "packing/prototype.h"

// The steps of a band that deal with cells (BandedPacker on the CPU). Every one is written for a
// crew; `a` are the arrays, `s` = *a.state. What depends on an order of threads is only where in an
// array a thing stands.

namespace ist::gpu {

using packing::CellState;

/// Stores what is known of a cell, in both places.
template <class Team, class Scratch>
IST_HD void put_cell(const Team& team, const BandedArrays& a, const packing::Cell& cell,
                     const Scratch& scratch, std::uint32_t slot) {
  packing::store_cell(team, cell, scratch, a.cells[slot]);
  if (team.lane() == 0) a.bounds[slot] = cell.bound;
}

/// Begins with the root cell alone; spheres and grid stay.
template <class Crew, class Surface>
IST_HD void plant_root(Crew& crew, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  share_out_to_lanes(crew, s.slots, [&](std::uint32_t i) {
    if (i > 0 && i < s.slots) a.bounds[i] = 0;
  });
  if (crew.index() == 0) {
    packing::Cell root = packing::Cell{};
    root.inside = surface.inside(crew.team(), root.centre);
    for (int i = crew.team().lane(); i < packing::kRingCapacity; i += Crew::Team::kWidth)
      crew.scratch().ring[i] = 0;
    put_cell(crew.team(), a, root, crew.scratch(), 0);
  }
}

/// Frees the cells below the floor; finds the largest bound of the others.
template <class Crew>
IST_HD void sweep_cells(Crew& crew, const BandedArrays& a) {
  BandedState& s = *a.state;
  const float floor = s.schedule.floor;
  float top = 0, dropped = 0;
  int live = 0;
  share_out_to_lanes(crew, s.slots, [&](std::uint32_t i) {
    const float bound = i < s.slots ? a.bounds[i] : 0;
    const bool dead = i < s.slots && bound < floor;
    if (dead) {
      dropped = bound > dropped ? bound : dropped;
      if (bound > 0) a.bounds[i] = 0;
    } else if (i < s.slots) {
      top = bound > top ? bound : top;
      ++live;
    }
    const std::uint32_t place = append(crew.team(), dead, &s.free);
    if (dead) a.free_list[place] = i;
  });
  top = crew.team().max(top);
  dropped = crew.team().max(dropped);
  live = crew.team().sum(live);
  if (crew.team().lane() == 0) {
    atomic_max(&s.top, packing::bits_of(top));
    atomic_max(&s.dropped, packing::bits_of(dropped));
    atomic_add(&s.live, static_cast<std::uint32_t>(live));
  }
}

/// The cells that reach the margin become the frontier.
template <class Crew>
IST_HD void activate_cells(Crew& crew, const BandedArrays& a) {
  BandedState& s = *a.state;
  const float margin = s.schedule.margin;
  std::uint32_t* const frontier = a.lists[s.frontier_array];
  share_out_to_lanes(crew, s.slots, [&](std::uint32_t i) {
    const bool active = i < s.slots && a.bounds[i] >= margin;
    const std::uint32_t place = append(crew.team(), active, &s.frontier);
    if (active) frontier[place] = i;
  });
}

/// Works on the frontier's cells of one class.
template <class Crew, class Surface>
IST_HD void work_on_cells(Crew& crew, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = crew.team();
  const ListedSpheres spheres{a.grid(), a.spheres, static_cast<std::uint32_t>(s.schedule.spheres)};
  const packing::PrototypeField<Surface, ListedSpheres> field(surface, spheres);
  const float threshold = s.schedule.threshold, margin = s.schedule.margin;
  const float largest = s.schedule.largest_half(s.frontier);
  const std::uint32_t* const frontier = a.lists[s.frontier_array];
  std::uint32_t* const active = a.lists[1 - s.frontier_array];
  if (a.mailbox != nullptr && crew.index() + 1 == crew.size() && team.lane() == 0)
    s.stop_asked = a.mailbox->stop;
  take_turns(crew, s.frontier, &s.taken, [&](std::uint32_t i) {
    const std::uint32_t slot = frontier[i];
    if (s.classes > 1 &&
        packing::BandSchedule::class_of(a.cells[slot].cell.centre, s.classes) != s.cell_class)
      return;
    packing::Cell cell = packing::load_cell(team, a.cells[slot], crew.scratch());
    const CellState outcome = field.work(team, cell, crew.scratch(), threshold, margin, largest);
    put_cell(team, a, cell, crew.scratch(), slot);
    if (team.lane() != 0) return;
    if (outcome == CellState::candidate) {
      active[atomic_add(&s.active, 1)] = slot;
      atomic_max(&s.largest_radius, packing::bits_of(cell.radius));
      atomic_max(&s.largest_bound, packing::bits_of(cell.bound));
    } else if (outcome == CellState::split) {
      a.splitting[atomic_add(&s.splitting, 1)] = slot | 0xFFu << BandedArrays::kCellBits;
    }
  });
}

/// Replaces cells by those of their children that still count. Slots come from the free list, a
/// queue; the parents' own go to its end, for later steps. A child for which there is no slot stays
/// to be made, and the step is done again when there are more.
template <class Crew, class Surface>
IST_HD void split_cells(Crew& crew, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = crew.team();
  const ListedSpheres spheres{a.grid(), a.spheres, static_cast<std::uint32_t>(s.schedule.spheres)};
  const packing::PrototypeField<Surface, ListedSpheres> field(surface, spheres);
  const float margin = s.schedule.margin, floor = s.schedule.floor;
  std::uint32_t* const frontier = a.lists[s.frontier_array];
  take_turns(crew, 8 * s.splitting, &s.taken, [&](std::uint32_t i) {
    const std::uint32_t entry = atomic_load(&a.splitting[i / 8]);
    const std::uint32_t parent_slot = entry & ((1u << BandedArrays::kCellBits) - 1);
    if (i % 8 == 0 && team.lane() == 0) {
      a.bounds[parent_slot] = 0;
      a.free_list[(s.free + i / 8) % a.cell_capacity] = parent_slot;
    }
    const std::uint32_t bit = 1u << (BandedArrays::kCellBits + i % 8);
    if ((entry & bit) == 0) return;
    const packing::Cell parent = packing::load_cell(team, a.cells[parent_slot], crew.scratch());
    const packing::Cell child =
        field.child(team, parent, static_cast<int>(i % 8), crew.scratch(), margin);
    std::uint32_t slot = 0;
    if (team.lane() == 0) {
      if (child.bound < floor) {
        atomic_max(&s.dropped, packing::bits_of(child.bound > 0 ? child.bound : 0.0f));
      } else {
        const std::uint32_t taken = atomic_add(&s.free_taken, 1);
        slot = taken < s.free ? a.free_list[taken % a.cell_capacity] : atomic_add(&s.slots, 1);
      }
    }
    if (child.bound >= floor) {
      slot = team.broadcast(slot, 0);
      if (slot >= a.cell_capacity) return;
      put_cell(team, a, child, crew.scratch(), slot);
      if (team.lane() == 0) {
        atomic_add(&s.live, 1);
        if (child.bound >= margin) frontier[atomic_add(&s.frontier, 1)] = slot;
      }
    }
    if (team.lane() == 0) atomic_and(&a.splitting[i / 8], ~bit);
  });
}

}  // namespace ist::gpu
