#include "query/lod/level_blend.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "query/base/solid_bounds.h"
#include "query/kernel/look_kernel.h"
#include "query/lod/coincident.h"
#include "query/lod/level_chain.h"
#include "query/lod/unlike_sizes.h"
#include "query/lod/wanted_error.h"

namespace ist {
namespace {

/// Asks pairs of levels one after another under the limits that they share.
class LevelQueries {
 public:
  LevelQueries(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
               const PenetrationSettings& settings, Workspace& workspace, ExactMeasure exact,
               LargestPart* largest) noexcept
      : placed_a_(a),
        placed_b_(b),
        a_(a.asset.header()),
        b_(b.asset.header()),
        pose_(pose),
        settings_(settings),
        workspace_(workspace),
        exact_(exact),
        largest_(largest),
        same_asset_(are_one_asset(a_, b_)),
        has_exact_(by_error(settings) && settings.pair_budget == 0 && a.asset.has_mesh() &&
                   b.asset.has_mesh()) {}

  /// The exact measure may answer: nothing limits sphere pairs, which it does not obey.
  bool has_exact() const noexcept { return has_exact_; }
  bool sorts() const noexcept { return largest_ != nullptr; }

  /// The whole sum of a pair of levels, rounded as it may be: where lenses graze they are few, and
  /// the finest level is taken anyway.
  Penetration coarse_estimate(const LevelPair& pair) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = true;
    return counted(sum(pair, limits));
  }

  /// The sum of a pair of levels; of copies of one asset that all but coincide, that of unlike
  /// levels instead, unless the exact measure answers there. `most`: its weight is the largest.
  Penetration ask(const LevelPair& pair, bool most, bool keep_rounding = false) noexcept {
    const CoincidenceWeight coincidence = coincidence_weight_of(pair);
    if (coincidence.weight == 0 || has_exact_) return descend(pair, most, keep_rounding);
    LevelPair unlike[2] = {pair, pair};
    unlike[0].b = unlike[1].a = pair.a < a_.detail_count ? pair.a + 1 : pair.a - 1;
    const bool mostly_unlike = coincidence.weight >= 0.5;
    Penetration other = mix(descend(unlike[0], most && mostly_unlike, keep_rounding),
                            descend(unlike[1], false, keep_rounding), 0.5);
    if (coincidence.weight == 1) return other;
    const Penetration alike = descend(pair, most && !mostly_unlike, keep_rounding);
    Penetration mixed = mix(alike, other, coincidence.weight);
    add_slope(coincidence.slope, other.volume - alike.volume, pose_, mixed);
    return mixed;
  }

  /// Whether asking a pair of levels is no more than its coarse estimate.
  bool is_estimate(const LevelPair& pair, bool most) const noexcept {
    return !(most && sorts()) && (has_exact_ || coincidence_weight_of(pair).weight == 0);
  }

  /// The exact measure within what is left of the visits.
  Penetration exact(bool most) noexcept {
    const std::uint32_t left = limits_left().max_visits;
    PenetrationSettings settings = settings_;
    settings.measure = Measure::exact;
    settings.max_visits = left == DescentLimits::kNoLimit ? 0 : std::max(left, 1u);
    return counted(most && sorts()
                       ? largest_->exact(settings)
                       : with_error_status(
                             exact_(placed_a_, placed_b_, settings, pose_, workspace_), settings));
  }

  QuickLook look(const LevelPair& pair, bool slopes) const noexcept {
    return quick_look({a_, matched_tree(a_, pair.a)}, {b_, matched_tree(b_, pair.b)},
                      pose_.a_from_b, slopes);
  }

  CoincidenceWeight coincidence_weight_of(const LevelPair& pair) const noexcept {
    if (!same_asset_ || pair.a != pair.b) return {};
    const TreeHeader& tree = matched_tree(a_, pair.a);
    return coincidence_weight(tree.root, tree.mean_radius, pose_.a_from_b);
  }

  /// An answer with the counts of all that was asked.
  Penetration with_counts(Penetration answer) const noexcept {
    answer.node_visits = visits_;
    answer.sphere_pairs = pairs_;
    return answer;
  }

 private:
  /// Nothing but the roots is looked at once visits are spent.
  DescentLimits limits_left() const noexcept {
    DescentLimits limits = limits_of(settings_);
    limits.spend(visits_);
    return limits;
  }

  Penetration sum(const LevelPair& pair, const DescentLimits& limits) const noexcept {
    return lens_sum(placed_a_, matched_tree(a_, pair.a), placed_b_, matched_tree(b_, pair.b), pose_,
                    limits, *workspace_.impl());
  }

