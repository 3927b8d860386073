#pragma once

#include <ist/bake.h>
#include <algorithm>

#include "base/stage.h"
#include "base/thread_arena.h"
#include "packing/banded/band_schedule.h"
#include "packing/banded/candidate.h"
#include "packing/banded/prototype.h"
#include "packing/base/packing_settings.h"
#include "packing/base/sphere_grid.h"

namespace ist::packing {

/// Keeps the order of lists. The result does not depend on it; tests use another order.
struct AsFound {
  using Spheres = GridSpheres;
  static void arrange(std::vector<std::uint32_t>&) {}
};

/// Completes a packing. `kept`: radii over the largest bound at insertion, in order.
inline void finish(SpherePacking& packing, const BandSchedule& schedule, std::vector<float> kept) {
  packing.stop = schedule.reason;
  packing.coverage = schedule.coverage();
  packing.rounds = schedule.rounds;
  for (const Sphere& s : packing.spheres)
    if (s.r < kFloatNoise) packing.below_float_noise = true;
  if (kept.empty()) return;
  const auto middle = kept.begin() + static_cast<std::ptrdiff_t>(kept.size() / 2);
  std::nth_element(kept.begin(), middle, kept.end());
  packing.kept_ratio_median = *middle;
  packing.kept_ratio_worst = *std::min_element(kept.begin(), kept.end());
}

/// The greedy packing with a guarantee of docs/design.md 4.2 over one kind of surface, on the host.
template <class Surface, class Order = AsFound>
class BandedPacker {
 public:
  BandedPacker(const Surface& surface, const PackingLimits& limits, Stage& stage)
      : surface_(surface), stage_(stage), schedule_(limits) {}

  SpherePacking run() {
    begin_at_root();
    while (!schedule_.stopped) {
      schedule_.begin_cleaning();
      const BandStep step = schedule_.begin_band(largest_live_bound());
      if (step == BandStep::restart) begin_at_root();
      if (step != BandStep::work) continue;
      if (schedule_.rebuild_grid)
        grid_ = SphereGrid(result_.spheres,
                           sphere_grid_layout(schedule_.grid_spheres, schedule_.grid_reach));
      band();
      schedule_.end_band();
    }
    finish(result_, schedule_, std::move(kept_));
    return std::move(result_);
  }

 private:
  using Feature = typename Surface::Feature;
  using Spheres = typename Order::Spheres;
  using Shape = PrototypeField<Surface, Spheres>;
  using Indices = std::vector<std::uint32_t>;
  static constexpr std::size_t kChunk = 4096;  ///< cells between two checks of clock and progress

  void begin_at_root() {
    Cell root;
    root.inside = surface_.inside(SerialTeam{}, root.centre);
    cells_.assign(1, {root, {}});
    spare_.clear();
    cell_count_ = 1;
  }

  /// Removes irrelevant cells and returns the largest bound.
  float largest_live_bound() {
    spare_.clear();
    const auto dead = [this](const StoredCell<Feature>& c) {
      return c.cell.bound < schedule_.floor;
    };
    for (const auto& c : cells_)
      if (dead(c)) schedule_.drop(c.cell.bound);
    cells_.erase(std::remove_if(cells_.begin(), cells_.end(), dead), cells_.end());
    cell_count_ = cells_.size();
    float top = 0;
    for (const auto& c : cells_) top = std::max(top, c.cell.bound);
    return top;
  }

  /// Inserts spheres of radius ≥ threshold until the band yields no more.
  void band() {
    Indices active;
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (cells_[i].cell.bound >= schedule_.margin) active.push_back(static_cast<std::uint32_t>(i));
    while (!active.empty() && !schedule_.stopped) {
      resolve(active);
      if (schedule_.stopped) return;
      if (!schedule_.end_round(insert_independent(active))) return;
    }
  }

  /// Processes the cells until each has settled or has a candidate; leaves the latter in `active`.
  void resolve(Indices& active) {
    const Spheres spheres(result_.spheres, grid_);
    const Shape field(surface_, spheres);
    Indices frontier = std::move(active), splitting;
    std::vector<CellState> state;
    active.clear();
    while (!frontier.empty()) {
      Order::arrange(frontier);
      const float largest = schedule_.largest_half(frontier.size());
      const std::uint32_t classes = schedule_.classes(frontier.size());
      splitting.clear();
      for (std::uint32_t k = 0; k < classes; ++k) {
        Indices part;
        if (classes > 1)
          for (const std::uint32_t i : frontier)
            if (BandSchedule::class_of(cells_[i].cell.centre, classes) == k) part.push_back(i);
        const Indices& now = classes > 1 ? part : frontier;
        for (std::size_t from = 0; from < now.size(); from += kChunk) {
          const std::size_t to = std::min(now.size(), from + kChunk);
          state.resize(kChunk);
          for_each_index(from, to, 16, [&](std::size_t i) {
            typename Shape::Scratch scratch;
            StoredCell<Feature>& stored = cells_[now[i]];
            Cell cell = load_cell(SerialTeam{}, stored, scratch);
            state[i - from] = field.work(SerialTeam{}, cell, scratch, schedule_.threshold,
                                         schedule_.margin, largest);
            store_cell(SerialTeam{}, cell, scratch, stored);
          });
          for (std::size_t i = from; i < to; ++i) {
            if (state[i - from] == CellState::candidate) active.push_back(now[i]);
            if (state[i - from] == CellState::split) splitting.push_back(now[i]);
          }
          if (out_of_time_or_cancelled()) return;
        }
        if (schedule_.enough(active.size())) return;
      }
      frontier.clear();
      if (schedule_.gives_up(splitting.size(), cell_count_)) return;
      split(splitting, field, frontier);
    }
  }

