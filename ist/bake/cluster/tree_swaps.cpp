#include "bake/cluster/tree_swaps.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <ist/asset_layout.h>

namespace ist {
namespace {

constexpr std::size_t kNeighbours = 8;  ///< groups that a group may trade with
constexpr int kMaxRounds = 40;
/// s, relative to the mean radius of the groups' balls before any swap.
constexpr double kReach = 0.25;
constexpr double kLeastGain = 1e-4;  ///< relative to the two groups' cost; smaller ones are noise

struct Swap {
  double gain = 0;
  std::uint32_t a = 0, b = 0;  ///< groups
  std::uint32_t s = 0, t = 0;  ///< entries of a and of b
};

struct Group {
  std::vector<Ball> members;
  double x[kWidth] = {}, y[kWidth] = {}, z[kWidth] = {}, r[kWidth] = {};  ///< of the members
  Ball ball;
  std::vector<Ball> without;  ///< bounding ball without each member
  double least_radius = 0;    ///< of `without`
};

/// Lower bounds of a group's radius once a ball joins it in place of a member.
struct Fit {
  double farthest = 0;  ///< half of the way across the ball and the member it is farthest from
  double next = 0;      ///< and the member after that
  std::size_t member = 0;

  Fit(const Group& group, const Ball& added) {
    double radius[kWidth];
    for (std::size_t i = 0; i < kWidth; ++i)
      radius[i] =
          (reach(added.x, added.y, added.z, {group.x[i], group.y[i], group.z[i], group.r[i]}) +
           added.r) /
          2;
    for (std::size_t i = 0; i < group.members.size(); ++i) {
      if (radius[i] > farthest) {
        next = farthest;
        farthest = radius[i];
        member = i;
      } else if (radius[i] > next) {
        next = radius[i];
      }
    }
  }

  double least_radius(const Group& group, std::size_t left_out) const {
    const double across = left_out == member ? next : farthest;
    const double rest = group.without[left_out].r;
    return across > rest ? across : rest;
  }
};

class GroupSwaps {
 public:
  GroupSwaps(std::span<const Ball> balls, bool last_stays, std::vector<std::uint32_t>& order)
      : balls_(balls),
        last_stays_(last_stays),
        order_(order),
        groups_((order.size() + kWidth - 1) / kWidth) {
    tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t g) { refresh(g); });
    double sum = 0;
    for (const Group& group : groups_) sum += group.ball.r;
    reach_ = kReach * sum / static_cast<double>(groups_.size());
  }

