#include "bake/cluster/tree_swaps.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include <ist/asset_layout.h>
#include "bake/cluster/swap_kernel.h"

namespace ist {
namespace {

constexpr std::size_t kNeighbours = 8;  ///< groups that a group may trade with
constexpr int kMaxRounds = 40;
/// s, relative to the mean radius of the groups' balls before any swap.
constexpr double kReach = 0.25;
constexpr double kLeastGain = 1e-4;  ///< relative to the two groups' cost; smaller ones are noise

/// Two groups, and the best swap between them as they are now.
struct Pair {
  std::uint32_t a = 0, b = 0;
  MemberSwap swap = {};
};

class GroupSwaps {
 public:
  GroupSwaps(std::span<const Ball> balls, bool last_stays, std::vector<std::uint32_t>& order)
      : balls_(balls),
        last_stays_(last_stays),
        order_(order),
        groups_((order.size() + kWidth - 1) / kWidth) {
    tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t g) { measure(g); });
    double sum = 0;
    for (const SwapGroup& group : groups_) sum += group.ball.r;
    reach_ = kReach * sum / static_cast<double>(groups_.size());
  }

  void run() {
    find_pairs();
    std::vector<char> touched(groups_.size(), 1);
    std::vector<std::uint32_t> stale, gaining, of_round;
    for (int round = 0; round < kMaxRounds; ++round) {
      stale.clear();
      for (std::uint32_t p = 0; p < pairs_.size(); ++p)
        if (touched[pairs_[p].a] != 0 || touched[pairs_[p].b] != 0) stale.push_back(p);
      tbb::parallel_for(std::size_t{0}, stale.size(), [&](std::size_t i) {
        Pair& pair = pairs_[stale[i]];
        pair.swap = best_swap(groups_[pair.a], groups_[pair.b], reach_, kLeastGain, pinned(pair.a),
                              pinned(pair.b));
      });
      // Of the others none gains: each was carried out, or lost against one that touched it.
      gaining.clear();
      for (const std::uint32_t p : stale)
        if (pairs_[p].swap.gain > 0) gaining.push_back(p);
      if (gaining.empty()) return;
      std::sort(gaining.begin(), gaining.end(), [&](std::uint32_t p, std::uint32_t q) {
        const double of_p = pairs_[p].swap.gain, of_q = pairs_[q].swap.gain;
        return of_p != of_q ? of_p > of_q : p < q;
      });
      // The best swap of each group; what it blocks is found again in the next round.
      std::fill(touched.begin(), touched.end(), 0);
      of_round.clear();
      for (const std::uint32_t p : gaining) {
        const auto& [a, b, swap] = pairs_[p];
        if (touched[a] != 0 || touched[b] != 0) continue;
        touched[a] = touched[b] = 1;
        std::swap(order_[a * kWidth + swap.s], order_[b * kWidth + swap.t]);
        of_round.insert(of_round.end(), {a, b});
      }
      tbb::parallel_for(std::size_t{0}, of_round.size(),
                        [&](std::size_t i) { measure(of_round[i]); });
    }
  }

 private:
  void measure(std::size_t g) {
    BallLanes& members = groups_[g].members;
    const std::size_t begin = g * kWidth;
    const std::size_t count = std::min<std::size_t>(kWidth, order_.size() - begin);
    for (std::size_t i = 0; i < count; ++i) members.put(i, balls_[order_[begin + i]]);
    members.close(count);
    measure_group(groups_[g]);
  }

  /// Which of the group's members stays.
  std::size_t pinned(std::uint32_t g) const {
    const bool holds_last = std::size_t{g} + 1 == groups_.size();
    return last_stays_ && holds_last ? groups_[g].members.count - 1 : kNoMember;
  }

  void find_pairs() {
    // Along x: what is further away in x alone need not be looked at.
    std::vector<std::uint32_t> along(groups_.size());
    std::iota(along.begin(), along.end(), 0u);
    const auto x = [&](std::size_t k) { return groups_[along[k]].ball.x; };
    std::sort(along.begin(), along.end(), [&](std::uint32_t g, std::uint32_t h) {
      const double xg = groups_[g].ball.x, xh = groups_[h].ball.x;
      return xg != xh ? xg < xh : g < h;
    });
    double largest = 0;
    for (const SwapGroup& group : groups_) largest = std::max(largest, group.ball.r);
    const std::size_t count = std::min(kNeighbours, groups_.size() - 1);
    using Near = std::pair<double, std::uint32_t>;
    std::vector<std::uint64_t> found(groups_.size() * count);
    tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t k) {
      std::array<Near, kNeighbours> near;
      std::size_t size = 0;
      const Ball& ball = groups_[along[k]].ball;
      const auto look = [&](std::size_t at) {
        const Ball& other = groups_[along[at]].ball;
        const Near here = {reach(ball.x, ball.y, ball.z, other) - 2 * other.r, along[at]};
        if (size == count && !(here < near[size - 1])) return;
        size = std::min(size + 1, count);
        std::size_t place = size - 1;
        for (; place > 0 && here < near[place - 1]; --place) near[place] = near[place - 1];
        near[place] = here;
      };
      const auto beyond = [&](double away) {
        return size == count && away - largest > near[size - 1].first + 1e-9;
      };
      for (std::size_t at = k; at-- > 0 && !beyond(x(k) - x(at));) look(at);
      for (std::size_t at = k + 1; at < along.size() && !beyond(x(at) - x(k)); ++at) look(at);
      for (std::size_t i = 0; i < count; ++i)
        found[k * count + i] = std::uint64_t{std::min(along[k], near[i].second)} << 32 |
                               std::max(along[k], near[i].second);
    });
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    pairs_.reserve(found.size());
    for (const std::uint64_t key : found)
      pairs_.push_back({static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)});
  }

  std::span<const Ball> balls_;
  bool last_stays_;
  std::vector<std::uint32_t>& order_;
  std::vector<SwapGroup> groups_;
  std::vector<Pair> pairs_;
  double reach_ = 0;
};

}  // namespace

void improve_groups(std::span<const Ball> balls, bool last_stays,
                    std::vector<std::uint32_t>& order) {
  if (order.size() > kWidth) GroupSwaps(balls, last_stays, order).run();
}

}  // namespace ist
