#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include <ist/packing.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include "packing/certificate.h"
#include "packing/prototype.h"
#include "packing/roots.h"
#include "packing/selection.h"

namespace ist::packing {

/// What the band loop needs to know of a solid beside its surface, and where it stops; unit frame.
struct BandedLimits {
  double volume = 0;
  double target_coverage = 1;
  double min_radius = 0;
  double length_unit = 1;  ///< [u] of one unit-frame unit, for progress reports
};

/// The greedy packing with a guarantee of DESIGN 4.2 over one kind of surface.
template <class Surface>
class BandedPacker {
 public:
  BandedPacker(const Surface& surface, const BandedLimits& limits, const PackingSettings& settings,
               const ProgressCallback& progress)
      : surface_(surface), limits_(limits), settings_(settings), progress_(progress) {}

  SpherePacking run() {
    start_ = last_report_ = Clock::now();
    cells_.assign(1, Cell{});
    cells_[0].inside = surface_.inside(cells_[0].centre);
    rebuild_grid(2.0f);
    float previous = 4;
    while (!stopped_) {
      drop_dead_cells();
      float top = 0;
      for (const Cell& cell : cells_) top = std::max(top, cell.bound);
      if (top < kSmallestRadius)
        stop(StopReason::exhausted);
      else if (top < limits_.min_radius)
        stop(StopReason::min_radius);
      else {
        if (top < 0.7f * grid_.reach()) rebuild_grid(top * 1.001f);
        const float slack = band_slack();
        if (!strict()) top = std::min(top, previous);
        previous = std::max((1 - slack) * top, static_cast<float>(limits_.min_radius));
        band(previous, slack);
      }
    }
    result_.stop = reason_;
    result_.coverage = std::min(1.0, covered_ / limits_.volume);
    if (!kept_.empty()) {
      const auto middle = kept_.begin() + static_cast<std::ptrdiff_t>(kept_.size() / 2);
      std::nth_element(kept_.begin(), middle, kept_.end());
      result_.kept_ratio_median = *middle;
      result_.kept_ratio_worst = *std::min_element(kept_.begin(), kept_.end());
    }
    return std::move(result_);
  }

 private:
  using Cell = packing::Cell<typename Surface::Feature>;
  using Clock = std::chrono::steady_clock;
  static constexpr float kSmallestRadius = 0x1p-21f;  ///< float coordinates resolve nothing below
  static constexpr float kSmallestHalfEdge = 0x1p-23f;
  static constexpr float kFloatNoise = 1e-4f;

  bool strict() const { return settings_.epsilon > 0; }

  /// ε of the next band. Near the target count bands get thinner, so that the last spheres are the
  /// largest ones: with radius ~ count^(−3/8), a band of ε adds n ((1−ε)^(−8/3) − 1) spheres.
  float band_slack() const {
    if (strict()) return static_cast<float>(settings_.epsilon);
    double slack = 0.2;
    if (settings_.max_spheres > 0 && !result_.spheres.empty()) {
      const auto n = static_cast<double>(result_.spheres.size());
      const double left = static_cast<double>(settings_.max_spheres) - n;
      slack = std::min(slack, 1 - power_three_eighths(n / (n + 0.5 * left)));
    }
    return static_cast<float>(std::max(slack, 0.02));
  }

  /// Inserts spheres of radius ≥ threshold until the band has given what it has.
  void band(float threshold, float slack) {
    // A cell with a half-diagonal below a quarter of the margin settles or holds a candidate, for
    // its bound exceeds its prototype's radius by no more than the half-diagonal.
    const float margin = threshold * (1 + 0.5f * slack);
    std::vector<std::uint32_t> active;
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (cells_[i].bound >= margin) active.push_back(static_cast<std::uint32_t>(i));
    std::size_t first = 0;
    while (!active.empty() && !stopped_) {
      resolve(active, threshold, margin);
      if (stopped_) return;
      const std::size_t inserted = insert_independent(active, threshold, margin);
      ++result_.rounds;
      if (first == 0) first = inserted;
      if (!strict() && 10 * inserted <= 3 * first) break;
    }
  }

  /// Works on the cells until each has settled or holds a candidate; leaves the latter in `active`.
  void resolve(std::vector<std::uint32_t>& active, float threshold, float margin) {
    std::vector<std::uint32_t> frontier = std::move(active), next;
    std::vector<CellState> state;
    active.clear();
    while (!frontier.empty()) {
      state.assign(frontier.size(), CellState::settled);
      const PrototypeField<Surface> field(surface_, result_.spheres, grid_);
      for (std::size_t from = 0; from < frontier.size(); from += kChunk) {
        oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(
                                      from, std::min(frontier.size(), from + kChunk), 16),
                                  [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                                    for (std::size_t i = range.begin(); i != range.end(); ++i)
                                      state[i] = field.work(cells_[frontier[i]], threshold, margin,
                                                            threshold);
                                  });
        if (out_of_time_or_cancelled(threshold)) return;
      }
      next.clear();
      for (std::size_t i = 0; i < frontier.size(); ++i) {
        if (state[i] == CellState::candidate) active.push_back(frontier[i]);
        if (state[i] == CellState::split) split(frontier[i], margin, next);
      }
      frontier.swap(next);
    }
    std::sort(active.begin(), active.end());
  }

