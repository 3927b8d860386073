#include "query/detail/detail_blend.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "query/base/solid_bounds.h"
#include "query/detail/coincident.h"
#include "query/detail/detail_chain.h"
#include "query/detail/wanted_error.h"
#include "query/field/pair_overlap.h"
#include "query/kernel/look_kernel.h"

namespace ist {
namespace {

/// Asks pairs of levels one after another under the limits that they share.
class DetailQueries {
 public:
  DetailQueries(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                const PenetrationSettings& settings, Workspace& workspace) noexcept
      : placed_a_(a),
        placed_b_(b),
        a_(a.tree.header()),
        b_(b.tree.header()),
        pose_(pose),
        settings_(settings),
        workspace_(workspace),
        same_asset_(are_one_asset(a_, b_)),
        has_exact_(by_error(settings) && settings.pair_budget == 0 && a.tree.has_mesh() &&
                   b.tree.has_mesh()) {}

  /// The exact measure may answer: nothing limits sphere pairs, which it does not obey.
  bool has_exact() const noexcept { return has_exact_; }

  /// The whole sum of a pair of levels, rounded as it may be: where lenses graze they are few, and
  /// the finest level is taken anyway. By lenses alone if it only chooses levels by their cost.
  Penetration coarse_estimate(const DetailPair& pair) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = true;
    return counted(by_error(settings_) ? overlap(pair).by(method_of(pair), limits)
                                       : overlap(pair).by_lenses(limits));
  }

  /// The sum of a pair of levels; of copies of one asset that all but coincide, that of unlike
  /// levels instead.
  Penetration ask(const DetailPair& pair, bool keep_rounding = false,
                  const BlendSums* most = nullptr) noexcept {
    const CoincidenceWeight coincidence = coincidence_weight_of(pair);
    if (coincidence.weight == 0) return descend(pair, keep_rounding, most);
    DetailPair unlike[2] = {pair, pair};
    unlike[0].b = unlike[1].a = pair.a < a_.detail_count ? pair.a + 1 : pair.a - 1;
    const bool mostly_unlike = coincidence.weight >= 0.5;
    Penetration other = mix(descend(unlike[0], keep_rounding, mostly_unlike ? most : nullptr),
                            descend(unlike[1], keep_rounding), 0.5);
    if (coincidence.weight == 1) return other;
    const Penetration alike = descend(pair, keep_rounding, mostly_unlike ? nullptr : most);
    Penetration mixed = mix(alike, other, coincidence.weight);
    add_slope(coincidence.slope, other.volume - alike.volume, pose_, mixed);
    return mixed;
  }

  /// Whether asking a pair of levels is no more than its coarse estimate.
  bool is_estimate(const DetailPair& pair) const noexcept {
    return coincidence_weight_of(pair).weight == 0 &&
           (by_error(settings_) || !method_of(pair).surface);
  }

  /// The exact measure within what is left of the visits.
  Penetration exact(const BlendSums& sums, bool most) noexcept {
    const std::uint32_t left = limits_left().max_visits;
    const std::uint32_t no_limit = 0;
    return counted(sums.exact(
        sums.context, left == DescentLimits::kNoLimit ? no_limit : std::max(left, 1u), most));
  }

  CoincidenceWeight coincidence_weight_of(const DetailPair& pair) const noexcept {
    if (!same_asset_ || pair.a != pair.b) return {};
    const TreeHeader& tree = matched_tree(a_, pair.a);
    return coincidence_weight(tree.root, tree.mean_radius, pose_.a_from_b);
  }

  std::uint32_t visits() const noexcept { return visits_; }
  std::uint32_t pairs() const noexcept { return pairs_; }

 private:
  PairMethod method_of(const DetailPair& pair, FieldUse use) const noexcept {
    return pair_method(placed_a_, matched_tree(a_, pair.a), placed_b_, matched_tree(b_, pair.b),
                       pose_, use);
  }