  Penetration counted(const Penetration& answer) noexcept {
    visits_ += answer.node_visits;
    pairs_ += answer.sphere_pairs;
    return answer;
  }

  Penetration descend(const LevelPair& pair, bool most, bool keep_rounding) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = keep_rounding;
    return counted(most && sorts() ? largest_->level(pair, limits) : sum(pair, limits));
  }

  const PlacedAsset& placed_a_;
  const PlacedAsset& placed_b_;
  const AssetHeader& a_;
  const AssetHeader& b_;
  const RelativePose& pose_;
  const PenetrationSettings& settings_;
  Workspace& workspace_;
  const ExactMeasure exact_;
  LargestPart* const largest_;
  const bool same_asset_;
  const bool has_exact_;
  std::uint32_t visits_ = 0, pairs_ = 0;
};

// A coarse estimate whose bounds are further apart than this part of it is too rough for an answer.
constexpr double kRough = 5e-4;

void add_gradients(double factor, const Penetration& part, Penetration& sum) {
  sum.force += factor * part.force;
  sum.torque += factor * part.torque;
}

/// Adds a part of a blend.
void add(double weight, const Penetration& part, Penetration& sum) {
  sum.volume += weight * part.volume;
  sum.volume_min += weight * part.volume_min;
  sum.volume_max += weight * part.volume_max;
  if (sum.volume > 0)
    sum.centroid += (weight * part.volume / sum.volume) * (part.centroid - sum.centroid);
  add_gradients(weight, part, sum);
  sum.status = std::max(sum.status, part.status);
}

// The part of the accepted error by which volumes about the smaller solid's are kept within it.
constexpr double kCapWidth = 0.1;

/// A level's answer, limited smoothly to `most`, the smaller solid's volume, with its slope.
Penetration kept_within_solid(Penetration part, double most, double error) {
  const double width = kCapWidth * std::min(error, 1.0) * most;
  if (!(width > 0) || !std::isfinite(most) || !(part.volume_max > most - width)) return part;
  const auto left = [&](double x) { return std::max(0.0, most + width - x); };
  const auto kept = [&](double x) {
    return x > most - width ? most - left(x) * left(x) / (4 * width) : x;
  };
  const double slope = std::min(left(part.volume) / (2 * width), 1.0);
  part.volume = kept(part.volume);
  part.volume_min = kept(part.volume_min);
  part.volume_max = kept(part.volume_max);
  part.force *= slope;
  part.torque *= slope;
  return part;
}

/// Bounds for a coarse estimate that a limit stopped: any level might have been chosen.
Penetration stopped_blend(LevelQueries& queries, const PlacedAsset& a, const PlacedAsset& b,
                          const PenetrationSettings& settings, const LevelChain& chain,
                          const Penetration& coarse) {
  Penetration result = coarse;
  if (queries.sorts()) queries.ask(chain.coarsest(), true);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const Penetration bounds = queries.ask(chain[i], false);
    result.volume_min = std::min(result.volume_min, bounds.volume_min);
    result.volume_max = std::max(result.volume_max, bounds.volume_max);
  }
  if (by_error(settings))
    result = kept_within_solid(result, smaller_volume(a, b), settings.relative_error);
  if (queries.has_exact()) bound_by_solids(a, b, result);
  return result;
}

/// The shares of levels and measures in a blend.
struct BlendShares {
  WantedError::Shares wanted;  ///< by errors; nothing is the exact measure's if it can't answer
  LevelChain::Weights weights = {};  ///< of levels: what of `wanted` the pair budget affords
  LevelWeight sure = {};             ///< the finest level's, whatever the coarse estimate is
  bool missed = false;               ///< nothing is exact enough
  std::size_t largest = 0;           ///< level
  bool mostly_exact = false;

  double weight(std::size_t i) const {
    return sure.weight * (i == 0 ? 1 : 0) + (1 - sure.weight) * weights[i].weight;
  }
};

BlendShares share_blend(const LevelChain& chain, const WantedError* wanted, bool has_exact,
                        const LevelWeight& sure, double budget, double estimate) {
  BlendShares shares;
  shares.sure = sure;
  if (wanted != nullptr) shares.wanted = wanted->shares(estimate);
  // Where nothing is exact enough, the finest level is the best.
  LevelWeight& finest = shares.wanted.levels[0];
  shares.missed = wanted != nullptr && !has_exact && shares.wanted.rest.weight > 0;
  if (!has_exact) finest = finest + std::exchange(shares.wanted.rest, {});
  shares.weights =
      budget > 0 ? chain.weights(estimate, budget, shares.wanted.levels) : shares.wanted.levels;
  for (std::size_t i = 1; i < chain.size(); ++i)
    if (shares.weight(i) > shares.weight(shares.largest)) shares.largest = i;
  shares.mostly_exact = shares.wanted.rest.weight > shares.weight(shares.largest);
  return shares;
}

