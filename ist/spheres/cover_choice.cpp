#include "spheres/cover_choice.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "numerics/hashing.h"
#include "spheres/point_grid.h"

namespace ist {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;
constexpr std::int64_t kStepsAPair = 20;  ///< that finding and sorting it costs

/// Which candidate holds which targets, both ways.
struct Incidence {
  std::vector<std::vector<std::uint32_t>> held;     ///< targets of a candidate
  std::vector<std::vector<std::uint32_t>> holders;  ///< candidates of a target, ascending

  Incidence(std::span<const CoverSphere> candidates, std::span<const Eigen::Vector3d> targets)
      : held(candidates.size()), holders(targets.size()) {
    const PointGrid grid(targets);
    tbb::parallel_for(std::size_t{0}, candidates.size(), [&](std::size_t j) {
      grid.within(candidates[j].centre, candidates[j].radius,
                  [&](std::uint32_t x, float) { held[j].push_back(x); });
    });
    for (std::uint32_t j = 0; j < candidates.size(); ++j) {
      for (const std::uint32_t x : held[j]) holders[x].push_back(j);
      pairs += static_cast<std::int64_t>(held[j].size());
    }
  }

  std::int64_t pairs = 0;  ///< of a candidate and a target it holds
};

/// The state of the search: what a candidate would bring, and what a chosen one would be missed
/// for.
class Choice {
 public:
  explicit Choice(const Incidence& incidence)
      : incidence_(incidence),
        weight_(incidence.holders.size(), 1),
        holders_(incidence.holders.size(), 0),
        gain_(incidence.held.size(), 0),
        loss_(incidence.held.size(), 0),
        since_(incidence.held.size(), 0),
        in_(incidence.held.size(), 0) {
    for (std::size_t j = 0; j < gain_.size(); ++j)
      gain_[j] = static_cast<std::int64_t>(incidence.held[j].size());
    place_.resize(weight_.size());
    for (std::uint32_t x = 0; x < place_.size(); ++x)
      if (!incidence.holders[x].empty()) reopen(x);
  }

  const std::vector<std::uint32_t>& chosen() const { return chosen_; }
  const std::vector<std::uint32_t>& open() const { return open_; }
  std::int64_t steps() const { return steps_; }  ///< taken so far: pairs that were looked at

  std::uint32_t most_helpful() const {
    std::uint32_t best = kNone;
    for (std::uint32_t j = 0; j < gain_.size(); ++j)
      if (in_[j] == 0 && gain_[j] > 0 && (best == kNone || gain_[j] > gain_[best])) best = j;
    return best;
  }

  /// Of those that hold the target, the one that brings most and has been out since before `now`.
  std::uint32_t most_helpful_for(std::uint32_t target, std::int64_t now) const {
    std::uint32_t best = kNone;
    for (const std::uint32_t j : incidence_.holders[target]) {
      if (in_[j] != 0 || since_[j] > now) continue;
      if (best == kNone || gain_[j] > gain_[best] ||
          (gain_[j] == gain_[best] && since_[j] < since_[best]))
        best = j;
    }
    return best;
  }

  /// Of the chosen ones but `kept`, those that are free to go first.
  std::uint32_t least_missed(std::int64_t now, std::uint32_t kept) const {
    std::uint32_t best = kNone;
    const auto before = [&](std::uint32_t j, std::uint32_t k) {
      const bool bound_j = since_[j] > now, bound_k = since_[k] > now;
      if (bound_j != bound_k) return bound_k;
      if (loss_[j] != loss_[k]) return loss_[j] < loss_[k];
      if (since_[j] != since_[k]) return since_[j] < since_[k];
      return j < k;
    };
    for (const std::uint32_t j : chosen_)
      if (j != kept && (best == kNone || before(j, best))) best = j;
    return best;
  }

  /// `until`: it stays in until then.
  void put_in(std::uint32_t j, std::int64_t until) {
    count(incidence_.held[j]);
    in_[j] = 1;
    since_[j] = until;
    chosen_.push_back(j);
    for (const std::uint32_t x : incidence_.held[j]) {
      if (++holders_[x] == 1) {
        close(x);
        change_gains(x, -weight_[x]);
        loss_[j] += weight_[x];
      } else if (holders_[x] == 2) {
        loss_[only_other(x, j)] -= weight_[x];
      }
    }
  }