  /// Replaces a cell by its eight children; the first takes its place.
  void split(std::uint32_t index, float margin, std::vector<std::uint32_t>& children) {
    const Cell parent = cells_[index];
    if (parent.half <= kSmallestHalfEdge) {
      cells_[index].bound = 0.999f * margin;
      return;
    }
    const float quarter = 0.5f * parent.half;
    const float offset = quarter * 1.7320510f;
    for (int k = 0; k < 8; ++k) {
      Cell child;
      child.centre = {parent.centre.x + ((k & 1) != 0 ? quarter : -quarter),
                      parent.centre.y + ((k & 2) != 0 ? quarter : -quarter),
                      parent.centre.z + ((k & 4) != 0 ? quarter : -quarter)};
      child.half = quarter;
      child.bound = parent.bound;
      child.ring = parent.ring;
      child.surface_at_least = parent.surface_at_least - offset;
      child.inside = parent.inside;
      child.side_known = child.surface_at_least > 0;
      if (k == 0) {
        cells_[index] = child;
        children.push_back(index);
      } else {
        children.push_back(static_cast<std::uint32_t>(cells_.size()));
        cells_.push_back(child);
      }
    }
  }

  /// Inserts what wins among the candidates of the active cells; returns how many were inserted.
  std::size_t insert_independent(const std::vector<std::uint32_t>& active, float threshold,
                                 float margin) {
    std::vector<Candidate> candidates(active.size());
    float top = margin;
    for (std::size_t i = 0; i < active.size(); ++i) {
      const Cell& cell = cells_[active[i]];
      top = std::max(top, cell.bound);
      candidates[i] = {cell.prototype, cell.radius,
                       candidate_key(cell.radius, cell.centre, settings_.seed)};
    }
    const std::vector<std::uint32_t> winners = select_independent(candidates);
    std::vector<double> surface_distance(winners.size());
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, winners.size(), 16),
                              [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                                for (std::size_t i = range.begin(); i != range.end(); ++i)
                                  surface_distance[i] =
                                      surface_.clearance(candidates[winners[i]].centre);
                              });
    std::size_t inserted = 0;
    for (std::size_t i = 0; i < winners.size() && !stopped_; ++i) {
      const Candidate& c = candidates[winners[i]];
      const float r =
          certified_radius(c.centre, c.radius, surface_distance[i], result_.spheres, grid_);
      if (r < threshold && !(r >= kSmallestRadius && r >= 0.99f * threshold && !strict())) {
        // Float saw more room than there is.
        cells_[active[winners[i]]].bound = 0.999f * margin;
        cells_[active[winners[i]]].radius = 0;
        continue;
      }
      const Sphere sphere{c.centre.x, c.centre.y, c.centre.z, r};
      grid_.insert(static_cast<std::uint32_t>(result_.spheres.size()), sphere);
      result_.spheres.push_back(sphere);
      kept_.push_back(std::min(1.0f, r / top));
      if (r < kFloatNoise) result_.below_float_noise = true;
      covered_ += kBallVolume * double{r} * double{r} * double{r};
      ++inserted;
      if (result_.spheres.size() == settings_.max_spheres)
        stop(StopReason::sphere_count);
      else if (covered_ >= limits_.target_coverage * limits_.volume)
        stop(StopReason::coverage);
    }
    return inserted;
  }

  void drop_dead_cells() {
    const auto dead = [](const Cell& cell) { return cell.bound < kSmallestRadius; };
    const auto count = std::count_if(cells_.begin(), cells_.end(), dead);
    if (2 * static_cast<std::size_t>(count) > cells_.size())
      cells_.erase(std::remove_if(cells_.begin(), cells_.end(), dead), cells_.end());
  }

  void rebuild_grid(float reach) { grid_ = SphereGrid(result_.spheres, reach); }

  void stop(StopReason reason) {
    stopped_ = true;
    reason_ = reason;
  }

  bool out_of_time_or_cancelled(float radius) {
    const auto now = Clock::now();
    const double elapsed = std::chrono::duration<double>(now - start_).count();
    if (settings_.time_limit > 0 && elapsed >= settings_.time_limit) stop(StopReason::time_limit);
    if (progress_ && now - last_report_ >= std::chrono::milliseconds(100)) {
      last_report_ = now;
      Progress p;
      p.stage = "pack";
      p.spheres = result_.spheres.size();
      p.coverage = covered_ / limits_.volume;
      p.radius = radius * limits_.length_unit;
      p.fraction = p.coverage / limits_.target_coverage;
      if (settings_.max_spheres > 0)
        p.fraction = std::max(p.fraction, static_cast<double>(p.spheres) /
                                              static_cast<double>(settings_.max_spheres));
      p.elapsed = elapsed;
      if (!progress_(p)) stop(StopReason::cancelled);
    }
    return stopped_;
  }

  static constexpr std::size_t kChunk = 4096;  ///< cells between two looks at clock and progress
  static constexpr double kBallVolume = 4.18879020478639098;

  const Surface& surface_;
  const BandedLimits limits_;
  const PackingSettings& settings_;
  const ProgressCallback& progress_;
  std::vector<Cell> cells_;
  SphereGrid grid_{{}, 2.0f};
  SpherePacking result_;
  std::vector<float> kept_;
  double covered_ = 0;
  bool stopped_ = false;
  StopReason reason_ = StopReason::exhausted;
  Clock::time_point start_, last_report_;
};

}  // namespace ist::packing