  void run() {
    find_pairs();
    std::vector<char> changed(groups_.size(), 1);
    for (int round = 0; round < kMaxRounds; ++round) {
      std::vector<Swap> swaps(pairs_.size());
      tbb::parallel_for(std::size_t{0}, pairs_.size(), [&](std::size_t p) {
        const auto [a, b] = pairs_[p];
        if (changed[a] != 0 || changed[b] != 0) swaps[p] = best_swap(a, b);
      });
      std::erase_if(swaps, [](const Swap& swap) { return swap.gain <= 0; });
      if (swaps.empty()) return;
      std::sort(swaps.begin(), swaps.end(), [](const Swap& x, const Swap& y) {
        if (x.gain != y.gain) return x.gain > y.gain;
        return x.a != y.a ? x.a < y.a : x.b < y.b;
      });
      // The best swap of each group; what it blocks is found again in the next round.
      std::vector<char> touched(groups_.size(), 0);
      std::vector<char> retry(groups_.size(), 0);
      for (const Swap& swap : swaps) {
        if (touched[swap.a] != 0 || touched[swap.b] != 0) {
          retry[swap.a] = retry[swap.b] = 1;
          continue;
        }
        touched[swap.a] = touched[swap.b] = 1;
        std::swap(order_[swap.a * kWidth + swap.s], order_[swap.b * kWidth + swap.t]);
      }
      tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t g) {
        if (touched[g] != 0) refresh(g);
      });
      for (std::size_t g = 0; g < groups_.size(); ++g)
        changed[g] = touched[g] != 0 || retry[g] != 0;
    }
  }

 private:
  double cost(double radius) const {
    const double r = radius + reach_;
    return r * r * r;
  }

  void refresh(std::size_t g) {
    Group& group = groups_[g];
    fill(group, g);
    group.least_radius = group.ball.r;
    for (const Ball& ball : group.without)
      group.least_radius = std::min(group.least_radius, ball.r);
  }

  void fill(Group& group, std::size_t g) const {
    group.members.clear();
    const std::size_t end = std::min(order_.size(), (g + 1) * kWidth);
    for (std::size_t i = g * kWidth; i < end; ++i) {
      const Ball& ball = balls_[order_[i]];
      const std::size_t lane = group.members.size();
      group.members.push_back(ball);
      group.x[lane] = ball.x, group.y[lane] = ball.y, group.z[lane] = ball.z,
      group.r[lane] = ball.r;
    }
    group.ball = bounding_ball(group.members);
    group.without.assign(group.members.size(), group.ball);
    if (group.members.size() == 1) group.without[0].r = 0;
    if (group.members.size() < 2) return;
    for (std::size_t i = 0; i < group.members.size(); ++i) {
      // Only a ball that touches the bounding ball from inside holds it at its size.
      if (reach(group.ball.x, group.ball.y, group.ball.z, group.members[i]) <
          group.ball.r * (1 - 1e-9))
        continue;
      std::vector<Ball> rest = group.members;
      rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(i));
      group.without[i] = bounding_ball(rest);
    }
  }

  bool pinned(std::uint32_t g, std::size_t member) const {
    return last_stays_ && g * kWidth + member + 1 == order_.size();
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
    for (const Group& group : groups_) largest = std::max(largest, group.ball.r);
    const std::size_t count = std::min(kNeighbours, groups_.size() - 1);
    using Near = std::pair<double, std::uint32_t>;
    std::vector<std::vector<Near>> found(groups_.size());
    tbb::parallel_for(std::size_t{0}, groups_.size(), [&](std::size_t k) {
      std::vector<Near>& near = found[k];
      const Ball& ball = groups_[along[k]].ball;
      const auto look = [&](std::size_t at) {
        const Ball& other = groups_[along[at]].ball;
        const Near here = {reach(ball.x, ball.y, ball.z, other) - 2 * other.r, along[at]};
        if (near.size() == count) {
          if (!(here < near.back())) return;
          near.pop_back();
        }
        near.insert(std::upper_bound(near.begin(), near.end(), here), here);
      };
      const auto beyond = [&](double away) {
        return near.size() == count && away - largest > near.back().first + 1e-9;
      };
      for (std::size_t at = k; at-- > 0 && !beyond(x(k) - x(at));) look(at);
      for (std::size_t at = k + 1; at < along.size() && !beyond(x(at) - x(k)); ++at) look(at);
    });
    for (std::size_t k = 0; k < found.size(); ++k)
      for (const Near& near : found[k])
        pairs_.emplace_back(std::min(along[k], near.second), std::max(along[k], near.second));
    std::sort(pairs_.begin(), pairs_.end());
    pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  }

  static double radius_with(const Group& group, std::size_t left_out, const Ball& added) {
    const Ball& rest = group.without[left_out];
    if (reach(rest.x, rest.y, rest.z, added) <= rest.r) return rest.r;
    std::vector<Ball> members = group.members;
    members[left_out] = added;
    return bounding_ball(members).r;
  }

  Swap best_swap(std::uint32_t a, std::uint32_t b) const {
    const Group& ga = groups_[a];
    const Group& gb = groups_[b];
    const double now = cost(ga.ball.r) + cost(gb.ball.r);
    Swap best;
    best.gain = kLeastGain * now;
    const double least_cost_b = cost(gb.least_radius);
    if (now - cost(ga.least_radius) - least_cost_b <= best.gain) return {};
    bool found = false;
    double without_b[kWidth] = {};
    for (std::size_t t = 0; t < gb.members.size(); ++t) without_b[t] = cost(gb.without[t].r);
    std::optional<Fit> into_a[kWidth];
    for (std::uint32_t s = 0; s < ga.members.size(); ++s) {
      const double without_a = cost(ga.without[s].r);
      if (pinned(a, s) || now - without_a - least_cost_b <= best.gain) continue;
      const Fit into_b(gb, ga.members[s]);
      for (std::uint32_t t = 0; t < gb.members.size(); ++t) {
        if (pinned(b, t) || now - without_a - without_b[t] <= best.gain) continue;
        const double least_b = cost(into_b.least_radius(gb, t));
        if (now - without_a - least_b <= best.gain) continue;
        if (!into_a[t]) into_a[t].emplace(ga, gb.members[t]);
        const double least_a = cost(into_a[t]->least_radius(ga, s));
        if (now - least_a - least_b <= best.gain) continue;
        const double cost_a = cost(radius_with(ga, s, gb.members[t]));
        if (now - cost_a - least_b <= best.gain) continue;
        const double gain = now - cost_a - cost(radius_with(gb, t, ga.members[s]));
        if (gain <= best.gain) continue;
        best = {gain, a, b, s, t};
        found = true;
      }
    }
    return found ? best : Swap{};
  }

  std::span<const Ball> balls_;
  bool last_stays_;
  std::vector<std::uint32_t>& order_;
  std::vector<Group> groups_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
  double reach_ = 0;
};

}  // namespace

void improve_groups(std::span<const Ball> balls, bool last_stays,
                    std::vector<std::uint32_t>& order) {
  if (order.size() > kWidth) GroupSwaps(balls, last_stays, order).run();
}

}  // namespace ist
