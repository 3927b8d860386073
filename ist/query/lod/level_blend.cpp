#include "query/lod/level_blend.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "query/base/solid_bounds.h"
#include "query/kernel/node_kernel.h"
#include "query/lod/level_chain.h"
#include "query/lod/unlike_sizes.h"
#include "query/lod/wanted_error.h"

namespace ist {
namespace {

/// Answers by pairs of levels under limits that they share.
struct LevelQueries {
  const PlacedAsset& placed_a;
  const PlacedAsset& placed_b;
  const RelativePose& pose;
  const PenetrationSettings& settings;
  Workspace& workspace;
  const ExactMeasure exact_measure;
  LargestPart* const largest;

  const AssetHeader& a = placed_a.asset.header();
  const AssetHeader& b = placed_b.asset.header();
  const bool same_asset = are_one_asset(a, b);
  /// The exact measure may answer if sphere pairs are not limited, a limit that it does not obey.
  const bool has_exact =
      by_error(settings) && settings.pair_budget == 0 && a.mesh != 0 && b.mesh != 0;
  std::uint32_t visits = 0, pairs = 0;

  bool has_bins() const noexcept { return largest != nullptr; }

  /// The whole sum of a pair of levels, with the rounding of float: grazing lenses are few, and
  /// there the finest level is used anyway.
  Penetration coarse_estimate(const LevelPair& pair) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = true;
    return counted(sum(pair, limits));
  }

  /// The sum of a pair of levels. For copies of one asset that nearly coincide, it is that of
  /// unlike levels, unless the exact measure answers there. `most`: its weight is the largest.
  Penetration ask(const LevelPair& pair, bool most, bool keep_rounding = false) noexcept {
    const CoincidenceWeight coincidence = coincidence_weight_of(pair);
    if (coincidence.weight == 0 || has_exact) return descend(pair, most, keep_rounding);
    LevelPair unlike[2] = {pair, pair};
    unlike[0].b = unlike[1].a = pair.a < a.detail_count ? pair.a + 1 : pair.a - 1;
    const bool mostly_unlike = coincidence.weight >= 0.5;
    Penetration other = mix(descend(unlike[0], most && mostly_unlike, keep_rounding),
                            descend(unlike[1], false, keep_rounding), 0.5);
    if (coincidence.weight == 1) return other;
    const Penetration alike = descend(pair, most && !mostly_unlike, keep_rounding);
    Penetration mixed = mix(alike, other, coincidence.weight);
    add_slope(coincidence.slope, other.volume - alike.volume, pose, mixed);
    return mixed;
  }

  /// True if ask() gives no more than coarse_estimate().
  bool is_estimate(const LevelPair& pair, bool most) const noexcept {
    return !(most && has_bins()) && (has_exact || coincidence_weight_of(pair).weight == 0);
  }

  /// The exact measure within the visits left.
  Penetration exact(bool most) noexcept {
    const std::uint32_t left = limits_left().max_visits;
    PenetrationSettings exact = settings;
    exact.measure = Measure::exact;
    exact.max_visits = left == DescentLimits::kNoLimit ? 0 : std::max(left, 1u);
    if (most && has_bins()) return counted(largest->exact(exact));
    return counted(
        with_error_status(exact_measure(placed_a, placed_b, exact, pose, workspace), exact));
  }

  QuickLook look(const LevelPair& pair, bool slopes) const noexcept {
    return quick_look({a, matched_tree(a, pair.a)}, {b, matched_tree(b, pair.b)}, pose.a_from_b,
                      slopes);
  }

  CoincidenceWeight coincidence_weight_of(const LevelPair& pair) const noexcept {
    if (!same_asset || pair.a != pair.b) return {};
    const TreeHeader& tree = matched_tree(a, pair.a);
    return coincidence_weight(tree.root, tree.mean_radius, pose.a_from_b);
  }

