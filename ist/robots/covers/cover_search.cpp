#include "robots/covers/cover_search.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>
#include <utility>

#include "base/hashing.h"
#include "robots/covers/cover_proof.h"
#include "robots/covers/offset_surface.h"
#include "robots/covers/point_grid.h"

namespace ist {
namespace {

constexpr std::uint32_t kNoCandidate = UINT32_MAX;
constexpr std::int64_t kStepsAPair = 20;  ///< cost of finding and sorting it

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

  std::int64_t pairs = 0;  ///< of a candidate and a target it contains
};

/// The state of the search: the gain of each candidate, and the loss without each chosen one.
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
  std::int64_t steps() const { return steps_; }  ///< taken so far: pairs examined

  std::uint32_t most_helpful() const {
    std::uint32_t best = kNoCandidate;
    for (std::uint32_t j = 0; j < gain_.size(); ++j)
      if (in_[j] == 0 && gain_[j] > 0 && (best == kNoCandidate || gain_[j] > gain_[best])) best = j;
    return best;
  }

  /// Among the candidates that contain the target, the one with the largest gain that has been
  /// unchosen since before `now`.
  std::uint32_t most_helpful_for(std::uint32_t target, std::int64_t now) const {
    std::uint32_t best = kNoCandidate;
    for (const std::uint32_t j : incidence_.holders[target]) {
      if (in_[j] != 0 || since_[j] > now) continue;
      if (best == kNoCandidate || gain_[j] > gain_[best] ||
          (gain_[j] == gain_[best] && since_[j] < since_[best]))
        best = j;
    }
    return best;
  }

  /// Among the chosen ones except `kept`, the one whose removal costs least; those without cost
  /// first.
  std::uint32_t least_missed(std::int64_t now, std::uint32_t kept) const {
    std::uint32_t best = kNoCandidate;
    const auto before = [&](std::uint32_t j, std::uint32_t k) {
      const bool bound_j = since_[j] > now, bound_k = since_[k] > now;
      if (bound_j != bound_k) return bound_k;
      if (loss_[j] != loss_[k]) return loss_[j] < loss_[k];
      if (since_[j] != since_[k]) return since_[j] < since_[k];
      return j < k;
    };
    for (const std::uint32_t j : chosen_)
      if (j != kept && (best == kNoCandidate || before(j, best))) best = j;
    return best;
  }

  /// `until`: it stays chosen until then.
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
  std::vector<std::uint32_t> holders_;  ///< number of chosen ones that contain a target
  std::vector<std::int64_t> gain_;      ///< weight of the open targets a candidate contains
  std::vector<std::int64_t> loss_;      ///< weight of the targets a chosen one alone contains
  std::vector<std::int64_t> since_;     ///< it stays as it is until this exchange
  std::vector<char> in_;
  std::int64_t steps_ = 0;
  std::vector<std::uint32_t> chosen_, open_, place_;
};

}  // namespace

std::vector<std::uint32_t> choose_cover(std::span<const CoverSphere> candidates,
                                        std::span<const Eigen::Vector3d> targets, std::size_t count,
                                        std::size_t exchanges, std::uint64_t seed,
                                        std::int64_t& steps, std::size_t one_in) {
  const Incidence incidence(candidates, targets);
  steps -= kStepsAPair * incidence.pairs;
  const auto unheld = std::count_if(incidence.holders.begin(), incidence.holders.end(),
                                    [](const auto& holders) { return holders.empty(); });
  if (one_in * static_cast<std::size_t>(unheld) > targets.size()) return {};
  Choice choice(incidence);
  while (choice.chosen().size() < count) {
    const std::uint32_t best = choice.most_helpful();
    if (best == kNoCandidate) break;
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
    if (in == kNoCandidate) continue;
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
    if (best == kNoCandidate) break;
    choice.put_in(best, 0);
  }
  return choice.chosen();
}