  /// Replaces each cell by its children that still matter; those that reach the margin go to
  /// `unsettled`.
  void split(const Indices& parents, const Shape& field, Indices& unsettled) {
    std::vector<Cell> children(8 * std::min(parents.size(), kChunk));
    for (std::size_t from = 0; from < parents.size(); from += kChunk) {
      const std::size_t to = std::min(parents.size(), from + kChunk);
      for_each_index(from, to, 16, [&](std::size_t i) {
        typename Shape::Scratch scratch;
        const Cell parent = load_cell(SerialTeam{}, cells_[parents[i]], scratch);
        for (int k = 0; k < 8; ++k)
          children[8 * (i - from) + static_cast<std::size_t>(k)] = field.child(
              SerialTeam{}, parent, k, scratch.ring, &scratch.sample[0], schedule_.margin);
      });
      for (std::size_t i = from; i < to; ++i) {
        StoredCell<Feature> kept = cells_[parents[i]];  // for its ring
        cells_[parents[i]].cell.bound = 0;
        spare_.push_back(parents[i]);
        for (std::size_t k = 0; k < 8; ++k) {
          kept.cell = children[8 * (i - from) + k];
          if (kept.cell.bound < schedule_.floor) {
            schedule_.drop(kept.cell.bound);
            continue;
          }
          const std::uint32_t place = store(kept);
          ++cell_count_;
          if (kept.cell.bound >= schedule_.margin) unsettled.push_back(place);
        }
      }
    }
  }

  std::uint32_t store(const StoredCell<Feature>& cell) {
    if (spare_.empty()) {
      cells_.push_back(cell);
      return static_cast<std::uint32_t>(cells_.size() - 1);
    }
    const std::uint32_t place = spare_.back();
    spare_.pop_back();
    cells_[place] = cell;
    return place;
  }

  /// Inserts the winners among the candidates of the active cells; returns how many were inserted.
  std::size_t insert_independent(const Indices& active) {
    std::vector<Candidate> candidates(active.size());
    float top = schedule_.margin;
    for (std::size_t i = 0; i < active.size(); ++i) {
      const Cell& cell = cells_[active[i]].cell;
      top = std::max(top, cell.bound);
      candidates[i] = {cell.prototype, cell.radius,
                       candidate_key(cell.radius, cell.centre, schedule_.limits.seed), cell.centre};
    }
    const std::vector<Winner> winners = select_independent(candidates);
    const Spheres spheres(result_.spheres, grid_);
    std::vector<float> radius(winners.size());
    for_each_index(0, winners.size(), 16, [&](std::size_t i) {
      const Candidate& c = candidates[winners[i].index];
      const double to_surface =
          gap_to_surface(surface_.clearance(SerialTeam{}, c.centre, clearance_limit(c.radius)));
      radius[i] = certified_radius(SerialTeam{}, c.centre, c.radius,
                                   std::min(winners[i].gap, to_surface), spheres);
    });
    std::size_t inserted = 0;
    for (std::size_t i = 0; i < winners.size() && !schedule_.stopped; ++i) {
      const float r = radius[i];
      if (!schedule_.accepts(r)) {
        Cell& cell = cells_[active[winners[i].index]].cell;
        cell.bound = schedule_.refused_bound();
        cell.radius = 0;
        continue;
      }
      const Float3 centre = candidates[winners[i].index].centre;
      const Sphere sphere{centre.x, centre.y, centre.z, r};
      grid_.insert(static_cast<std::uint32_t>(result_.spheres.size()), sphere);
      result_.spheres.push_back(sphere);
      kept_.push_back(std::min(1.0f, r / top));
      schedule_.insert(r);
      ++inserted;
    }
    return inserted;
  }

  bool out_of_time_or_cancelled() {
    const auto why = stage_.stop([this](Progress& now) {
      set_progress(now, schedule_.limits, result_.spheres.size(), schedule_.coverage(),
                   double{schedule_.threshold});
    });
    if (why && !schedule_.stopped) schedule_.stop(*why);
    return schedule_.stopped;
  }

  const Surface& surface_;
  Stage& stage_;
  BandSchedule schedule_;
  std::vector<StoredCell<Feature>> cells_;
  Indices spare_;               ///< indices in cells_ of cells that were split
  std::size_t cell_count_ = 0;  ///< as BandSchedule::gives_up() counts
  SphereGrid grid_{{}, sphere_grid_layout(0, 2.0f)};
  SpherePacking result_;
  std::vector<float> kept_;
};

}  // namespace ist::packing
