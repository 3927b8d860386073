#include "packing/grids/grid_packer.h"

#include <algorithm>
#include <chrono>

#include "packing/certificate.h"

namespace ist::packing {
namespace {

constexpr float kSmallestRadius = 0x1p-21f;  ///< float coordinates resolve nothing below
constexpr float kFloatNoise = 1e-4f;
constexpr int kIdleRounds = 3;  ///< without a sphere at the finest grids: nothing fits any more

class GridPacker {
 public:
  GridPacker(GridBackend& backend, const GridSchedule& schedule, const GridLimits& limits,
             const PackingSettings& settings, const ProgressCallback& progress,
             std::vector<GridRound>* history)
      : backend_(backend),
        schedule_(schedule),
        limits_(limits),
        settings_(settings),
        progress_(progress),
        history_(history),
        prototypes_(schedule.level(schedule.prototypes)),
        distances_(schedule.distances) {}

  SpherePacking run() {
    start_ = last_report_ = Clock::now();
    backend_.build(schedule_.level(distances_));
    backend_.place_prototypes(prototypes_);
    int rounds_at_level = 0, idle = 0;
    while (goes_on()) {
      const bool any = round();
      if (stopped_) break;
      idle = any ? 0 : idle + 1;
      ++rounds_at_level;
      if (prototypes_.level < schedule_.finest_prototypes &&
          (rounds_at_level >= schedule_.rounds_per_level || !any)) {
        refine();
        rounds_at_level = idle = 0;
      } else if (any) {
        backend_.update();
      } else if (idle == kIdleRounds) {
        stop(too_small_ ? StopReason::min_radius : StopReason::exhausted);
      }
    }
    result_.stop = reason_;
    result_.coverage = coverage();
    return std::move(result_);
  }

 private:
  using Clock = std::chrono::steady_clock;

  /// Inserts what one set of prototypes finds; false if that is nothing.
  bool round() {
    const float smallest = std::max(
        kSmallestRadius, limits_.min_radius > 0 ? -rounded_down(-limits_.min_radius) : 0.0f);
    std::vector<GridWinner> winners = backend_.round(
        {prototypes_, settings_.seed, static_cast<std::uint32_t>(result_.rounds), smallest},
        [this] { return goes_on(); });
    if (stopped_) return false;
    std::sort(winners.begin(), winners.end(), [](const GridWinner& a, const GridWinner& b) {
      return goes_before(a.candidate, b.candidate);
    });
    std::vector<Sphere> inserted;
    for (const GridWinner& w : winners) {
      const float r = rounded_down(w.room);
      if (!(r >= smallest)) continue;
      if (r < kFloatNoise) result_.below_float_noise = true;
      inserted.push_back({w.candidate.centre.x, w.candidate.centre.y, w.candidate.centre.z, r});
      radius_ = inserted.front().r;
      result_.spheres.push_back(inserted.back());
      covered_ += fixed_ball_volume(r, volume_unit_);
      if (result_.spheres.size() == settings_.max_spheres)
        stop(StopReason::sphere_count);
      else if (coverage() >= limits_.target_coverage)
        stop(StopReason::coverage);
      if (stopped_) break;
    }
    too_small_ = smallest > kSmallestRadius;
    ++result_.rounds;
    if (!stopped_) backend_.append(inserted);
    record(inserted.empty() ? 0 : double{inserted.front().r});
    return !inserted.empty();
  }

  /// Splits the prototype grid; the distance grid follows where it would be the coarser one.
  void refine() {
    prototypes_ = refined(prototypes_);
    if (distances_ < std::min(schedule_.finest_distances, prototypes_.level)) {
      ++distances_;
      backend_.build(schedule_.level(distances_));
    } else {
      backend_.update();
    }
    backend_.split_prototypes();
  }

  void record(double radius) {
    if (history_ == nullptr) return;
    history_->push_back({elapsed(), result_.spheres.size(), coverage(), radius, prototypes_.level,
                         distances_, backend_.use()});
  }

  double coverage() const {
    return std::min(1.0, static_cast<double>(covered_) * volume_unit_ / limits_.volume);
  }

  double elapsed() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  void stop(StopReason reason) {
    stopped_ = true;
    reason_ = reason;
  }

  /// Looks at the clock, and asks the user's callback ten times a second.
  bool goes_on() {
    if (stopped_) return false;
    if (settings_.time_limit > 0 && elapsed() >= settings_.time_limit) stop(StopReason::time_limit);
    const auto now = Clock::now();
    if (progress_ && now - last_report_ >= std::chrono::milliseconds(100)) {
      last_report_ = now;
      Progress p;
      p.stage = "pack";
      p.spheres = result_.spheres.size();
      p.coverage = coverage();
      p.radius = double{radius_} * limits_.length_unit;
      p.fraction = std::min(1.0, p.coverage / limits_.target_coverage);
      if (settings_.max_spheres > 0)
        p.fraction = std::max(p.fraction, static_cast<double>(p.spheres) /
                                              static_cast<double>(settings_.max_spheres));
      p.elapsed = elapsed();
      if (!progress_(p)) stop(StopReason::cancelled);
    }
    return !stopped_;
  }

  GridBackend& backend_;
  const GridSchedule& schedule_;
  const GridLimits& limits_;
  const PackingSettings& settings_;
  const ProgressCallback& progress_;
  std::vector<GridRound>* const history_;
  GridLayout prototypes_;
  int distances_;
  SpherePacking result_;
  double volume_unit_ = volume_unit_of(limits_.volume);
  std::uint64_t covered_ = 0;  ///< in volume_unit_
  float radius_ = 0;
  bool too_small_ = false;  ///< a smallest radius was asked for
  bool stopped_ = false;
  StopReason reason_ = StopReason::exhausted;
  Clock::time_point start_, last_report_;
};

}  // namespace

SpherePacking pack_on_grids(GridBackend& backend, const GridSchedule& schedule,
                            const GridLimits& limits, const PackingSettings& settings,
                            const ProgressCallback& progress, std::vector<GridRound>* history) {
  return GridPacker(backend, schedule, limits, settings, progress, history).run();
}

}  // namespace ist::packing