namespace {

using Eigen::Vector3d;

constexpr int kPasses = 3;                 ///< of exchanges and descent, of which the best counts
constexpr int kRounds = 120;               ///< of a descent, over all balls
constexpr std::size_t kTargetsABall = 60;  ///< on faces
constexpr std::size_t kCandidates = 1200;  ///< for exchanges, approximately
constexpr std::size_t kCandidatesABall = 20;  ///< with shares of the level
constexpr double kThinning = 0.3;             ///< levels between targets that exchanges use
constexpr double kTightCell = 0.3;  ///< of the usual cells, where shares of the level are small
constexpr std::size_t kExchanges = 1500;           ///< at a level
constexpr std::int64_t kSteps = 100'000'000;       ///< of all exchanges of a pass
constexpr std::int64_t kTightSteps = 500'000'000;  ///< the same with shares of the level
constexpr int kLevels = 24;                        ///< that exchanges try
constexpr double kFinest = 1e-3;                   ///< of the level: precision of the final radii

/// Centres of candidates, and how deep they lie.
struct Candidates {
  Candidates(const MeshSolid& solid, std::vector<Vector3d> places)
      : centres(std::move(places)), depths(centres.size()) {
    tbb::parallel_for(std::size_t{0}, centres.size(),
                      [&](std::size_t i) { depths[i] = depth_in(solid, centres[i]); });
  }

  /// The largest balls around the centres, without empty ones.
  std::vector<CoverSphere> balls_at(const OffsetSurface& surface) const {
    std::vector<CoverSphere> balls;
    for (std::size_t i = 0; i < centres.size(); ++i)
      if (const double r = surface.radius(centres[i], depths[i]); r > 0)
        balls.push_back({centres[i], r});
    return balls;
  }

  std::vector<Vector3d> centres;
  std::vector<double> depths;
};

std::vector<Vector3d> centres_of(const std::vector<CoverSphere>& balls,
                                 const std::vector<std::uint32_t>& chosen) {
  std::vector<Vector3d> centres;
  for (const std::uint32_t j : chosen) centres.push_back(balls[j].centre);
  return centres;
}

/// The first target of every cell of a grid: cells of so many levels, or fewer where their share is
/// small.
std::vector<Vector3d> thinned(const SampledSolid& sampled, double cell) {
  std::unordered_set<std::uint64_t> seen, tight;
  std::vector<Vector3d> some;
  for (std::size_t i = 0; i < sampled.targets.size(); ++i) {
    const Vector3d& p = sampled.targets[i];
    if (i < sampled.tight ? tight.insert(cell_key(p, kTightCell * cell)).second
                          : seen.insert(cell_key(p, cell)).second)
      some.push_back(p);
  }
  return some;
}

SampledSolid sampled_for(const MeshSolid& solid, std::size_t count, const LevelShare& share,
                         double most) {
  SampledSolid sampled =
      sample_solid(solid, std::clamp<std::size_t>(kTargetsABall * count, 1000, 60000), share);
  sampled.most = most;
  return sampled;
}

/// The number of candidates: more if balls contain little of the surface because their share of the
/// level is small.
std::size_t candidate_count(const SampledSolid& sampled, std::size_t usual, std::size_t count) {
  return sampled.share ? std::max(usual, kCandidatesABall * count) : usual;
}

/// The lowest level at which a greedy choice of balls around the medial axis suffices.
LevelCover greedy_cover(const MeshSolid& solid, const SampledSolid& sampled, std::size_t count) {
  const Candidates candidates(
      solid, OffsetSurface(solid, sampled, 0).medial_centres(candidate_count(sampled, 800, count)));
  const std::vector<Vector3d> targets = thinned(sampled, 2 * sampled.spacing);
  double low = 1e-3, high = 1;
  LevelCover best;
  for (int k = 0; k < 7; ++k) {
    const double level = std::sqrt(low * high);
    const std::vector<CoverSphere> balls =
        candidates.balls_at(OffsetSurface(solid, sampled, level));
    const std::vector<std::uint32_t> chosen = choose_greedily(balls, targets);
    if (!chosen.empty() && chosen.size() <= count) {
      best = {centres_of(balls, chosen), level};
      high = level;
    } else {
      low = level;
    }
  }
  // One ball around the cube of the frame contains everything.
  if (best.centres.empty()) best = {{Vector3d::Zero()}, 2};
  return best;
}

/// Lowers the level, at first by the share `step`, as long as sufficient candidates are found.
LevelCover exchanged(const MeshSolid& solid, const SampledSolid& sampled, LevelCover cover,
                     std::size_t count, double step, std::uint64_t seed,
                     const std::function<void()>& look) {
  const auto candidates_at = [&](double level) {
    std::vector<Vector3d> centres =
        OffsetSurface(solid, sampled, level)
            .medial_centres(candidate_count(sampled, kCandidates, count));
    centres.insert(centres.end(), cover.centres.begin(), cover.centres.end());
    return Candidates(solid, std::move(centres));
  };
  Candidates candidates = candidates_at(cover.level);
  const std::vector<Vector3d> targets = thinned(sampled, kThinning * cover.level);
  double factor = 1 - step;
  std::int64_t steps = sampled.share ? kTightSteps : kSteps;
  for (int k = 0; k < kLevels && factor < 0.99 && steps > 0; ++k) {
    const double level = cover.level * factor;
    // Tight edges are contained only by balls for their level.
    if (sampled.share) candidates = candidates_at(level);
    const std::vector<CoverSphere> balls =
        candidates.balls_at(OffsetSurface(solid, sampled, level));
    const std::vector<std::uint32_t> chosen =
        choose_cover(balls, targets, count, kExchanges, ++seed, steps, sampled.share ? 300 : 50);
    look();
    if (chosen.empty())
      factor = std::sqrt(factor);
    else
      cover = {centres_of(balls, chosen), level};
  }
  return cover;
}

/// The protrusion of the ball that protrudes most; `enough` if none protrudes more.
double largest_protrusion(const MeshSolid& solid, const std::vector<CoverSphere>& balls,
                          double enough) {
  std::vector<double> most(balls.size());
  tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
    most[i] = ball_protrusion(solid, balls[i], 0.02, enough).most;
  });
  return std::max(enough, *std::max_element(most.begin(), most.end()));
}

}  // namespace

