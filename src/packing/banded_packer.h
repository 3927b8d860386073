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
    begin_at_root();
    rebuild_grid(2.0f);
    float previous = 4;
    while (!stopped_) {
      floor_ = radius_floor(previous);
      drop_dead_cells();
      float top = 0;
      for (const Cell& cell : cells_) top = std::max(top, cell.bound);
      if (dropped_ >= kSmallestRadius && top < dropped_) {
        // The forecast was too high, and what it dropped is needed: find it again.
        forecast_ = false;
        begin_at_root();
        continue;
      }
      if (top < kSmallestRadius) {
        stop(StopReason::exhausted);
      } else if (top < limits_.min_radius * (1 + kLastSlack)) {
        stop(StopReason::min_radius);
      } else {
        if (top < 0.7f * grid_.reach() ||
            result_.spheres.size() > 4 * std::max<std::size_t>(grid_.built_for(), 16))
          rebuild_grid(std::min(top * 1.001f, grid_.reach()));
        float slack = band_slack();
        if (!strict()) top = std::min(top, previous);
        if ((1 - slack) * top < kSmallestRadius) {
          stop(StopReason::exhausted);
          break;
        }
        previous = (1 - slack) * top;
        if (previous <= limits_.min_radius) {
          // The last bands are cut at the smallest radius and end a hair above it.
          previous = smallest_wanted();
          slack = kLastSlack;
        }
        const std::size_t before = result_.spheres.size();
        band(previous, slack);
        const bool last = previous <= smallest_wanted();
        if (last && !stopped_ && result_.spheres.size() == before) stop(StopReason::min_radius);
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
  static constexpr float kLastSlack = 0.01f;
  static constexpr float kFloatNoise = 1e-4f;
  static constexpr float kLargest = 1.5f;  ///< half-edge of a cell that is climbed from, in radii
  static constexpr std::size_t kMostCells = std::size_t{1} << 22;  ///< some 400 MB
  static constexpr std::uint32_t kNone = 0xFFFFFFFFu;

  /// The smallest radius that the user allows, rounded up.
  float smallest_wanted() const { return -rounded_down(-limits_.min_radius); }
  bool strict() const { return settings_.epsilon > 0; }

  /// ε of the next band. Near the target count bands get thinner, so that the last spheres are the
  /// largest ones: with radius ~ count^(−3/8), a band of ε adds n ((1−ε)^(−8/3) − 1) spheres.
  float band_slack() const {
    if (strict()) return static_cast<float>(settings_.epsilon);
    double slack = 0.2;
    if (settings_.max_spheres > 0 && !result_.spheres.empty()) {
      const auto n = static_cast<double>(result_.spheres.size());
      const double left = static_cast<double>(settings_.max_spheres) - n;
      slack = std::min(slack, 1 - power_three_eighths(n / (n + 1.5 * left)));
    }
    return static_cast<float>(std::max(slack, 0.02));
  }

  /// Radius below which nothing can matter: the forecast of the last sphere's, with a margin. Where
  /// it turns out too high, the packing starts again at the root cell with the spheres it has.
  float radius_floor(float radius) const {
    const auto n = static_cast<double>(result_.spheres.size());
    if (strict() || !forecast_ || settings_.max_spheres == 0 || n < 64) return kSmallestRadius;
    const double left = n / static_cast<double>(settings_.max_spheres);
    return std::max(kSmallestRadius,
                    static_cast<float>(0.6 * double{radius} * power_three_eighths(left)));
  }

  /// Cells under work at once beyond which more of them cannot be needed.
  std::size_t plateau() const {
    const std::size_t left =
        settings_.max_spheres > 0 ? settings_.max_spheres - result_.spheres.size() : 10000;
    return 4096 + 16 * left;
  }

  void begin_at_root() {
    dropped_ = 0;
    cells_.assign(1, Cell{});
    cells_[0].inside = surface_.inside(cells_[0].centre);
  }

  /// Inserts spheres of radius ≥ threshold until the band has given what it has.
  void band(float threshold, float slack) {
    // A cell with a half-diagonal below a quarter of the margin settles or holds a candidate, for
    // its bound exceeds its prototype's radius by no more than the half-diagonal.
    const float margin = threshold * (1 + 0.5f * slack);
    std::vector<std::uint32_t> active;
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (cells_[i].bound >= margin) active.push_back(static_cast<std::uint32_t>(i));
    while (!active.empty() && !stopped_) {
      resolve(active, threshold, margin);
      if (stopped_) return;
      const std::size_t inserted = insert_independent(active, threshold, margin);
      ++result_.rounds;
      // Under an explicit ε what is left must be refuted, not only found to yield nothing now.
      if (inserted == 0 && (!strict() || threshold <= smallest_wanted())) break;
    }
  }

  /// Works on the cells until each has settled or holds a candidate; leaves the latter in `active`.
  void resolve(std::vector<std::uint32_t>& active, float threshold, float margin) {
    const PrototypeField<Surface> field(surface_, result_.spheres, grid_);
    std::vector<std::uint32_t> frontier = std::move(active), splitting;
    std::vector<CellState> state;
    active.clear();
    while (!frontier.empty()) {
      // A plateau: so many places are equally good that any of them will do. Cells then are climbed
      // from at any size, and split only where that fails.
      const float largest = frontier.size() > plateau() ? 2 : kLargest * threshold;
      state.resize(frontier.size());
      splitting.clear();
      for (std::size_t from = 0; from < frontier.size(); from += kChunk) {
        const std::size_t to = std::min(frontier.size(), from + kChunk);
        for_each_index(from, to, [&](std::size_t i) {
          state[i] = field.work(cells_[frontier[i]], threshold, margin, largest);
        });
        for (std::size_t i = from; i < to; ++i) {
          if (state[i] == CellState::candidate) active.push_back(frontier[i]);
          if (state[i] == CellState::split) splitting.push_back(frontier[i]);
        }
        if (out_of_time_or_cancelled(threshold)) return;
        if (active.size() > plateau()) break;
      }
      if (active.size() > plateau()) break;
      frontier.clear();
      // Bounds that do not separate: in the automatic schedule the next band asks for less.
      if (!strict() && splitting.size() > 2 * plateau()) break;
      if (cells_.size() > kMostCells) {
        if (strict()) stop(StopReason::exhausted);
        break;
      }
      split(splitting, field, margin, frontier);
    }
    std::sort(active.begin(), active.end());
  }

  /// Replaces each cell by those of its children that still count; appends the ones that reach the
  /// margin to `unsettled`.
  void split(const std::vector<std::uint32_t>& parents, const PrototypeField<Surface>& field,
             float margin, std::vector<std::uint32_t>& unsettled) {
    std::vector<Cell> children(8 * std::min(parents.size(), kChunk));
    for (std::size_t from = 0; from < parents.size(); from += kChunk) {
      const std::size_t to = std::min(parents.size(), from + kChunk);
      for_each_index(from, to, [&](std::size_t i) {
        for (int k = 0; k < 8; ++k) {
          Cell& child = children[8 * (i - from) + static_cast<std::size_t>(k)];
          child = octant(cells_[parents[i]], k);
          Sample s;
          Float3 y;
          field.settles(child, margin, s, y);
          if (child.half < kSmallestHalfEdge) child.bound = std::min(child.bound, 0.999f * margin);
        }
      });
      for (std::size_t i = from; i < to; ++i) {
        std::uint32_t place = parents[i];
        cells_[place].bound = 0;
        for (std::size_t k = 0; k < 8; ++k) {
          const Cell& child = children[8 * (i - from) + k];
          if (child.bound < floor_) {
            dropped_ = std::max(dropped_, child.bound);
            continue;
          }
          if (place == kNone) {
            place = static_cast<std::uint32_t>(cells_.size());
            cells_.emplace_back();
          }
          cells_[place] = child;
          if (child.bound >= margin) unsettled.push_back(place);
          place = kNone;
        }
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
    for_each_index(0, winners.size(), [&](std::size_t i) {
      surface_distance[i] = surface_.clearance(candidates[winners[i]].centre);
    });
    std::size_t inserted = 0;
    for (std::size_t i = 0; i < winners.size() && !stopped_; ++i) {
      const Candidate& c = candidates[winners[i]];
      const float r =
          certified_radius(c.centre, c.radius, surface_distance[i], result_.spheres, grid_);
      const bool close = !strict() && r >= 0.99f * threshold && r >= kSmallestRadius / 2 &&
                         double{r} >= limits_.min_radius;
      if (r < threshold && !close) {
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
    const auto dead = [this](const Cell& cell) { return cell.bound < floor_; };
    for (const Cell& cell : cells_)
      if (dead(cell)) dropped_ = std::max(dropped_, cell.bound);
    cells_.erase(std::remove_if(cells_.begin(), cells_.end(), dead), cells_.end());
  }

  template <class Work>
  static void for_each_index(std::size_t from, std::size_t to, const Work& work) {
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(from, to, 16),
                              [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                                for (std::size_t i = range.begin(); i != range.end(); ++i) work(i);
                              });
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
  float floor_ = kSmallestRadius;
  float dropped_ = 0;  ///< largest bound of the cells that the floor took
  bool forecast_ = true;
  bool stopped_ = false;
  StopReason reason_ = StopReason::exhausted;
  Clock::time_point start_, last_report_;
};

}  // namespace ist::packing