  /// The exact measure stands in where surfaces would help out lenses.
  FieldUse use_of(const DetailPair& pair) const noexcept {
    return has_exact_ && settings_.field == FieldUse::automatic &&
                   method_of(pair, FieldUse::automatic).lenses
               ? FieldUse::never
               : settings_.field;
  }

  PairMethod method_of(const DetailPair& pair) const noexcept {
    return method_of(pair, use_of(pair));
  }

  /// Nothing but the roots is looked at once visits are spent.
  DescentLimits limits_left() const noexcept {
    DescentLimits limits = limits_of(settings_);
    limits.spend(visits_);
    return limits;
  }

  PairOverlap overlap(const DetailPair& pair) const noexcept {
    return {placed_a_, matched_tree(a_, pair.a), placed_b_, matched_tree(b_, pair.b),
            pose_,     *workspace_.impl()};
  }

  Penetration counted(const Penetration& answer) noexcept {
    visits_ += answer.node_visits;
    pairs_ += answer.sphere_pairs;
    return answer;
  }

  Penetration descend(const DetailPair& pair, bool keep_rounding,
                      const BlendSums* by = nullptr) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = keep_rounding;
    return counted(by != nullptr ? by->level(by->context, pair, use_of(pair), limits)
                                 : overlap(pair).by(method_of(pair), limits));
  }

  const PlacedTree& placed_a_;
  const PlacedTree& placed_b_;
  const AssetHeader& a_;
  const AssetHeader& b_;
  const RelativePose& pose_;
  const PenetrationSettings& settings_;
  Workspace& workspace_;
  const bool same_asset_;
  const bool has_exact_;
  std::uint32_t visits_ = 0, pairs_ = 0;
};

// A coarse estimate whose bounds are further apart than this part of it is too rough for an answer.
constexpr double kRough = 5e-4;

