#include <algorithm>

#include "base/thread_arena.h"
#include "mesh/connectivity/item_groups.h"
#include "packing/banded/candidate.h"
#include "packing/base/certificate.h"

namespace ist::packing {
namespace {

class Buckets {
 public:
  explicit Buckets(const std::vector<Candidate>& candidates) : candidates_(candidates) {
    float largest = 0;
    for (const Candidate& c : candidates) largest = std::max(largest, c.radius);
    buckets_ = candidate_buckets(largest, candidates.size());
    members_ = ItemGroups<>(std::size_t{buckets_.mask} + 1, [&](const auto& visit) {
      for (std::size_t i = 0; i < candidates.size(); ++i)
        visit(buckets_.bucket_of(candidates[i].centre, 0, 0, 0), static_cast<std::uint32_t>(i));
    });
  }

  /// Calls visit(other) for candidates about the i-th, itself included, until it returns true.
  template <class Visit>
  bool any_near(std::size_t i, Visit&& visit) const {
    const Candidate& a = candidates_[i];
    for (int dz = -1; dz <= 1; ++dz)
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          for (const std::uint32_t m : members_[buckets_.bucket_of(a.centre, dx, dy, dz)])
            if (visit(m)) return true;
        }
    return false;
  }

  bool dominated(std::size_t i) const {
    const Candidate& a = candidates_[i];
    return any_near(i, [&](std::uint32_t m) {
      return goes_before(candidates_[m], a) && overlap(a, candidates_[m]);
    });
  }

 private:
  const std::vector<Candidate>& candidates_;
  CandidateBuckets buckets_;
  ItemGroups<> members_;
};

}  // namespace

std::vector<Winner> select_independent(const std::vector<Candidate>& candidates) {
  const Buckets buckets(candidates);
  std::vector<std::uint8_t> wins(candidates.size());
  for_each_index(0, candidates.size(), 64, [&](std::size_t i) { wins[i] = !buckets.dominated(i); });
  std::vector<Winner> winners;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (wins[i]) winners.push_back({static_cast<std::uint32_t>(i)});
  std::sort(winners.begin(), winners.end(), [&](const Winner& a, const Winner& b) {
    return goes_before(candidates[a.index], candidates[b.index]);
  });
  for_each_index(0, winners.size(), 64, [&](std::size_t i) {
    const Candidate& a = candidates[winners[i].index];
    winners[i].gap = a.radius;
    buckets.any_near(winners[i].index, [&](std::uint32_t m) {
      const Candidate& b = candidates[m];
      if (wins[m] && goes_before(b, a))
        winners[i].gap =
            std::min(winners[i].gap,
                     gap_to_sphere(a.centre, {b.centre.x, b.centre.y, b.centre.z, b.radius}));
      return false;
    });
  });
  return winners;
}

}  // namespace ist::packing
