#pragma once

#include "base/elementary.h"
#include "base/hashing.h"
#include "packing/base/certificate.h"

namespace ist::packing {

enum class BandStep : std::uint32_t {
  work,     ///< process the cells whose bound reaches the margin
  restart,  ///< drop all cells and begin at the root; spheres and grid stay
  stop,
};

/// All decisions of the banded packing (docs/design.md 4.2) in one plain state that drives both the
/// CPU loop and the GPU kernel. All its inputs are maxima or counts of sets.
///
///   rebuild the grid for (grid_spheres, grid_reach); cells = {root}
///   loop:
///     begin_cleaning(); cells with bound < floor die, drop(their largest bound)
///     begin_band(largest bound left) → work | restart | stop; rebuild the grid if rebuild_grid
///     active = cells with bound ≥ margin
///     rounds: resolve active (plateau(), largest_half(), classes(), …), insert, end_round()
///     end_band()
struct BandSchedule {
  static constexpr float kSmallestRadius =
      0x1p-23f;  ///< smaller radii cannot be resolved by float coordinates
  static constexpr float kLastSlack = 0.01f;
  static constexpr float kLargest = 1.5f;  ///< half-edge of a cell whose ascent may start, in radii
  static constexpr std::uint64_t kMostCells = std::uint64_t{1} << 22;  ///< 80 B each

  PackingLimits limits;
  double volume_unit = 0x1p-58;  ///< [unit-frame³] unit of the integers in which volumes are summed
  std::uint64_t volume_wanted = 0;  ///< target, in volume_unit

  float threshold = 4;            ///< radius that a candidate of this band reaches
  float margin = 0;               ///< bound below which a cell settles
  float floor = kSmallestRadius;  ///< cells with a smaller bound are irrelevant
  float dropped = 0;              ///< largest bound of the cells below the floor

  float grid_reach = 2;
  std::uint64_t grid_spheres = 0;  ///< count when the grid was laid out
  bool rebuild_grid = false;       ///< set by begin_band(): lay the grid out for these

  std::uint64_t spheres = 0;
  std::uint64_t covered = 0;  ///< in volume_unit
  std::uint64_t spheres_before_band = 0;
  std::uint64_t rounds = 0;
  bool forecast = true;
  bool stopped = false;
  StopReason reason = StopReason::exhausted;

  BandSchedule() = default;
  explicit BandSchedule(const PackingLimits& of)
      : limits(of), volume_unit(volume_unit_of(of.volume)) {
    const double wanted = of.target_coverage * of.volume / volume_unit;
    volume_wanted = wanted < 0x1p63 ? static_cast<std::uint64_t>(wanted) + 1 : ~std::uint64_t{0};
  }

  IST_HD bool strict() const { return limits.epsilon > 0; }
  IST_HD double coverage() const {
    const double part = static_cast<double>(covered) * volume_unit / limits.volume;
    return part < 1 ? part : 1;
  }

  /// Sets `floor`: the forecast of the last sphere's radius, with a margin. If it proves too high,
  /// the packing restarts at the root cell with the spheres that it has.
  IST_HD void begin_cleaning() {
    floor = kSmallestRadius;
    if (strict() || !forecast || limits.max_spheres == 0 || spheres < 64) return;
    const double done = static_cast<double>(spheres) / static_cast<double>(limits.max_spheres);
    const auto radius = static_cast<float>(0.6 * double{threshold} * power_three_eighths(done));
    if (radius > floor) floor = radius;
  }

  /// Records that a cell with this bound was dropped below the floor.
  IST_HD void drop(float bound) {
    if (bound > dropped) dropped = bound;
  }

  /// Begins a band below `top`, the largest bound of all cells (0 if there are none).
  IST_HD BandStep begin_band(float top) {
    rebuild_grid = false;
    if (dropped >= kSmallestRadius && top < dropped) {
      // The forecast was too high, and the dropped cells are needed: restart.
      forecast = false;
      dropped = 0;
      return BandStep::restart;
    }
    if (top < kSmallestRadius) return stop(StopReason::exhausted);
    if (double{top} < limits.min_radius * (1 + double{kLastSlack}))
      return stop(StopReason::min_radius);
    if (top < 0.7f * grid_reach || spheres > 4 * (grid_spheres > 16 ? grid_spheres : 16)) {
      rebuild_grid = true;
      const float reach = top * 1.001f;
      if (reach < grid_reach) grid_reach = reach;
      grid_spheres = spheres;
    }
    float slack = band_slack();
    if (!strict() && threshold < top) top = threshold;
    threshold = (1 - slack) * top;
    if (threshold < kSmallestRadius) return stop(StopReason::exhausted);
    if (double{threshold} <= limits.min_radius) {
      // The last bands are limited by the smallest radius and end slightly above it.
      threshold = smallest_wanted();
      slack = kLastSlack;
    }
    // A cell with a half-diagonal below a quarter of the margin settles or gets a candidate, as its
    // bound exceeds its prototype's radius by no more than the half-diagonal.
    margin = threshold * (1 + 0.5f * slack);
    spheres_before_band = spheres;
    return BandStep::work;
  }

