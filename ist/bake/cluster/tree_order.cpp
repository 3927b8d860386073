#include "bake/cluster/tree_builder.h"

#include <ist/asset_layout.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <numeric>
#include <utility>

#include "bake/cluster/gas_kernel.h"

namespace ist {
namespace {

constexpr std::size_t kNeighbours = 8;  ///< groups with which a group may exchange members
constexpr int kMaxRounds = 40;
/// s, relative to the mean radius of the groups' balls before any swap.
constexpr double kReach = 0.25;
constexpr double kLeastGain = 1e-4;  ///< relative to the two groups' cost; smaller ones are noise

/// Two groups, and the best current swap between them.
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
      // No other pair gains: each was swapped, or lost against a neighbour that was.
      gaining.clear();
      for (const std::uint32_t p : stale)
        if (pairs_[p].swap.gain > 0) gaining.push_back(p);
      if (gaining.empty()) return;
      std::sort(gaining.begin(), gaining.end(), [&](std::uint32_t p, std::uint32_t q) {
        const double of_p = pairs_[p].swap.gain, of_q = pairs_[q].swap.gain;
        return of_p != of_q ? of_p > of_q : p < q;
      });
      // Takes the best swap of each group; the next round finds the blocked ones again.
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

  /// The member of the group that stays.
  std::size_t pinned(std::uint32_t g) const {
    const bool holds_last = std::size_t{g} + 1 == groups_.size();
    return last_stays_ && holds_last ? groups_[g].members.count - 1 : kNoMember;
  }

