#pragma once

#include "cuda/banded/banded_cells.h"
#include "cuda/banded/banded_control.h"
#include "cuda/banded/banded_selection.h"
#include "cuda/banded/banded_split.h"

namespace ist::gpu {

/// Zeroes the sphere grid for its new layout.
template <class Crew>
IST_HD void clear_grid(Crew& crew, const BandedArrays& a) {
  const SphereLists grid = a.grid();
  const std::uint32_t blocks = grid.block_count();
  share_out_to_lanes(crew, blocks, [&](std::uint32_t i) {
    if (i < blocks) grid.blocks[i] = 0;
  });
  const std::uint32_t used =
      grid.use->cell_blocks < grid.block_capacity ? grid.use->cell_blocks : grid.block_capacity;
  const std::uint32_t cells = used * SphereLists::kCellsPerBlock;
  share_out_to_lanes(crew, cells, [&](std::uint32_t i) {
    if (i < cells) grid.cells[i] = {0, 0};
  });
}

/// Calls pass(pair, sphere, share) for all shares of all pairs that were noted. Few pairs are
/// shared by teams that would have none: what a pass takes is the time of its longest chain of
/// atomics.
template <class Crew, class Pass>
IST_HD void for_pairs(Crew& crew, const BandedArrays& a, const SphereLists& grid,
                      const Pass& pass) {
  const std::uint32_t shares = grid.use->pairs < crew.size() ? 8 : 1;
  share_out(crew, shares * grid.use->pairs, [&](std::uint32_t i) {
    const SphereLists::Pair pair = grid.pairs[i / shares];
    pass(pair, a.spheres[pair.sphere].sphere(), SphereLists::Share{i % shares, shares});
  });
}

/// The whole packing (BandedPacker on the CPU, the same spheres bit for bit), from the step that
/// the state says until it is finished or needs something of the host.
template <class Crew, class Surface>
IST_HD void pack_banded(Crew& crew, const BandedArrays& a, const Surface& surface) {
  BandedState& s = *a.state;
  const auto& team = crew.team();
  for (;;) {
    const Step step = s.step;
    if (step == Step::finished || s.need != Need::nothing) return;
    switch (step) {
      case Step::start:
        plant_root(crew, a, surface);
        break;
      case Step::sweep:
        sweep_cells(crew, a);
        break;
      case Step::clear_grid:
        clear_grid(crew, a);
        break;
      case Step::touch_all: {
        const SphereLists grid = a.grid();
        take_turns(crew, static_cast<std::uint32_t>(s.schedule.spheres), &s.taken,
                   [&](std::uint32_t i) { grid.touch_blocks(team, i, a.spheres[i].sphere()); });
        break;
      }
      case Step::count: {
        const SphereLists grid = a.grid();
        for_pairs(
            crew, a, grid,
            [&](const SphereLists::Pair& pair, const Sphere& sphere, SphereLists::Share share) {
              grid.count_in_cells(team, pair, sphere, share);
            });
        break;
      }
      case Step::make_room: {
        const SphereLists grid = a.grid();
        for_pairs(crew, a, grid,
                  [&](const SphereLists::Pair& pair, const Sphere& sphere,
                      SphereLists::Share share) { grid.make_room(team, pair, sphere, share); });
        break;
      }
      case Step::fill: {
        const SphereLists grid = a.grid();
        for_pairs(crew, a, grid,
                  [&](const SphereLists::Pair& pair, const Sphere& sphere,
                      SphereLists::Share share) { grid.fill_cells(team, pair, sphere, share); });
        break;
      }
      case Step::activate:
        activate_cells(crew, a);
        break;
      case Step::refresh:
        refresh_cells(crew, a, surface);
        break;
      case Step::confine:
        confine_cells(crew, a, surface);
        break;
      case Step::work:
        work_on_cells(crew, a, surface);
        break;
      case Step::split:
        split_cells(crew, a, surface);
        break;
      case Step::collect:
        collect_candidates(crew, a);
        break;
      case Step::dominate:
        find_winners(crew, a);
        break;
      case Step::certify:
        certify_winners(crew, a, surface);
        break;
      case Step::insert:
        insert_winners(crew, a);
        break;
      case Step::finished:
        break;
    }
    crew.sync([&] {
      s.taken = 0;
      ++s.steps;
      if (a.timed) {
        const std::uint64_t now = crew.now();
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