  /// If more cells than this are processed at once, further ones are not needed: so many places are
  /// equally good that any of them will do.
  IST_HD std::uint64_t plateau() const {
    const std::uint64_t left = limits.max_spheres > 0 ? limits.max_spheres - spheres : 10000;
    return 4096 + 16 * left;
  }

  /// The largest half-edge of cells from which an ascent starts, with `frontier` cells in progress.
  /// On a plateau ascents start from cells of any size, and cells are split only if that fails.
  IST_HD float largest_half(std::uint64_t frontier) const {
    return frontier > plateau() ? 2 : kLargest * threshold;
  }

  /// On a plateau a frontier is processed in this many classes, one after the other.
  IST_HD std::uint32_t classes(std::uint64_t frontier) const {
    return frontier > plateau() ? static_cast<std::uint32_t>((frontier - 1) / plateau()) + 1 : 1;
  }
  IST_HD static std::uint32_t class_of(Float3 centre, std::uint32_t classes) {
    return static_cast<std::uint32_t>(std::uint64_t{point_hash(centre, 0)} * classes >> 32);
  }

  /// True after a class if there are enough candidates. The rest of the frontier waits for the next
  /// band.
  IST_HD bool enough(std::uint64_t candidates) const { return candidates > plateau(); }

  /// Tests after a level, before its cells are split, whether to give up: bounds do not separate,
  /// so the next band lowers the threshold; or there are too many cells. `cells`: those that
  /// begin_band() left and all children since then that reach the floor, split or not.
  IST_HD bool gives_up(std::uint64_t splitting, std::uint64_t cells) {
    if (!strict() && splitting > 2 * plateau()) return true;
    if (cells <= kMostCells) return false;
    if (strict()) stop(StopReason::exhausted);
    return true;
  }

  /// True if a winner's certified radius is worth inserting. If not, float overestimated the
  /// clearance: the cell loses its prototype and gets refused_bound().
  IST_HD bool accepts(float r) const {
    if (r >= threshold) return true;
    return !strict() && r >= 0.99f * threshold && r >= kSmallestRadius / 2 &&
           double{r} >= limits.min_radius;
  }
  IST_HD float refused_bound() const { return 0.999f * margin; }

  /// Counts an inserted sphere; stops the packing at the last one wanted.
  IST_HD void insert(float r) {
    ++spheres;
    covered += fixed_ball_volume(r, volume_unit);
    if (spheres == limits.max_spheres)
      stop(StopReason::sphere_count);
    else if (covered >= volume_wanted)
      stop(StopReason::coverage);
  }

  /// Ends a round that inserted so many; true if the band has another one.
  IST_HD bool end_round(std::uint64_t inserted) {
    ++rounds;
    // With an explicit ε the rest must be refuted, not merely found to yield nothing now.
    return !stopped && (inserted > 0 || (strict() && threshold > smallest_wanted()));
  }

  IST_HD void end_band() {
    const bool last = threshold <= smallest_wanted();
    if (last && !stopped && spheres == spheres_before_band) stop(StopReason::min_radius);
  }

  IST_HD BandStep stop(StopReason why) {
    stopped = true;
    reason = why;
    return BandStep::stop;
  }

 private:
  /// The smallest radius that the user allows, rounded up.
  IST_HD float smallest_wanted() const { return rounded_up(limits.min_radius); }

  /// ε of the next band. Near the target count bands get thinner, so that the last spheres are the
  /// largest ones: with radius ~ count^(−3/8), a band of ε adds n ((1−ε)^(−8/3) − 1) spheres.
  IST_HD float band_slack() const {
    if (strict()) return static_cast<float>(limits.epsilon);
    double slack = 0.2;
    if (limits.max_spheres > 0 && spheres > 0) {
      const auto n = static_cast<double>(spheres);
      const double left = static_cast<double>(limits.max_spheres) - n;
      const double thin = 1 - power_three_eighths(n / (n + 1.5 * left));
      if (thin < slack) slack = thin;
    }
    return static_cast<float>(slack > 0.02 ? slack : 0.02);
  }
};

}  // namespace ist::packing