  Penetration with_counts(Penetration answer) const noexcept {
    answer.node_visits = visits;
    answer.sphere_pairs = pairs;
    return answer;
  }

  DescentLimits limits_left() const noexcept {
    DescentLimits limits = limits_of(settings);
    limits.spend(visits);
    return limits;
  }

  Penetration sum(const LevelPair& pair, const DescentLimits& limits) const noexcept {
    return lens_sum(placed_a, matched_tree(a, pair.a), placed_b, matched_tree(b, pair.b), pose,
                    limits, *workspace.impl());
  }

  Penetration counted(const Penetration& answer) noexcept {
    visits += answer.node_visits;
    pairs += answer.sphere_pairs;
    return answer;
  }

  Penetration descend(const LevelPair& pair, bool most, bool keep_rounding) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = keep_rounding;
    return counted(most && has_bins() ? largest->level(pair, limits) : sum(pair, limits));
  }
};

// A coarse estimate is too rough for an answer if its bounds are this fraction of it apart.
constexpr double kRough = 5e-4;

void add_gradients(double factor, const Penetration& part, Penetration& sum) {
  sum.force += factor * part.force;
  sum.torque += factor * part.torque;
}

void add(double weight, const Penetration& part, Penetration& sum) {
  sum.volume += weight * part.volume;
  sum.volume_min += weight * part.volume_min;
  sum.volume_max += weight * part.volume_max;
  if (sum.volume > 0)
    sum.centroid += (weight * part.volume / sum.volume) * (part.centroid - sum.centroid);
  add_gradients(weight, part, sum);
  sum.status = std::max(sum.status, part.status);
}

// The fraction of the accepted error over which volumes are limited to the smaller solid's.
constexpr double kCapWidth = 0.1;

/// A level's answer, smoothly limited to `most`, the smaller solid's volume, with gradients.
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

/// The answer after a stopped coarse estimate: its bounds cover every level.
Penetration stopped_blend(LevelQueries& queries, const LevelChain& chain,
                          const Penetration& coarse) {
  Penetration result = coarse;
  if (queries.has_bins()) queries.ask(chain.coarsest(), true);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const Penetration bounds = queries.ask(chain[i], false);
    result.volume_min = std::min(result.volume_min, bounds.volume_min);
    result.volume_max = std::max(result.volume_max, bounds.volume_max);
  }
  if (by_error(queries.settings))
    result = kept_within_solid(result, smaller_volume(queries.placed_a, queries.placed_b),
                               queries.settings.relative_error);
  if (queries.has_exact) bound_by_solids(queries.placed_a, queries.placed_b, result);
  return result;
}

struct BlendShares {
  WantedError::Shares wanted;        ///< by errors; none of the exact measure if it can't answer
  LevelChain::Weights weights = {};  ///< of levels, as far as the pair budget affords `wanted`
  LevelWeight sure = {};             ///< of the finest level by the quick look
  bool missed = false;               ///< no level is accurate enough
  std::size_t largest = 0;           ///< the level of the largest weight
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
  // If no level is accurate enough, the finest is the best.
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
struct BlendSum {
  LevelQueries& queries;
  const LevelChain& chain;
  const WantedError* const wanted;  ///< null without a wanted error
  const BlendShares& shares;
  const Penetration& coarse;
  const double most;  ///< [u³] the smaller solid's volume

  const PenetrationSettings& settings = queries.settings;
  const RelativePose& pose = queries.pose;
  const bool rough = width(coarse) > coarse.volume* kRough;
  // Summing grazing lenses again in double takes longer than a coarser level saves.
  const bool keep_rounding = shares.weights[0].weight < 1;
  bool missed = shares.missed;
  Penetration sum = {};
  bool by_levels = false;         ///< a part of the sum is
  double largest = 0;             ///< weight of the largest level
  Penetration exact_weight = {};  ///< as if it were a volume; without its gradients by
  double exact_slope = 0;         ///< the coarse estimate
  double slope = 0;               ///< of the sum by the coarse estimate
  double sure_slope = 0;          ///< of the sum by the quick look
  // Rounding of the sum, and of the exact measure's weight, which depends on volumes:
  double doubt = 0, weight_doubt = 0;
  double largest_volume = 0;  ///< of levels