/// The sum of all parts, with the slopes of their weights.
class BlendSum {
 public:
  /// `wanted`: null without a wanted error. `most` [u³]: the smaller solid's volume.
  BlendSum(LevelQueries& queries, const LevelChain& chain, const WantedError* wanted,
           const BlendShares& shares, const Penetration& coarse,
           const PenetrationSettings& settings, double most, const RelativePose& pose) noexcept
      : queries_(queries),
        chain_(chain),
        wanted_(wanted),
        shares_(shares),
        coarse_(coarse),
        settings_(settings),
        most_(most),
        pose_(pose),
        rough_(width(coarse) > kRough * coarse.volume),
        // Where lenses graze, to sum them again in double takes longer than a coarser level saves.
        keep_rounding_(shares.weights[0].weight < 1),
        missed_(shares.missed) {}

  Penetration sum() noexcept {
    for (std::size_t i = chain_.size(); i-- > 0;)  // the coarse ones first: they are sure to end
      if (shares_.weight(i) > 0 || shares_.weights[i].slope != 0) add_level(i);
    const LevelWeight& rest = shares_.wanted.rest;
    exact_weight_.volume += rest.weight;
    if (rest.slope != 0) exact_slope_ += rest.slope / pose_.unit3();
    if (exact_weight_.volume > 0 || exact_slope_ != 0) add_exact();
    // The coarse estimate is rounded too, and with it the weights.
    if (slope_ != 0) {
      doubt_ += std::abs(slope_) * width(coarse_);
      add_gradients(slope_, coarse_, sum_);
    }
    if (sure_slope_ != 0)
      add_slope(queries_.look(chain_.coarsest(), true).slope, sure_slope_, pose_, sum_);
    sum_.volume_min = std::max(0.0, sum_.volume_min - doubt_);
    sum_.volume_max += doubt_;
    if (wanted_ != nullptr)
      sum_.volume_max = std::max(sum_.volume, std::min(sum_.volume_max, most_ * (1 + 1e-12)));
    if (missed_ && sum_.volume > 0 && sum_.status == QueryStatus::ok)
      sum_.status = QueryStatus::error_exceeded;
    return sum_;
  }

 private:
  static double width(const Penetration& part) { return part.volume_max - part.volume_min; }

  Penetration ask(const LevelPair& pair, bool most) {
    if (pair.a == chain_.coarsest().a && pair.b == chain_.coarsest().b && !rough_ &&
        queries_.is_estimate(pair, most))
      return coarse_;
    return queries_.ask(pair, most, keep_rounding_);
  }

  void add_level(std::size_t i) {
    const LevelWeight &of_rest = shares_.weights[i], &sure = shares_.sure;
    const double weight = shares_.weight(i);
    const Penetration raw = ask(chain_[i], i == shares_.largest && !shares_.mostly_exact);
    const Penetration part =
        wanted_ != nullptr ? kept_within_solid(raw, most_, settings_.relative_error) : raw;
    const CoincidenceWeight same = queries_.coincidence_weight_of(chain_[i]);
    double trusted = 1;
    // Predictions are of levels within the budget.
    missed_ |= wanted_ != nullptr && !queries_.has_exact() &&
               (weight < shares_.wanted.levels[i].weight || same.weight > 0);
    if (wanted_ != nullptr && !missed_) {
      const Penetration other = ask(wanted_->coarser(i), false);
      const LevelTrust trust = wanted_->trust(i, raw.volume, other.volume, most_);
      sum_.status = std::max(sum_.status, other.status);
      trusted = trust.weight * (1 - same.weight);
      if (queries_.has_exact())
        hand_over(weight, trust, same, part.volume, raw, other);
      else
        missed_ |= std::exchange(trusted, 1) < 1;
    }
    add(weight * trusted, part, sum_);
    largest_volume_ = std::max(largest_volume_, part.volume);
    exact_weight_.volume += weight * (1 - trusted);
    by_levels_ |= weight * trusted > 0;
    if (i == shares_.largest) largest_ = weight * trusted;
    // At extreme sizes unit3 is 0 or the volume infinite: then a slope of 0 would give NaN.
    if (of_rest.slope != 0) {
      const double slope = (1 - sure.weight) * of_rest.slope / pose_.unit3();
      slope_ += slope * trusted * part.volume;
      exact_slope_ += slope * (1 - trusted);
    }
    if (sure.slope != 0)
      sure_slope_ += sure.slope * ((i == 0 ? 1 : 0) - of_rest.weight) * part.volume;
  }