  void find_pairs() {
    // Sorted along x, so that groups further away in x alone are skipped.
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

/// Swaps balls between neighbouring groups of 16 consecutive entries of `order` while that shrinks
/// Σ (R + s)³ over the groups' bounding balls; s stands for the size of the query's partner. The
/// last entry stays if `last_stays`. Deterministic for any number of threads.
void improve_groups(std::span<const Ball> balls, bool last_stays,
                    std::vector<std::uint32_t>& order) {
  if (order.size() > kWidth) GroupSwaps(balls, last_stays, order).run();
}

constexpr int kEpochs = 24;
constexpr int kSweeps = 20;
constexpr std::size_t kPart = 256;  // balls that one thread takes

/// Calls work(first, count) for parts of fixed size, whatever the number of threads.
template <class Work>
void in_parts(std::size_t size, const Work& work) {
  const auto part = [&](std::size_t k) { work(k * kPart, std::min(kPart, size - k * kPart)); };
  const std::size_t parts = (size + kPart - 1) / kPart;
  if (parts == 1)
    part(0);
  else
    tbb::parallel_for(std::size_t{0}, parts, part);
}

/// Distributes a range of sorted balls evenly among prototypes. First, in the prototypes' order,
/// each takes the nearest balls up to the group's size; then two groups at a time redistribute
/// theirs, each ball to its preferred prototype, until nothing moves. Σ distance² falls every time.
class EvenShares {
 public:
  EvenShares(std::span<const Ball> balls, std::span<std::uint32_t> range, const Prototypes& at,
             std::size_t unit)
      : range_(range), unit_(unit), groups_(at.count), distances2_(range.size()) {
    in_parts(range.size(), [&](std::size_t first, std::size_t count) {
      measure_all(balls, range.subspan(first, count), at, &distances2_[first]);
    });
    order_.resize(range.size());
    std::iota(order_.begin(), order_.end(), 0u);
  }

  /// Makes groups of `unit` one after the other, each sorted.
  void run() {
    fill_in_turn();
    for (std::size_t p = 0; p < groups_; ++p)
      leads_[p] = least_leads(distances2_.data(), group(p), p);
    std::array<int, kWidth> changed{};  // the sweep that last moved a ball of the group
    for (int sweep = 1; sweep <= kSweeps; ++sweep) {
      // Round robin: every two groups meet once a sweep, one partner a turn.
      const std::size_t seats = groups_ + groups_ % 2;
      for (std::size_t turn = 0; turn + 1 < seats; ++turn)
        for (std::size_t k = 0; k < seats / 2; ++k) {
          const std::size_t a = k == 0 ? seats - 1 : (turn + k) % (seats - 1);
          const std::size_t b = (turn + seats - 1 - k) % (seats - 1);
          const std::size_t p = std::min(a, b), q = std::max(a, b);
          if (q < groups_ && share(p, q)) changed[p] = changed[q] = sweep;
        }
      if (*std::max_element(changed.begin(), changed.end()) < sweep) break;
    }
    // Membership is settled; the order within a group was arbitrary until now.
    std::vector<std::uint8_t> group_of(order_.size());
    for (std::size_t p = 0; p < groups_; ++p)
      for (const std::uint32_t i : group(p)) group_of[i] = static_cast<std::uint8_t>(p);
    std::array<std::size_t, kWidth> next;
    for (std::size_t p = 0; p < kWidth; ++p) next[p] = p * unit_;
    const std::vector<std::uint32_t> balls(range_.begin(), range_.end());
    for (std::size_t i = 0; i < balls.size(); ++i) range_[next[group_of[i]]++] = balls[i];
  }

 private:
  /// A ball by its index in the range, and its sort key.
  struct Entry {
    double key;
    std::uint32_t ball;
    bool operator<(const Entry& other) const {
      return key != other.key ? key < other.key : ball < other.ball;
    }
  };

  std::span<std::uint32_t> group(std::size_t p) {
    const std::size_t begin = std::min(p * unit_, order_.size());
    return std::span(order_).subspan(begin, std::min(unit_, order_.size() - begin));
  }

  void fill_in_turn() {
    std::vector<Entry> rest;
    for (std::size_t p = 0; p + 1 < groups_; ++p) {
      const auto left = std::span(order_).subspan(p * unit_);
      if (left.size() <= unit_) return;
      rest.clear();
      for (const std::uint32_t i : left) rest.push_back({distances2_[i][p], i});
      std::nth_element(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(unit_), rest.end());
      for (std::size_t i = 0; i < rest.size(); ++i) left[i] = rest[i].ball;
    }
  }

  /// Redistributes the balls of groups p and q. False: nothing changes.
  bool share(std::size_t p, std::size_t q) {
    if (-leads_[p][q] < leads_[q][p]) return false;
    const auto first = group(p), second = group(q);
    if (first.empty() || second.empty()) return false;
    // Balls nearer to p's prototype come first.
    pool_.clear();
    for (const auto& part : {first, second})
      for (const std::uint32_t i : part)
        pool_.push_back({distances2_[i][p] - distances2_[i][q], i});
    Entry* const begin = pool_.data();
    Entry* const middle = begin + first.size();
    Entry* const end = middle + second.size();
    const Entry last = *std::max_element(begin, middle);
    const Entry foremost = *std::min_element(middle, end);
    if (last < foremost) return false;
    // Entries before all of the second half stay, as do those after all of the first.
    Entry* const unsure =
        std::partition(begin, middle, [&](const Entry& entry) { return entry < foremost; });
    Entry* const sure =
        std::partition(middle, end, [&](const Entry& entry) { return !(last < entry); });
    std::nth_element(unsure, middle, sure);
    for (std::size_t k = 0; k < first.size(); ++k) first[k] = begin[k].ball;
    for (std::size_t k = 0; k < second.size(); ++k) second[k] = middle[k].ball;
    leads_[p] = least_leads(distances2_.data(), first, p);
    leads_[q] = least_leads(distances2_.data(), second, q);
    return true;
  }

  const std::span<std::uint32_t> range_;
  const std::size_t unit_, groups_;
  std::vector<PrototypeValues> distances2_;  ///< [place in the range]
  std::vector<std::uint32_t> order_;         ///< places in the range, by group
  std::array<PrototypeValues, kWidth> leads_;
  std::vector<Entry> pool_;
};

/// Orders balls so that consecutive groups of 16, of 16², … are compact, by hierarchical batch
/// neural gas. Sixteen prototypes a node move to the mean of all balls, weighted by volume
/// (magnification control) and by a kernel over the prototype's rank as seen from the ball, while
/// the kernel narrows; then the balls are distributed evenly to the nearest prototypes. (Weller,
/// Zachmann: Inner Sphere Trees; Cottrell, Hammer et al.: Batch and median neural gas.) Only the
/// last group may be incomplete. `last_stays`: the last ball has fewer spheres and stays last.
class NeuralGas {
 public:
  NeuralGas(std::span<const Ball> balls, bool last_stays) : balls_(balls), last_stays_(last_stays) {
    order_.resize(balls.size());
    std::iota(order_.begin(), order_.end(), 0u);
    split(0, order_.size());
  }

  std::vector<std::uint32_t> take() { return std::move(order_); }

 private:
  void split(std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    if (count <= kWidth) return;
    std::size_t unit = kWidth;
    while (unit * kWidth < count) unit *= kWidth;
    const auto range = std::span(order_).subspan(begin, count);
    assign(range, prototypes(range, (count + unit - 1) / unit), unit,
           last_stays_ && end == order_.size());
    if (unit == kWidth) return;
    tbb::parallel_for(std::size_t{0}, (count + unit - 1) / unit, [&](std::size_t p) {
      split(begin + p * unit, std::min(begin + (p + 1) * unit, end));
    });
  }

  Prototypes prototypes(std::span<const std::uint32_t> range, std::size_t count) const {
    Prototypes at;  // start at balls spread over the sorted range
    at.count = count;
    for (std::size_t p = 0; p < count; ++p) {
      const Ball& ball = balls_[range[(2 * p + 1) * range.size() / (2 * count)]];
      at.x[p] = ball.x, at.y[p] = ball.y, at.z[p] = ball.z;
    }
    // In parts of fixed size, added in order: the same bits for any number of threads.
    std::vector<GasPull> pulls((range.size() + kPart - 1) / kPart);
    // The neighbourhood range λ falls from half the prototypes towards zero, where this is plain
    // k-means. The kernel q^rank with q = λ / (1 + λ) replaces exp(−rank / λ): it takes five
    // operations.
    double lambda = static_cast<double>(count) / 2;
    for (int epoch = 0; epoch < kEpochs; ++epoch, lambda *= 0.75) {
      PrototypeValues kernel{};
      kernel[0] = 1;
      for (std::size_t k = 1; k < count; ++k) kernel[k] = kernel[k - 1] * (lambda / (1 + lambda));
      in_parts(range.size(), [&](std::size_t first, std::size_t size) {
        pulls[first / kPart] = pull_of(balls_, range.subspan(first, size), at, kernel);
      });
      for (std::size_t p = 0; p < count; ++p) {
        double x = 0, y = 0, z = 0, total = 0;
        for (const GasPull& part : pulls) {
          x += part.x[p];
          y += part.y[p];
          z += part.z[p];
          total += part.total[p];
        }
        if (total > 0) at.x[p] = x / total, at.y[p] = y / total, at.z[p] = z / total;
      }
    }
    return at;
  }

  /// Sorts `range` into groups of `unit` and an incomplete last one; `pinned`: the last ball stays
  /// last.
  void assign(std::span<std::uint32_t> range, const Prototypes& prototypes, std::size_t unit,
              bool pinned) const {
    Prototypes at = prototypes;
    if (pinned) {
      PrototypeValues distance2;
      measure_all(balls_, range.last(1), at, &distance2);
      const auto nearest = static_cast<std::size_t>(
          std::min_element(distance2.begin(), distance2.end()) - distance2.begin());
      for (PrototypeValues* const values : {&at.x, &at.y, &at.z})
        std::swap((*values)[nearest], (*values)[at.count - 1]);
    }
    EvenShares(balls_, range.first(range.size() - pinned), at, unit).run();
  }

  std::span<const Ball> balls_;
  bool last_stays_;
  std::vector<std::uint32_t> order_;
};

/// Balls around each 16 consecutive entries of `order`.
std::vector<Ball> group_balls(std::span<const Ball> balls, std::span<const std::uint32_t> order) {
  std::vector<Ball> groups((order.size() + kWidth - 1) / kWidth);
  tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    std::vector<Ball> members;
    for (std::size_t i = g * kWidth; i < std::min((g + 1) * kWidth, order.size()); ++i)
      members.push_back(balls[order[i]]);
    groups[g] = bounding_ball(members);
  });
  return groups;
}

/// Orders the consecutive groups of 16 of `order`: groups of their balls, and so on.
std::vector<std::uint32_t> order_groups(std::span<const Ball> balls,
                                        std::vector<std::uint32_t> order, bool last_stays,
                                        bool swaps) {
  if (order.size() <= std::size_t{kWidth} * kWidth) return order;
  // An incomplete group comes last, and so does any that contains one.
  const std::vector<std::uint32_t> groups =
      tree_order(group_balls(balls, order), swaps, last_stays || order.size() % kWidth != 0);
  std::vector<std::uint32_t> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t g : groups)
    for (std::size_t i = std::size_t{g} * kWidth;
         i < std::min<std::size_t>((std::size_t{g} + 1) * kWidth, order.size()); ++i)
      sorted.push_back(order[i]);
  return sorted;
}

}  // namespace

std::vector<std::uint32_t> tree_order(std::span<const Ball> spheres, bool swaps, bool last_stays) {
  std::vector<std::uint32_t> order = NeuralGas(spheres, last_stays).take();
  if (swaps) improve_groups(spheres, last_stays, order);
  return order_groups(spheres, std::move(order), last_stays, swaps);
}

std::vector<std::uint32_t> refined_order(std::span<const Ball> spheres,
                                         std::vector<std::uint32_t> order) {
  improve_groups(spheres, false, order);
  return order_groups(spheres, std::move(order), false, true);
}

}  // namespace ist
