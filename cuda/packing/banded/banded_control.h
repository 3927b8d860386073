#pragma once

#include "cuda/packing/banded/banded_state.h"

// Chooses the next step. One thread runs this at a barrier, while the others wait.

namespace ist::gpu {

IST_HD inline void to_sweep(BandedState& s) {
  s.schedule.begin_cleaning();
  s.free = s.free_taken = s.live = 0;
  s.top = s.dropped = 0;
  s.step = Step::sweep;
}

/// Starts work on the frontier's cells of one class. Many cells are processed in parts, each a
/// step, the first by one lane a cell, so that all teams run the same small code. A few cells are
/// finished in one step, since each step ends with a barrier.
IST_HD inline void to_class(const BandedArrays& a) {
  BandedState& s = *a.state;
  s.in_parts = s.frontier >= a.many;
  s.refreshed = s.confined = 0;
  s.step = s.in_parts ? Step::refresh : Step::work;
}

/// Starts work on the frontier. It covers as many levels as certainly trigger none of the
/// schedule's rules between levels, even if every cell is split.
IST_HD inline void to_work(const BandedArrays& a) {
  constexpr std::uint32_t kDeepest = 3;
  BandedState& s = *a.state;
  s.splitting = 0;
  s.classes = s.schedule.classes(s.frontier);
  s.cell_class = 0;
  s.depth = 0;
  const std::uint64_t plateau = s.schedule.plateau();
  const std::uint64_t free_slots = std::uint64_t{a.cell_capacity} - s.slots +
                                   (s.free > s.free_taken ? s.free - s.free_taken : 0);
  std::uint64_t cells = s.frontier, level = s.frontier;
  while (s.classes == 1 && s.depth < kDeepest) {
    level *= 8;
    cells += level;
    const std::uint64_t children = cells - s.frontier;
    if (s.active + cells > plateau || s.live + children > packing::BandSchedule::kMostCells ||
        children > free_slots || children > a.queue_capacity)
      break;
    ++s.depth;
  }
  s.queued = s.cascaded = 0;
  s.pending = s.frontier;
  to_class(a);
}

/// Begins the next round of the band, or the next band.
IST_HD inline void to_round(const BandedArrays& a) {
  BandedState& s = *a.state;
  if (s.frontier == 0 || s.schedule.stopped) {
    s.schedule.end_band();
    s.schedule.drop(float_of(s.dropped));
    if (s.schedule.stopped)
      s.step = Step::finished;
    else
      to_sweep(s);
    return;
  }
  s.active = 0;
  s.largest_radius = s.largest_bound = 0;
  to_work(a);
}

IST_HD inline void after_sweep(BandedState& s) {
  s.schedule.drop(float_of(s.dropped));
  s.dropped = 0;
  s.active = s.frontier = s.frontier_array = 0;
  switch (s.schedule.begin_band(float_of(s.top))) {
    case packing::BandStep::restart:
      s.step = Step::start;
      break;
    case packing::BandStep::stop:
      s.step = Step::finished;
      break;
    case packing::BandStep::work:
      s.step = s.after_grid = Step::activate;
      if (s.schedule.rebuild_grid) {
        s.layout = packing::sphere_grid_layout(s.schedule.grid_spheres, s.schedule.grid_reach);
        s.step = Step::clear_grid;
      }
      break;
  }
}

/// Handles a pass that may have found the pools of the sphere grid too small.
IST_HD inline void after_grid_pass(const BandedArrays& a, Step next) {
  BandedState& s = *a.state;
  if (a.grid().overflown()) {
    s.need = Need::grid;
    s.step = Step::clear_grid;
  } else {
    s.step = s.use.pairs > 0 ? next : s.after_grid;
  }
}

IST_HD inline void finish_round(const BandedArrays& a, std::uint32_t inserted) {
  BandedState& s = *a.state;
  const bool more = s.schedule.end_round(inserted);
  s.frontier = more ? s.active : 0;
  s.frontier_array = 1 - s.frontier_array;
  to_round(a);
}

IST_HD inline void to_selection(const BandedArrays& a) {
  BandedState& s = *a.state;
  s.winners = s.accepted = 0;
  s.volume = 0;
  if (s.active == 0) {
    finish_round(a, 0);
    return;
  }
  s.buckets = packing::candidate_buckets(float_of(s.largest_radius), s.active);
  s.step = Step::collect;
  if (s.active > a.candidate_capacity) s.need = Need::candidates;
}

IST_HD inline void after_work(const BandedArrays& a) {
  BandedState& s = *a.state;
  if (s.free_taken > s.free) s.free_taken = s.free;
  s.free += s.cascaded;
  s.cascaded = 0;
  if (s.stop_asked != 0) {
    s.schedule.stop(static_cast<StopReason>(s.stop_asked - 1));
    s.step = Step::finished;
  } else if (s.schedule.enough(s.active)) {
    to_selection(a);
  } else if (++s.cell_class < s.classes) {
    to_class(a);
  } else if (s.schedule.gives_up(s.splitting, s.live) || s.splitting == 0) {
    if (s.schedule.stopped)
      s.step = Step::finished;
    else
      to_selection(a);
  } else {
    s.frontier = 0;
    s.step = Step::split;
  }
}

IST_HD inline void after_split(const BandedArrays& a) {
  BandedState& s = *a.state;
  if (s.slots > a.cell_capacity) {
    s.slots = a.cell_capacity;
    s.free = s.free_taken = 0;
    s.need = Need::cells;
    return;
  }
  if (s.free_taken > s.free) s.free_taken = s.free;
  s.free += s.splitting;
  if (s.frontier == 0)
    to_selection(a);
  else
    to_work(a);
}

IST_HD inline std::uint64_t spheres_left(const BandedState& s) {
  const packing::BandSchedule& schedule = s.schedule;
  return schedule.limits.max_spheres > 0 ? schedule.limits.max_spheres - schedule.spheres
                                         : ~std::uint64_t{0};
}

IST_HD inline void after_find_winners(const BandedArrays& a) {
  BandedState& s = *a.state;
  const std::uint64_t left = spheres_left(s);
  const std::uint64_t coming = s.winners < left ? s.winners : left;
  if (s.schedule.spheres + coming > a.sphere_capacity) s.need = Need::spheres;
  s.step = Step::certify;
}

IST_HD inline void after_insert(const BandedArrays& a) {
  BandedState& s = *a.state;
  packing::BandSchedule& schedule = s.schedule;
  const std::uint64_t left = spheres_left(s);
  const auto inserted = static_cast<std::uint32_t>(s.accepted < left ? s.accepted : left);
  if (schedule.covered + s.volume < schedule.volume_wanted && inserted < left) {
    schedule.spheres += inserted;
    schedule.covered += s.volume;
  } else {
    // The packing stops among these spheres; adds them one by one to find where.
    for (std::uint64_t first = schedule.spheres, i = 0; i < inserted && !schedule.stopped; ++i)
      schedule.insert(a.spheres[first + i].r);
  }
  if (a.mailbox != nullptr) {
    a.mailbox->spheres = static_cast<std::uint32_t>(schedule.spheres);
    a.mailbox->covered = schedule.covered;
    a.mailbox->radius = schedule.threshold;
  }
  finish_round(a, inserted);
  if (s.step == Step::finished) return;
  s.after_grid = s.step;
  after_grid_pass(a, Step::count);
}

/// Chooses the step after `step`: the next one in the order of Step by default.
IST_HD inline void after_step(const BandedArrays& a, Step step) {
  BandedState& s = *a.state;
  switch (step) {
    case Step::start:
      s.slots = 1;
      return to_sweep(s);
    case Step::sweep:
      return after_sweep(s);
    case Step::clear_grid:
      s.use = {SphereLists::kFirstWord, 0, 0};
      break;
    case Step::touch_all:
      return after_grid_pass(a, Step::count);
    case Step::reserve_lists:
      return after_grid_pass(a, Step::fill);
    case Step::fill:
      s.use.pairs = 0;
      s.step = s.after_grid;
      return;
    case Step::activate:
      return to_round(a);
    case Step::confine:
      s.pending = s.confined;
      break;
    case Step::work:
      return after_work(a);
    case Step::split:
      return after_split(a);
    case Step::dominate:
      return after_find_winners(a);
    case Step::insert:
      return after_insert(a);
    default:
      break;
  }
  s.step = Step{static_cast<std::uint32_t>(step) + 1};
}

}  // namespace ist::gpu