  /// The slopes of what a level that says `volume` leaves to the exact measure.
  void hand_over(double weight, const LevelTrust& trust, const CoincidenceWeight& same,
                 double volume, const Penetration& own, const Penetration& other) {
    const auto change = [&](double by, const Penetration& of) {
      if (by == 0) return;
      const double slope = weight * (1 - same.weight) * by;
      add_gradients(slope * volume, of, sum_);
      add_gradients(-slope, of, exact_weight_);
      weight_doubt_ += std::abs(slope) * width(of);
    };
    change(trust.by_own, own);
    change(trust.by_other, other);
    if (!(same.weight > 0)) return;
    add_slope(same.slope, -weight * trust.weight * volume, pose_, sum_);
    add_slope(same.slope, weight * trust.weight, pose_, exact_weight_);
  }

  void add_exact() {
    const Penetration part =
        queries_.exact(shares_.mostly_exact || exact_weight_.volume > largest_);
    add_gradients(part.volume, exact_weight_, sum_);
    add(exact_weight_.volume, part, sum_);
    if (exact_slope_ != 0) slope_ += exact_slope_ * part.volume;
    doubt_ += weight_doubt_ * std::max(largest_volume_, part.volume);
    missed_ |= with_error_status(part, settings_).status == QueryStatus::error_exceeded;
    if (by_levels_) return;
    sum_.touching = part.touching;
    sum_.contact_area = part.contact_area;
    sum_.contact_normal = part.contact_normal;
  }

  LevelQueries& queries_;
  const LevelChain& chain_;
  const WantedError* const wanted_;
  const BlendShares& shares_;
  const Penetration& coarse_;
  const PenetrationSettings& settings_;
  const double most_;
  const RelativePose& pose_;
  const bool rough_;
  const bool keep_rounding_;
  bool missed_;
  Penetration sum_;
  bool by_levels_ = false;    ///< some of the sum is
  double largest_ = 0;        ///< weight of the largest level
  Penetration exact_weight_;  ///< as if it were a volume, with its gradients but those by …
  double exact_slope_ = 0;    ///< … the coarse estimate
  double slope_ = 0;          ///< of the sum by the coarse estimate
  double sure_slope_ = 0;     ///< and by the quick look
  // Rounding of the sum and of the exact measure's weight, since volumes decide weights:
  double doubt_ = 0, weight_doubt_ = 0;
  double largest_volume_ = 0;  ///< of levels
};

}  // namespace

Penetration blend_levels(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
                         const PenetrationSettings& settings, Workspace& workspace,
                         ExactMeasure exact, LargestPart* largest) noexcept {
  LevelQueries queries(a, b, pose, settings, workspace, exact, largest);
  const bool with_error = by_error(settings);
  if (!with_error && settings.pair_budget == 0) return queries.ask(LevelPair(), true);
  const LevelChain chain(a.asset.header(), b.asset.header(), pose.a_from_b.scale);
  // Nothing to choose, or nothing dear.
  if (!with_error && chain.size() == 1) return queries.ask(chain[0], true);
  LevelWeight sure = {};
  if (!with_error) {
    sure = chain.quick_weight(queries.look(chain.coarsest(), false).volume, settings.pair_budget);
    if (sure.weight == 1) return queries.ask(chain[0], true);
  }
  const bool has_exact = queries.has_exact();
  std::optional<WantedError> wanted;
  if (with_error) wanted.emplace(a, b, pose, settings, chain, has_exact);
  if (has_exact && !wanted->by_spheres()) return with_error_status(queries.exact(true), settings);
  // Whatever else is asked, the coarse estimate is the whole sum: only that is smooth.
  const Penetration coarse = queries.coarse_estimate(chain.coarsest());
  if (coarse.status != QueryStatus::ok)
    return queries.with_counts(stopped_blend(queries, a, b, settings, chain, coarse));
  const BlendShares shares = share_blend(chain, wanted ? &*wanted : nullptr, has_exact, sure,
                                         settings.pair_budget, coarse.volume / pose.unit3());
  Penetration answer = BlendSum(queries, chain, wanted ? &*wanted : nullptr, shares, coarse,
                                settings, smaller_volume(a, b), pose)
                           .sum();
  if (has_exact && answer.status == QueryStatus::budget_exhausted) bound_by_solids(a, b, answer);
  return queries.with_counts(answer);
}

}  // namespace ist