  Penetration run() noexcept {
    for (std::size_t i = chain.size(); i-- > 0;)  // coarse levels first: limits do not stop them
      if (shares.weight(i) > 0 || shares.weights[i].slope != 0) add_level(i);
    const LevelWeight& rest = shares.wanted.rest;
    exact_weight.volume += rest.weight;
    if (rest.slope != 0) exact_slope += rest.slope / pose.unit3();
    if (exact_weight.volume > 0 || exact_slope != 0) add_exact();
    // Rounding of the coarse estimate changes the weights.
    if (slope != 0) {
      doubt += std::abs(slope) * width(coarse);
      add_gradients(slope, coarse, sum);
    }
    if (sure_slope != 0)
      add_slope(queries.look(chain.coarsest(), true).slope, sure_slope, pose, sum);
    sum.volume_min = std::max(0.0, sum.volume_min - doubt);
    sum.volume_max += doubt;
    if (wanted != nullptr)
      sum.volume_max = std::max(sum.volume, std::min(sum.volume_max, most * (1 + 1e-12)));
    if (missed && sum.volume > 0 && sum.status == QueryStatus::ok)
      sum.status = QueryStatus::error_exceeded;
    return sum;
  }

  static double width(const Penetration& part) { return part.volume_max - part.volume_min; }

  Penetration ask(const LevelPair& pair, bool most) {
    if (pair.a == chain.coarsest().a && pair.b == chain.coarsest().b && !rough &&
        queries.is_estimate(pair, most))
      return coarse;
    return queries.ask(pair, most, keep_rounding);
  }

  void add_level(std::size_t i) {
    const LevelWeight &of_rest = shares.weights[i], &sure = shares.sure;
    const double weight = shares.weight(i);
    const Penetration raw = ask(chain[i], i == shares.largest && !shares.mostly_exact);
    const Penetration part =
        wanted != nullptr ? kept_within_solid(raw, most, settings.relative_error) : raw;
    const CoincidenceWeight same = queries.coincidence_weight_of(chain[i]);
    double trusted = 1;
    // The prediction does not hold for levels beyond the budget, or for coincident copies.
    missed |= wanted != nullptr && !queries.has_exact &&
              (weight < shares.wanted.levels[i].weight || same.weight > 0);
    if (wanted != nullptr && !missed) {
      const Penetration other = ask(wanted->coarser(i), false);
      const LevelTrust trust = wanted->trust(i, raw.volume, other.volume, most);
      sum.status = std::max(sum.status, other.status);
      trusted = trust.weight * (1 - same.weight);
      if (queries.has_exact)
        hand_over(weight, trust, same, part.volume, raw, other);
      else
        missed |= std::exchange(trusted, 1) < 1;
    }
    add(weight * trusted, part, sum);
    largest_volume = std::max(largest_volume, part.volume);
    exact_weight.volume += weight * (1 - trusted);
    by_levels |= weight * trusted > 0;
    if (i == shares.largest) largest = weight * trusted;
    // At extreme sizes, where unit3 is 0 or the volume infinite, a slope of 0 would give NaN.
    if (of_rest.slope != 0) {
      const double by_coarse = (1 - sure.weight) * of_rest.slope / pose.unit3();
      slope += by_coarse * trusted * part.volume;
      exact_slope += by_coarse * (1 - trusted);
    }
    if (sure.slope != 0)
      sure_slope += sure.slope * ((i == 0 ? 1 : 0) - of_rest.weight) * part.volume;
  }

