#include "query/exact/kept_pairs.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace ist {
namespace {

/// A bound of the motion of B's points from one placement in A to the other.
double largest_motion(const MeshTree& b, const Similarity& from, const Similarity& to) {
  double squared = 0;
  for (int corner = 0; corner < 8; ++corner) {
    double sum = 0;
    for (int i = 0; i < 3; ++i) {
      double moved = to.t[i] - from.t[i];
      for (int k = 0; k < 3; ++k)
        moved += (to.m[3 * i + k] - from.m[3 * i + k]) *
                 double{(corner >> k & 1) != 0 ? b.high[k] : b.low[k]};
      sum += moved * moved;
    }
    squared = std::max(squared, sum);
  }
  return std::sqrt(squared);
}

/// The side of a triangle if triangles tiled a cube.
double side_of(const MeshTree& a, const MeshTree& b, double scale) {
  return 0.5 * std::min(1 / std::sqrt(a.level[0].count), scale / std::sqrt(b.level[0].count));
}

// Margins relative to such a side.
constexpr double kLeastMargin = 0.007, kMostMargin = 0.3;
// The number of steps that a margin allows for. More steps keep more pairs and need fewer searches.
constexpr double kMostSteps = 3, kLeastSteps = 1.5;

}  // namespace

bool is_short(double step, const MeshTree& a, const MeshTree& b, double scale,
              double distance) noexcept {
  return step < std::max(kMostMargin * side_of(a, b, scale), 0.25 * distance);
}

KeptRing::KeptRing(std::size_t capacity, const MemoryHooks& hooks)
    : mask_(std::bit_floor(capacity) - 1),
      ring_(hooked_array<std::uint64_t>(hooks, static_cast<std::size_t>(most()))),
      ids_(hooked_array<std::uint32_t>(hooks, kSlots)),
      slots_(hooked_array<KeptPairs>(hooks, kSlots)) {
  std::fill_n(ids_.get(), kSlots, 0);
}

KeptPairs& KeptRing::of(std::uint32_t id, const MeshTree& a, const MeshTree& b,
                        const Similarity& pose) noexcept {
  const std::uint32_t slot = id * 2654435769u >> (32 - std::countr_zero(kSlots));
  KeptPairs& kept = slots_[slot];
  if (ids_[slot] != id || kept.mesh[0] != a.hash || kept.mesh[1] != b.hash ||
      kept.last.scale != pose.scale)
    kept = {{a.hash, b.hash}, pose, HUGE_VAL, 0, kMostSteps, pose, 0, 0, 0, 0, 0};
  else
    kept.gone += kept.step = largest_motion(b, kept.last, pose);
  kept.last = pose;
  ids_[slot] = id;
  return kept;
}

bool KeptRing::holds(KeptPairs& kept, const MeshTree& b) const noexcept {
  if (!(kept.margin > 0) || written_ - kept.first > mask_) return false;
  kept.moved = largest_motion(b, kept.found_at, kept.last);
  return true;
}

bool KeptRing::serves(KeptPairs& kept, const MeshTree& b, double tolerance) const noexcept {
  return holds(kept, b) && kept.moved + std::max(0.0, tolerance - kept.tolerance) < kept.margin;
}

void KeptRing::begin(KeptPairs& kept, const MeshTree& a, const MeshTree& b,
                     double tolerance) noexcept {
  const double side = side_of(a, b, kept.last.scale);
  kept.margin =
      std::clamp(kept.steps * kept.step, kLeastMargin * kept.steps * side, kMostMargin * side);
  if (kept.margin < kLeastSteps * kept.step) kept.margin = 0;
  kept.steps = std::min(1.1 * kept.steps, kMostSteps);
  kept.found_at = kept.last;
  kept.tolerance = tolerance;
  kept.first = written_;
  kept.count = 0;
  kept.gone = 0;
}

void KeptRing::give_up(KeptPairs& kept) noexcept {
  kept.margin = 0;
  kept.steps *= 0.5;
}

}  // namespace ist
