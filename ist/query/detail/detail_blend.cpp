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
                const PenetrationSettings& settings, Workspace& workspace,
                LargestPart* largest) noexcept
      : placed_a_(a),
        placed_b_(b),
        a_(a.tree.header()),
        b_(b.tree.header()),
        pose_(pose),
        settings_(settings),
        workspace_(workspace),
        largest_(largest),
        same_asset_(are_one_asset(a_, b_)),
        has_exact_(by_error(settings) && settings.pair_budget == 0 && a.tree.has_mesh() &&
                   b.tree.has_mesh()) {}

  /// The exact measure may answer: nothing limits sphere pairs, which it does not obey.
  bool has_exact() const noexcept { return has_exact_; }
  bool sorts() const noexcept { return largest_ != nullptr; }

  /// The whole sum of a pair of levels, rounded as it may be: where lenses graze they are few, and
  /// the finest level is taken anyway. By lenses alone if it only chooses levels by their cost.
  Penetration coarse_estimate(const DetailPair& pair) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = true;
    return counted(by_error(settings_) ? overlap(pair).by(method_of(pair), limits)
                                       : overlap(pair).by_lenses(limits));
  }

  /// The sum of a pair of levels; of copies of one asset that all but coincide, that of unlike
  /// levels instead. `most`: its weight is the largest.
  Penetration ask(const DetailPair& pair, bool most, bool keep_rounding = false) noexcept {
    const CoincidenceWeight coincidence = coincidence_weight_of(pair);
    if (coincidence.weight == 0) return descend(pair, most, keep_rounding);
    DetailPair unlike[2] = {pair, pair};
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
  bool is_estimate(const DetailPair& pair, bool most) const noexcept {
    return !(most && sorts()) && coincidence_weight_of(pair).weight == 0 &&
           (by_error(settings_) || !method_of(pair).surface);
  }

  /// The exact measure within what is left of the visits.
  Penetration exact(bool most) noexcept {
    const std::uint32_t left = limits_left().max_visits;
    PenetrationSettings settings = settings_;
    settings.measure = Measure::exact;
    settings.max_visits = left == DescentLimits::kNoLimit ? 0 : std::max(left, 1u);
    return counted(most && sorts() ? largest_->exact(settings)
                                   : penetration(placed_a_, placed_b_, settings, workspace_));
  }

  QuickLook look(const DetailPair& pair, bool slopes) const noexcept {
    return quick_look({a_, matched_tree(a_, pair.a)}, {b_, matched_tree(b_, pair.b)},
                      pose_.a_from_b, slopes);
  }

  CoincidenceWeight coincidence_weight_of(const DetailPair& pair) const noexcept {
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
  PairMethod method_of(const DetailPair& pair, SurfaceUse use) const noexcept {
    return pair_method(placed_a_, matched_tree(a_, pair.a), placed_b_, matched_tree(b_, pair.b),
                       pose_, use);
  }

  /// The exact measure stands in where surfaces would help out lenses.
  SurfaceUse use_of(const DetailPair& pair) const noexcept {
    return has_exact_ && settings_.surface == SurfaceUse::automatic &&
                   method_of(pair, SurfaceUse::automatic).lenses
               ? SurfaceUse::never
               : settings_.surface;
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

  Penetration descend(const DetailPair& pair, bool most, bool keep_rounding) noexcept {
    DescentLimits limits = limits_left();
    limits.keep_rounding = keep_rounding;
    return counted(most && sorts() ? largest_->level(pair, use_of(pair), limits)
                                   : overlap(pair).by(method_of(pair), limits));
  }

  const PlacedTree& placed_a_;
  const PlacedTree& placed_b_;
  const AssetHeader& a_;
  const AssetHeader& b_;
  const RelativePose& pose_;
  const PenetrationSettings& settings_;
  Workspace& workspace_;
  LargestPart* const largest_;
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

/// What is known where a limit stopped the coarse estimate: any level might have been meant.
Penetration stopped_blend(DetailQueries& queries, const PlacedTree& a, const PlacedTree& b,
                          const DetailChain& chain, const Penetration& coarse) {
  Penetration result = coarse;
  if (queries.sorts()) queries.ask(chain.coarsest(), true);
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    const Penetration bounds = queries.ask(chain[i], false);
    result.volume_min = std::min(result.volume_min, bounds.volume_min);
    result.volume_max = std::max(result.volume_max, bounds.volume_max);
  }
  if (queries.has_exact()) {
    const double by_spheres = result.volume_max;
    bound_by_solids(a, b, result);
    result.volume_max = std::max(result.volume_max, by_spheres);
  }
  return result;
}

/// Who gives which part of a blend.
struct BlendShares {
  WantedError::Shares wanted;  ///< by errors; nothing is the exact measure's if it can't answer
  DetailChain::Weights weights = {};  ///< of levels: what of `wanted` the pair budget affords
  DetailWeight sure = {};             ///< the finest level's, whatever the coarse estimate is
  bool missed = false;                ///< nothing is exact enough
  std::size_t largest = 0;            ///< level
  bool mostly_exact = false;

  double weight(std::size_t i) const {
    return sure.weight * (i == 0 ? 1 : 0) + (1 - sure.weight) * weights[i].weight;
  }
};

BlendShares share_blend(const DetailChain& chain, const WantedError* wanted, bool has_exact,
                        const DetailWeight& sure, double budget, double estimate) {
  BlendShares shares;
  shares.sure = sure;
  if (wanted != nullptr) shares.wanted = wanted->shares(estimate);
  // Where nothing is exact enough, the finest level is the best.
  DetailWeight& finest = shares.wanted.levels[0];
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
Penetration mix_blend(DetailQueries& queries, const DetailChain& chain, const BlendShares& shares,
                      const Penetration& coarse, const RelativePose& pose,
                      const PenetrationSettings& settings) {
  const double unit3 = pose.unit3();
  const DetailWeight &sure = shares.sure, &rest = shares.wanted.rest;
  const bool rough = coarse.volume_max - coarse.volume_min > kRough * coarse.volume;
  // Where lenses graze, to sum them again in double takes longer than a coarser level saves.
  const bool keep_rounding = shares.weights[0].weight < 1;
  bool missed = shares.missed;
  double slope = 0;       // of the blend by the coarse estimate
  double sure_slope = 0;  // and by the quick look
  Penetration result;
  for (std::size_t i = chain.size(); i-- > 0;) {  // the coarse ones first: they are sure to end
    const DetailWeight& of_rest = shares.weights[i];
    const double weight = shares.weight(i);
    if (weight == 0 && of_rest.slope == 0) continue;
    const bool most = i == shares.largest && !shares.mostly_exact;
    const bool is_coarse = i + 1 == chain.size() && !rough && queries.is_estimate(chain[i], most);
    const Penetration part = is_coarse ? coarse : queries.ask(chain[i], most, keep_rounding);
    add(weight, part, result);
    // At extreme sizes unit3 is 0 or the volume infinite: then a slope of 0 would give NaN.
    if (of_rest.slope != 0) slope += (1 - sure.weight) * of_rest.slope / unit3 * part.volume;
    if (sure.slope != 0)
      sure_slope += sure.slope * ((i == 0 ? 1 : 0) - of_rest.weight) * part.volume;
    // Predictions are of solids that are not in one place, and of levels within the budget.
    missed |= by_error(settings) && (weight < shares.wanted.levels[i].weight ||
                                     queries.coincidence_weight_of(chain[i]).weight > 0);
  }
  if (rest.weight > 0 || rest.slope != 0) {
    const Penetration part = queries.exact(shares.mostly_exact);
    add(rest.weight, part, result);
    if (rest.slope != 0) slope += rest.slope / unit3 * part.volume;
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
    add_slope(queries.look(chain.coarsest(), true).slope, sure_slope, pose, result);
  if (missed && result.volume > 0 && result.status == QueryStatus::ok)
    result.status = QueryStatus::error_exceeded;
  return result;
}

}  // namespace

Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace,
                          LargestPart* largest) noexcept {
  DetailQueries queries(a, b, pose, settings, workspace, largest);
  const bool with_error = by_error(settings);
  if (!with_error && settings.pair_budget == 0) return queries.ask(DetailPair(), true);
  const DetailChain chain(a.tree.header(), b.tree.header(), pose.a_from_b.scale);
  // Nothing to choose, or nothing dear.
  if (!with_error && chain.size() == 1) return queries.ask(chain[0], true);
  DetailWeight sure = {};
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
    return queries.with_counts(stopped_blend(queries, a, b, chain, coarse));
  const BlendShares shares = share_blend(chain, wanted ? &*wanted : nullptr, has_exact, sure,
                                         settings.pair_budget, coarse.volume / pose.unit3());
  return queries.with_counts(mix_blend(queries, chain, shares, coarse, pose, settings));
}

}  // namespace ist