  /// Adds the slopes of the weight that a level of this volume leaves to the exact measure.
  void hand_over(double weight, const LevelTrust& trust, const CoincidenceWeight& same,
                 double volume, const Penetration& own, const Penetration& other) {
    const auto change = [&](double by, const Penetration& of) {
      if (by == 0) return;
      const double factor = weight * (1 - same.weight) * by;
      add_gradients(factor * volume, of, sum);
      add_gradients(-factor, of, exact_weight);
      weight_doubt += std::abs(factor) * width(of);
    };
    change(trust.by_own, own);
    change(trust.by_other, other);
    if (!(same.weight > 0)) return;
    add_slope(same.slope, -weight * trust.weight * volume, pose, sum);
    add_slope(same.slope, weight * trust.weight, pose, exact_weight);
  }

  void add_exact() {
    const Penetration part = queries.exact(shares.mostly_exact || exact_weight.volume > largest);
    add_gradients(part.volume, exact_weight, sum);
    add(exact_weight.volume, part, sum);
    if (exact_slope != 0) slope += exact_slope * part.volume;
    doubt += weight_doubt * std::max(largest_volume, part.volume);
    missed |= with_error_status(part, settings).status == QueryStatus::error_exceeded;
    if (by_levels) return;
    sum.touching = part.touching;
    sum.contact_area = part.contact_area;
    sum.contact_normal = part.contact_normal;
  }
};

}  // namespace

Penetration blend_levels(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
                         const PenetrationSettings& settings, Workspace& workspace,
                         ExactMeasure exact, LargestPart* largest) noexcept {
  LevelQueries queries{a, b, pose, settings, workspace, exact, largest};
  const bool with_error = by_error(settings);
  if (!with_error && settings.pair_budget == 0) return queries.ask(LevelPair(), true);
  const LevelChain chain(a.asset.header(), b.asset.header(), pose.a_from_b.scale);
  if (!with_error && chain.size() == 1) return queries.ask(chain[0], true);
  LevelWeight sure = {};
  if (!with_error) {
    sure = chain.quick_weight(queries.look(chain.coarsest(), false).volume, settings.pair_budget);
    if (sure.weight == 1) return queries.ask(chain[0], true);
  }
  const bool has_exact = queries.has_exact;
  std::optional<WantedError> wanted;
  if (with_error) wanted.emplace(a, b, pose, settings, chain, has_exact);
  if (has_exact && !wanted->by_spheres()) return with_error_status(queries.exact(true), settings);
  // The coarse estimate is the whole sum of a level: only that is smooth.
  const Penetration coarse = queries.coarse_estimate(chain.coarsest());
  if (coarse.status != QueryStatus::ok)
    return queries.with_counts(stopped_blend(queries, chain, coarse));
  const WantedError* const by_wanted = wanted ? &*wanted : nullptr;
  const BlendShares shares = share_blend(chain, by_wanted, has_exact, sure, settings.pair_budget,
                                         coarse.volume / pose.unit3());
  Penetration answer =
      BlendSum{queries, chain, by_wanted, shares, coarse, smaller_volume(a, b)}.run();
  if (has_exact && answer.status == QueryStatus::budget_exhausted) bound_by_solids(a, b, answer);
  return queries.with_counts(answer);
}

LevelChain::LevelChain(const AssetHeader& a, const AssetHeader& b, double scale) noexcept {
  plan(
      a.detail_count, [&](std::uint32_t i) { return LevelCost::of(matched_tree(a, i)); },
      b.detail_count, [&](std::uint32_t i) { return LevelCost::of(matched_tree(b, i)); }, scale);
}

LevelChain::Weights LevelChain::weights(double coarse, double budget,
                                        const Weights& wanted) const noexcept {
  Weights weights = {};
  share(
      coarse, budget, [&](std::size_t i) { return wanted[i]; },
      [&](std::size_t i, const LevelWeight& weight) { weights[i] = weight; });
  return weights;
}

}  // namespace ist
