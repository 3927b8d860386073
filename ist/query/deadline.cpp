#include <ist/deadline.h>

#include <algorithm>
#include <cmath>

namespace ist {
namespace {

// Sphere pairs per µs of a first contact. A core does 40 to 100 in deep contacts, and 10 in shallow
// ones. A nut in its thread, which is never apart, gains 1 % with this, 2 % with 8 or 10.
constexpr double kFirst = 7;
// Fraction of the deadline at which the percentile of the times is aimed. For a ring and a torus
// knot of 16,000 spheres and budgets of 200 to 1,600, p99 is 1.2 to 1.3 times p95.
constexpr double kAim = 0.8;
// A cost above the estimate raises it by this fraction of a step, one below lowers it by the rest.
// A stall of the thread counts as one step.
constexpr double kPercentile = 0.95;
constexpr double kFirstStep = 0.5, kLastStep = 1.0 / 32;
constexpr double kHalved = 16;  ///< samples after which steps are half as large
// The budget does not change while it is within these multiples of the wanted one.
constexpr double kLow = 0.75, kHigh = 1.1;
// Fractions by which a budget rises and falls per query in contact. The potential changes with it:
// coarser levels report more volume in narrow gaps, so a fall may add energy and a rise removes it.
constexpr double kRise = 1.0 / 1024, kFall = 1.0 / 8192;
// The coarsest levels, of 250 to 999 spheres, answer below this.
constexpr double kLeast = 64;
constexpr double kMost = 1u << 30;
constexpr double kSlowQueries = 32, kSlow = 1.0 / 8;

}  // namespace

Deadline::Deadline(double microseconds) noexcept {
  if (!std::isfinite(microseconds) || microseconds <= 0) return;
  deadline_ = microseconds;
  budget_ = std::clamp(kFirst * microseconds, kLeast, kMost);
  cost_ = kAim * deadline_ / budget_;
}

void Deadline::limit(PenetrationSettings& settings) const noexcept {
  if (deadline_ == 0) return;
  settings.pair_budget = static_cast<std::uint32_t>(budget_);
  settings.spheres_only = true;
}

void Deadline::record(const Penetration& answer, double microseconds) noexcept {
  if (deadline_ == 0 || std::isnan(answer.volume)) return;
  if (!std::isfinite(microseconds) || microseconds <= 0) return;
  const bool apart = !(answer.volume > 0);
  const double pairs = answer.sphere_pairs;
  if (!apart) {
    const bool slow = microseconds > deadline_ && budget_ <= kHigh * kLeast;
    slow_ += ((slow ? 1 : 0) - slow_) / kSlowQueries;
    // The time of a small contact does not predict that of a full budget, unless it is late.
    if (2 * pairs >= budget_ || microseconds > deadline_) {
      const double step = std::max(kLastStep, kFirstStep * kHalved / (kHalved + samples_));
      if (samples_ < ~0u) ++samples_;
      const double cost = microseconds / std::min(pairs, budget_);
      cost_ *= cost > cost_ ? 1 + kPercentile * step : 1 - (1 - kPercentile) * step;
    }
  }
  const double wanted = std::clamp(kAim * deadline_ / cost_, kLeast, kMost);
  if (budget_ >= kLow * wanted && budget_ <= kHigh * wanted) return;
  budget_ = apart ? wanted : std::clamp(wanted, (1 - kFall) * budget_, (1 + kRise) * budget_);
}

bool Deadline::too_slow() const noexcept { return slow_ > kSlow; }

}  // namespace ist
