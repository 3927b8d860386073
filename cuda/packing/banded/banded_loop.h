#pragma once

#include "cuda/packing/banded/banded_cells.h"
#include "cuda/packing/banded/banded_selection.h"

// The step that splits cells, and the loop of all steps.

namespace ist::gpu {

/// Gives a slot to each lane that `keeps` its child, like take_slot().
template <class Team>
IST_HD std::uint32_t take_slots(const Team& team, const BandedArrays& a, bool keeps) {
  BandedState& s = *a.state;
  const std::uint32_t taken = append(team, keeps, &s.free_taken);
  const bool fresh = keeps && taken >= s.free;
  const std::uint32_t beyond = append(team, fresh, &s.slots);
  if (!keeps) return 0;
  return fresh ? beyond : a.free_list[taken % a.cell_capacity];
}

/// split_cells() with one team a child, for so few that no team has a second one.
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

/// Replaces cells by those of their children that still count, one lane a child: bounding a child
/// offers little to share among lanes. Slots come from the free list, a queue; the parents' slots
/// go to its end, for later steps. A child without a slot is created when the step is repeated with
/// more slots.
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

/// Clears the sphere grid for its new layout.
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

/// Does the sphere grid's pass `step` over all shares of all listed pairs. Few pairs are shared
/// with idle teams: the time of a pass is that of its longest chain of atomics.
template <class CoopLaunch>
IST_HD void pass_over_pairs(CoopLaunch& coop, const BandedArrays& a, Step step) {
  const SphereLists grid = a.grid();
  const std::uint32_t shares = grid.use->pairs < coop.size() ? 8 : 1;
  distribute_statically(coop, shares * grid.use->pairs, [&](std::uint32_t i) {
    const SphereLists::Pair pair = grid.pairs[i / shares];
    const Sphere sphere = a.spheres[pair.sphere].sphere();
    const SphereLists::Share share{i % shares, shares};
    if (step == Step::count) grid.count_in_cells(coop.team(), pair, sphere, share);
    if (step == Step::reserve_lists) grid.reserve_lists(coop.team(), pair, sphere, share);
    if (step == Step::fill) grid.fill_cells(coop.team(), pair, sphere, share);
  });
}

/// The whole packing (BandedPacker on the CPU, the same spheres bit for bit), from the state's step
/// on until it is finished or needs something from the host.
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
      case Step::reserve_lists:
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