std::size_t CoverSearch::greedy_count(double level, std::size_t enough) const {
  for (std::size_t count = 64;;) {
    const SampledSolid sampled = sampled_for(solid_, count, share_, most_);
    const OffsetSurface surface(solid_, sampled, level);
    const std::size_t found =
        choose_greedily(
            Candidates(solid_, surface.medial_centres(candidate_count(sampled, 3000, count)))
                .balls_at(surface),
            thinned(sampled, 0.5 * level))
            .size();
    // More balls need more samples to be distinguished.
    if (!share_ || 2 * found < 3 * count || found > enough || count >= kMostCoverSpheres)
      return found;
    count = std::min(2 * found, kMostCoverSpheres);
  }
}

LeveledBalls CoverSearch::with_count(std::size_t count) const {
  SampledSolid sampled = sampled_for(solid_, count, share_, most_);
  look_(0.1);
  LevelCover start = greedy_cover(solid_, sampled, count);
  LeveledBalls best = {{}, std::numeric_limits<double>::infinity()};
  for (int pass = 0; pass < kPasses; ++pass) {
    const double share = 0.2 + 0.7 * pass / kPasses;
    const std::function<void()> look = [&] { look_(share); };
    look();
    // Samples alone underestimate the level; after a descent it is that of the surface.
    const double step = pass == 0 ? 0.1 : 0.05;
    const double before = start.level;
    start = exchanged(solid_, sampled, std::move(start), count, step,
                      mixed(seed_ + static_cast<std::uint64_t>(pass) + 1), look);
    if (start.level == before && pass > 0) break;
    LookedCover looked = CoverDescent(solid_, sampled).improve(std::move(start), kRounds, look);
    grow_to_cover(solid_, looked.balls, kFinest * looked.cover.level);
    const double largest =
        share_ ? looked.cover.level
               : largest_protrusion(solid_, looked.balls, 1.01 * looked.cover.level);
    start = std::move(looked.cover);
    if (largest < best.level) best = {std::move(looked.balls), largest};
  }
  look_(0.95);
  return best;
}

}  // namespace ist
