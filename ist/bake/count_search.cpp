#include "bake/count_search.h"

#include <algorithm>
#include <cmath>

namespace ist {
namespace {

constexpr std::size_t kFirst = 250;
constexpr std::size_t kFewest = 16;  // the fewest spheres that are tried
constexpr std::size_t kMostTrials = 8;
// Fractions of the requested error. A median over some tens of poses has an error of 10 to 20 %
// itself, hence the margin; an error below kWasteful takes more spheres than needed.
constexpr double kAim = 0.8, kWasteful = 0.6;
constexpr double kCloseEnough = 1.25;  // between a count that fails and one that does
constexpr double kApart = 1.1;         // from counts whose error is known
constexpr double kMostGrowth = 8;      // per step: an overshoot costs more than one more bake
constexpr int kFewestEighths = 5, kMostEighths = 13;  // limits of the measured power
constexpr double kLeast = 1e-12;                      // divisors are at least this

/// x^(eighths / 8) by multiplications and square roots, so that it is the same on every platform.
double power(double x, int eighths) {
  const double root = std::sqrt(std::sqrt(std::sqrt(x)));
  double result = 1;
  for (int i = 0; i < eighths; ++i) result *= root;
  return result;
}

}  // namespace

std::size_t CountSearch::first(std::size_t most) { return std::min(kFirst, most); }

/// The count at which the target error is expected, from the last two trials: the growth of the
/// count is a power of the reduction of the error.
double CountSearch::guess() const {
  const Trial& last = trials_.back();
  int eighths = 8;
  if (trials_.size() > 1) {
    const Trial& before = trials_[trials_.size() - 2];
    double growth = static_cast<double>(last.count) / static_cast<double>(before.count);
    double fall = before.error / std::max(last.error, kLeast);
    if (growth < 1) {
      growth = 1 / growth;
      fall = 1 / std::max(fall, kLeast);
    }
    eighths = kFewestEighths;
    while (eighths < kMostEighths && power(fall, eighths) < growth) ++eighths;
  }
  return static_cast<double>(last.count) *
         std::clamp(power(last.error / (kAim * error_), eighths), 1 / kMostGrowth, kMostGrowth);
}

std::optional<std::size_t> CountSearch::next(std::size_t count, double error) {
  trials_.push_back({count, error});
  if (error <= error_) {
    if (!does_ || does_->count > count) does_ = trials_.back();
  } else {
    if (!fails_ || fails_->count < count) fails_ = trials_.back();
    if (count >= most_) return std::nullopt;
  }
  if (trials_.size() >= kMostTrials) return std::nullopt;
  if (does_ && (does_->error >= kWasteful * error_ || does_->count <= kFewest)) return std::nullopt;
  if (does_ && fails_ &&
      static_cast<double>(does_->count) <= kCloseEnough * static_cast<double>(fails_->count))
    return std::nullopt;
  double low = static_cast<double>(std::min(kFewest, most_));
  double high = static_cast<double>(most_);
  if (fails_) low = std::max(low, kApart * static_cast<double>(fails_->count));
  if (does_) high = static_cast<double>(does_->count) / kApart;
  return static_cast<std::size_t>(std::clamp(guess(), std::min(low, high), high));
}

}  // namespace ist
