#include "packing/selection.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

namespace ist::packing {
namespace {

std::uint64_t mixed(std::uint64_t x) {  // the finaliser of SplitMix64
  x ^= x >> 30;
  x *= 0xBF58476D1CE4E5B9ull;
  x ^= x >> 27;
  x *= 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

bool overlap(const Candidate& a, const Candidate& b) {
  const double x = double{a.centre.x} - double{b.centre.x};
  const double y = double{a.centre.y} - double{b.centre.y};
  const double z = double{a.centre.z} - double{b.centre.z};
  const double r = double{a.radius} + double{b.radius};
  return x * x + y * y + z * z < r * r;
}

/// Candidates sorted into cubes as wide as two of them can overlap.
class Buckets {
 public:
  explicit Buckets(const std::vector<Candidate>& candidates) : candidates_(candidates) {
    float largest = 0;
    for (const Candidate& c : candidates) largest = std::max(largest, c.radius);
    const float width = std::max(2.0001f * largest, 1.0f / 512);
    inverse_width_ = 1 / width;
    while (mask_ + 1 < 2 * candidates.size()) mask_ = 2 * mask_ + 1;
    start_.assign(mask_ + 2, 0);
    std::vector<std::uint32_t> bucket(candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      bucket[i] = bucket_of(cell_of(candidates[i].centre, 0, 0, 0));
      ++start_[bucket[i] + 1];
    }
    for (std::size_t b = 0; b <= mask_; ++b) start_[b + 1] += start_[b];
    std::vector<std::uint32_t> fill(start_.begin(), start_.end() - 1);
    members_.resize(candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i)
      members_[fill[bucket[i]]++] = static_cast<std::uint32_t>(i);
  }

  bool dominated(std::size_t i) const {
    const Candidate& a = candidates_[i];
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          const std::uint32_t b = bucket_of(cell_of(a.centre, dx, dy, dz));
          for (std::uint32_t m = start_[b]; m < start_[b + 1]; ++m) {
            const Candidate& other = candidates_[members_[m]];
            const bool larger = other.key > a.key || (other.key == a.key && members_[m] < i);
            if (larger && overlap(a, other)) return true;
          }
        }
    return false;
  }

 private:
  std::uint64_t cell_of(Float3 p, int dx, int dy, int dz) const {
    const auto index = [&](float x, int d) {
      return static_cast<std::uint64_t>(
                 static_cast<std::int64_t>(std::floor((x + 4) * inverse_width_)) + d) &
             0x1FFFFF;
    };
    return index(p.x, dx) | index(p.y, dy) << 21 | index(p.z, dz) << 42;
  }
  std::uint32_t bucket_of(std::uint64_t cell) const {
    return static_cast<std::uint32_t>(mixed(cell) & mask_);
  }

  const std::vector<Candidate>& candidates_;
  float inverse_width_ = 1;
  std::size_t mask_ = 63;
  std::vector<std::uint32_t> start_, members_;
};

}  // namespace

std::uint64_t candidate_key(float radius, Float3 cell_centre, std::uint64_t seed) {
  const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x)}; };
  std::uint64_t hash = mixed(seed + 0x9E3779B97F4A7C15ull);
  hash = mixed(hash ^ (bits(cell_centre.x) | bits(cell_centre.y) << 32));
  hash = mixed(hash ^ bits(cell_centre.z));
  return bits(radius) << 32 | hash >> 32;  // positive floats order like their bits
}

std::vector<std::uint32_t> select_independent(const std::vector<Candidate>& candidates) {
  const Buckets buckets(candidates);
  std::vector<std::uint8_t> wins(candidates.size());
  oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, candidates.size(), 64),
                            [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t i = range.begin(); i != range.end(); ++i)
                                wins[i] = !buckets.dominated(i);
                            });
  std::vector<std::uint32_t> winners;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (wins[i]) winners.push_back(static_cast<std::uint32_t>(i));
  std::sort(winners.begin(), winners.end(), [&](std::uint32_t a, std::uint32_t b) {
    return candidates[a].key != candidates[b].key ? candidates[a].key > candidates[b].key : a < b;
  });
  return winners;
}

}  // namespace ist::packing