  void take_out(std::uint32_t j, std::int64_t until) {
    count(incidence_.held[j]);
    in_[j] = 0;
    since_[j] = until;
    loss_[j] = 0;
    chosen_.erase(std::find(chosen_.begin(), chosen_.end(), j));
    for (const std::uint32_t x : incidence_.held[j]) {
      if (--holders_[x] == 0) {
        reopen(x);
        change_gains(x, weight_[x]);
      } else if (holders_[x] == 1) {
        loss_[only_other(x, j)] += weight_[x];
      }
    }
  }

  void make_open_heavier() {
    for (const std::uint32_t x : open_) {
      ++weight_[x];
      change_gains(x, 1);
    }
  }

 private:
  void change_gains(std::uint32_t x, std::int64_t by) {
    for (const std::uint32_t k : incidence_.holders[x]) gain_[k] += by;
    count(incidence_.holders[x]);
  }
  void count(const std::vector<std::uint32_t>& list) {
    steps_ += static_cast<std::int64_t>(list.size());
  }
  std::uint32_t only_other(std::uint32_t x, std::uint32_t than) {
    count(incidence_.holders[x]);
    for (const std::uint32_t k : incidence_.holders[x])
      if (in_[k] != 0 && k != than) return k;
    return than;
  }
  void close(std::uint32_t x) {
    const std::uint32_t last = open_.back();
    open_[place_[x]] = last;
    place_[last] = place_[x];
    open_.pop_back();
  }
  void reopen(std::uint32_t x) {
    place_[x] = static_cast<std::uint32_t>(open_.size());
    open_.push_back(x);
  }

  const Incidence& incidence_;
  std::vector<std::int64_t> weight_;    ///< of a target
  std::vector<std::uint32_t> holders_;  ///< how many chosen ones hold a target
  std::vector<std::int64_t> gain_;      ///< weight of the open targets a candidate holds
  std::vector<std::int64_t> loss_;      ///< weight of the targets a chosen one alone holds
  std::vector<std::int64_t> since_;     ///< it stays as it is until this exchange
  std::vector<char> in_;
  std::int64_t steps_ = 0;
  std::vector<std::uint32_t> chosen_, open_, place_;
};

}  // namespace

std::vector<std::uint32_t> choose_cover(std::span<const CoverSphere> candidates,
                                        std::span<const Eigen::Vector3d> targets, std::size_t count,
                                        std::size_t exchanges, std::uint64_t seed,
                                        std::int64_t& steps) {
  const Incidence incidence(candidates, targets);
  steps -= kStepsAPair * incidence.pairs;
  const auto unheld = std::count_if(incidence.holders.begin(), incidence.holders.end(),
                                    [](const auto& holders) { return holders.empty(); });
  if (50 * static_cast<std::size_t>(unheld) > targets.size()) return {};
  Choice choice(incidence);
  while (choice.chosen().size() < count) {
    const std::uint32_t best = choice.most_helpful();
    if (best == kNone) break;
    choice.put_in(best, 0);
  }
  std::int64_t now = 0;
  while (!choice.open().empty() && static_cast<std::size_t>(now) < exchanges &&
         choice.steps() < steps) {
    ++now;
    const std::uint64_t random =
        mixed(seed + static_cast<std::uint64_t>(now) * 0x9E3779B97F4A7C15ull);
    const std::uint32_t target = choice.open()[random % choice.open().size()];
    const std::uint32_t in = choice.most_helpful_for(target, now);
    if (in == kNone) continue;
    choice.put_in(in, now + 3 + static_cast<std::int64_t>((random >> 40) % 5));
    if (choice.chosen().size() > count)
      choice.take_out(choice.least_missed(now, in),
                      now + 1 + static_cast<std::int64_t>((random >> 50) % 5));
    choice.make_open_heavier();
  }
  steps -= choice.steps();
  if (!choice.open().empty()) return {};
  return choice.chosen();
}

std::vector<std::uint32_t> choose_greedily(std::span<const CoverSphere> candidates,
                                           std::span<const Eigen::Vector3d> targets) {
  const Incidence incidence(candidates, targets);
  Choice choice(incidence);
  while (!choice.open().empty()) {
    const std::uint32_t best = choice.most_helpful();
    if (best == kNone) break;
    choice.put_in(best, 0);
  }
  return choice.chosen();
}

}  // namespace ist
