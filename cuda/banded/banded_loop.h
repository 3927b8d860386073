#pragma once

#include "cuda/banded/banded_cells.h"
#include "cuda/banded/banded_control.h"
#include "cuda/banded/banded_selection.h"
#include "cuda/banded/banded_split.h"

namespace ist::gpu {

/// Zeroes the sphere grid for its new layout.
template <class CoopGrid>
IST_HD void clear_grid(CoopGrid& coop, const BandedArrays& a) {
  const SphereLists grid = a.grid();
  const std::uint32_t blocks = grid.block_count();
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

/// Calls pass(pair, sphere, share) for all shares of all pairs that were noted. Few pairs are
/// shared by teams that would have none: what a pass takes is the time of its longest chain of
/// atomics.
template <class CoopGrid, class Pass>
IST_HD void for_pairs(CoopGrid& coop, const BandedArrays& a, const SphereLists& grid,
                      const Pass& pass) {
  const std::uint32_t shares = grid.use->pairs < coop.size() ? 8 : 1;
  distribute_statically(coop, shares * grid.use->pairs, [&](std::uint32_t i) {
    const SphereLists::Pair pair = grid.pairs[i / shares];
    pass(pair, a.spheres[pair.sphere].sphere(), SphereLists::Share{i % shares, shares});
  });
}

/// The whole packing (BandedPacker on the CPU, the same spheres bit for bit), from the step that
/// the state says until it is finished or needs something of the host.
template <class CoopGrid, class Surface>
IST_HD void pack_banded(CoopGrid& coop, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = coop.team();
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
            [&](std::uint32_t i) { grid.touch_blocks(team, i, a.spheres[i].sphere()); });
        break;
      }
      case Step::count: {
        const SphereLists grid = a.grid();
        for_pairs(
            coop, a, grid,
            [&](const SphereLists::Pair& pair, const Sphere& sphere, SphereLists::Share share) {
              grid.count_in_cells(team, pair, sphere, share);
            });
        break;
      }
      case Step::make_room: {
        const SphereLists grid = a.grid();
        for_pairs(coop, a, grid,
                  [&](const SphereLists::Pair& pair, const Sphere& sphere,
                      SphereLists::Share share) { grid.make_room(team, pair, sphere, share); });
        break;
      }
      case Step::fill: {
        const SphereLists grid = a.grid();
        for_pairs(coop, a, grid,
                  [&](const SphereLists::Pair& pair, const Sphere& sphere,
                      SphereLists::Share share) { grid.fill_cells(team, pair, sphere, share); });
        break;
      }
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
      ++s.steps;
      if (a.timed) {
        const std::uint64_t now = coop.now();
        if (s.since != 0) s.time[static_cast<int>(step)] += now - s.since;
        s.since = now;
      }
      switch (step) {
        case Step::start:
          after_start(s);
          break;
        case Step::sweep:
          after_sweep(s);
          break;
        case Step::clear_grid:
          after_clear_grid(s);
          break;
        case Step::touch_all:
          after_grid_pass(a, Step::count);
          break;
        case Step::count:
          s.step = Step::make_room;
          break;
        case Step::make_room:
          after_grid_pass(a, Step::fill);
          break;
        case Step::fill:
          after_fill(s);
          break;
        case Step::activate:
          to_round(a);
          break;
        case Step::refresh:
          s.step = Step::confine;
          break;
        case Step::confine:
          s.pending = s.confined;
          s.step = Step::work;
          break;
        case Step::work:
          after_work(a);
          break;
        case Step::split:
          after_split(a);
          break;
        case Step::collect:
          s.step = Step::dominate;
          break;
        case Step::dominate:
          after_find_winners(a);
          break;
        case Step::certify:
          s.step = Step::insert;
          break;
        case Step::insert:
          after_insert(a);
          break;
        case Step::finished:
          break;
      }
    });
  }
}

}  // namespace ist::gpu