/// Adds a part of a blend.
void add(double weight, const Penetration& part, Penetration& sum) {
  sum.volume += weight * part.volume;
  sum.volume_min += weight * part.volume_min;
  sum.volume_max += weight * part.volume_max;
  if (sum.volume > 0)
    sum.centroid += (weight * part.volume / sum.volume) * (part.centroid - sum.centroid);
  sum.translation_gradient += weight * part.translation_gradient;
  sum.rotation_gradient += weight * part.rotation_gradient;
  sum.status = std::max(sum.status, part.status);
}

}  // namespace

Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace,
                          const BlendSums& sums) noexcept {
  DetailQueries queries(a, b, pose, settings, workspace);
  const BlendSums* const most = sums.level != nullptr ? &sums : nullptr;
  const bool with_error = by_error(settings);
  if (!with_error && settings.pair_budget == 0) return queries.ask(DetailPair(), false, most);
  const DetailChain chain(a.tree.header(), b.tree.header(), pose.a_from_b.scale);
  // Nothing to choose, or nothing dear.
  if (!with_error && chain.size() == 1) return queries.ask(chain[0], false, most);
  const SphereTree coarse_a(a.tree.header(), matched_tree(a.tree.header(), chain.coarsest().a));
  const SphereTree coarse_b(b.tree.header(), matched_tree(b.tree.header(), chain.coarsest().b));
  DetailWeight sure = {};
  if (!with_error) {
    const QuickLook look = quick_look(coarse_a, coarse_b, pose.a_from_b, false);
    sure = chain.quick_weight(look.volume, settings.pair_budget);
    if (sure.weight == 1) return queries.ask(chain[0], false, most);
  }
  const bool has_exact = queries.has_exact();
  std::optional<WantedError> wanted;
  if (with_error) wanted.emplace(a, b, pose, settings, chain, has_exact);
  if (has_exact && !wanted->by_spheres())
    return with_error_status(queries.exact(sums, true), settings);

  // Whatever else is asked, the coarse estimate is the whole sum: only that is smooth.
  const Penetration coarse = queries.coarse_estimate(chain.coarsest());
  Penetration result;
  if (coarse.status != QueryStatus::ok) {
    // Stopped here, any level might have been meant.
    result = coarse;
    if (most != nullptr) queries.ask(chain.coarsest(), false, most);
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      const Penetration bounds = queries.ask(chain[i]);
      result.volume_min = std::min(result.volume_min, bounds.volume_min);
      result.volume_max = std::max(result.volume_max, bounds.volume_max);
    }
    if (has_exact) {
      const double by_spheres = result.volume_max;
      bound_by_solids(a, b, result);
      result.volume_max = std::max(result.volume_max, by_spheres);
    }
  } else {
    const double unit3 = pose.unit_a * pose.unit_a * pose.unit_a;
    const double estimate = coarse.volume / unit3;
    WantedError::Shares shares;
    if (with_error) shares = wanted->shares(estimate);
    // Where nothing is exact enough, the finest level is the best.
    bool missed = with_error && !has_exact && shares.rest.weight > 0;
    if (!has_exact) shares.levels[0] = shares.levels[0] + std::exchange(shares.rest, {});
    DetailChain::Weights weights = shares.levels;
    if (settings.pair_budget > 0)
      weights = chain.weights(estimate, settings.pair_budget, shares.levels);
    const bool rough = coarse.volume_max - coarse.volume_min > kRough * coarse.volume;
    // Where lenses graze, to sum them again in double takes longer than a coarser level saves.
    const bool keep_rounding = weights[0].weight < 1;
    double slope = 0;       // of the blend by the coarse estimate
    double sure_slope = 0;  // and by the quick look
    const auto weight_of = [&](std::size_t i) {
      return sure.weight * (i == 0 ? 1 : 0) + (1 - sure.weight) * weights[i].weight;
    };
    std::size_t largest = 0;
    for (std::size_t i = 1; i < chain.size(); ++i)
      if (weight_of(i) > weight_of(largest)) largest = i;
    const bool mostly_exact = shares.rest.weight > weight_of(largest);
    for (std::size_t i = chain.size(); i-- > 0;) {  // the coarse ones first: they are sure to end
      const double alone = i == 0 ? 1 : 0;
      const double weight = weight_of(i);
      if (weight == 0 && weights[i].slope == 0) continue;
      const BlendSums* const by = i == largest && !mostly_exact ? most : nullptr;
      const bool is_coarse = i + 1 == chain.size() && !rough && by == nullptr;
      const Penetration part = is_coarse && queries.is_estimate(chain[i])
                                   ? coarse
                                   : queries.ask(chain[i], keep_rounding, by);
      add(weight, part, result);
      // At extreme sizes nought times the volume need not be nought.
      if (weights[i].slope != 0)
        slope += (1 - sure.weight) * weights[i].slope / unit3 * part.volume;
      if (sure.slope != 0) sure_slope += sure.slope * (alone - weights[i].weight) * part.volume;
      // Predictions are of solids that are not in one place, and of levels within the budget.
      missed |= with_error && (weight < shares.levels[i].weight ||
                               queries.coincidence_weight_of(chain[i]).weight > 0);
    }
    if (shares.rest.weight > 0 || shares.rest.slope != 0) {
      const Penetration part = queries.exact(sums, mostly_exact);
      add(shares.rest.weight, part, result);
      if (shares.rest.slope != 0) slope += shares.rest.slope / unit3 * part.volume;
      missed |= with_error_status(part, settings).status == QueryStatus::error_exceeded;
    }
    // The coarse estimate is rounded too, and with it the weights.
    if (slope != 0) {
      const double doubt = std::abs(slope) * (coarse.volume_max - coarse.volume_min);
      result.volume_min = std::max(0.0, result.volume_min - doubt);
      result.volume_max += doubt;
      result.translation_gradient += slope * coarse.translation_gradient;
      result.rotation_gradient += slope * coarse.rotation_gradient;
    }
    if (sure_slope != 0)
      add_slope(quick_look(coarse_a, coarse_b, pose.a_from_b, true).slope, sure_slope, pose,
                result);
    if (missed && result.volume > 0 && result.status == QueryStatus::ok)
      result.status = QueryStatus::error_exceeded;
  }
  result.node_visits = queries.visits();
  result.sphere_pairs = queries.pairs();
  return result;
}

}  // namespace ist
