#include "query/detail/detail_blend.h"

#include <algorithm>
#include <cmath>

#include "query/detail/coincident.h"
#include "query/detail/detail_chain.h"
#include "query/field/pair_overlap.h"
#include "query/kernel/look_kernel.h"

namespace ist {
namespace {

/// How the sum of a pair of levels is asked for.
struct AskedFor {
  double relative_error = 0;
  bool keep_rounding = false;
};

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
        same_asset_(are_one_asset(a_, b_)) {}

  /// The whole sum of a pair of levels, rounded as it may be: where lenses graze they are few, and
  /// the finest level is taken anyway.
  Penetration coarse_estimate(const DetailPair& pair) noexcept {
    DescentLimits limits = limits_left();
    limits.relative_error = 0;
    limits.keep_rounding = true;
    return counted(overlap(pair).by_lenses(limits));
  }

  /// The sum of a pair of levels; of copies of one asset that all but coincide, that of unlike
  /// levels instead.
  Penetration ask(const DetailPair& pair, const AskedFor& how,
                  const LevelSum* most = nullptr) noexcept {
    const CoincidenceWeight coincidence = coincidence_weight_of(pair);
    if (coincidence.weight == 0) return descend(pair, how, most);
    DetailPair unlike[2] = {pair, pair};
    unlike[0].b = unlike[1].a = pair.a < a_.detail_count ? pair.a + 1 : pair.a - 1;
    const bool mostly_unlike = coincidence.weight >= 0.5;
    Penetration other =
        mix(descend(unlike[0], how, mostly_unlike ? most : nullptr), descend(unlike[1], how), 0.5);
    if (coincidence.weight == 1) return other;
    const Penetration alike = descend(pair, how, mostly_unlike ? nullptr : most);
    Penetration mixed = mix(alike, other, coincidence.weight);
    add_slope(coincidence.slope, other.volume - alike.volume, pose_, mixed);
    return mixed;
  }

  /// Whether asking a pair of levels is no more than its sum of lenses.
  bool by_lenses_alone(const DetailPair& pair) const noexcept {
    return coincidence_weight_of(pair).weight == 0 && !method_of(pair).exact;
  }

  CoincidenceWeight coincidence_weight_of(const DetailPair& pair) const noexcept {
    return same_asset_ && pair.a == pair.b
               ? coincidence_weight(matched_tree(a_, pair.a), pose_.a_from_b)
               : CoincidenceWeight{};
  }

  std::uint32_t visits() const noexcept { return visits_; }
  std::uint32_t pairs() const noexcept { return pairs_; }

 private:
  PairMethod method_of(const DetailPair& pair) const noexcept {
    return pair_method(placed_a_, matched_tree(a_, pair.a), placed_b_, matched_tree(b_, pair.b),
                       pose_, settings_.field);
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

  Penetration descend(const DetailPair& pair, const AskedFor& how,
                      const LevelSum* by = nullptr) noexcept {
    DescentLimits limits = limits_left();
    limits.relative_error = how.relative_error;
    limits.keep_rounding = how.keep_rounding;
    return counted(by != nullptr ? by->sum(by->context, pair, limits)
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
  std::uint32_t visits_ = 0, pairs_ = 0;
};

// A coarse estimate whose bounds are further apart than this part of it is too rough for an answer.
constexpr double kRough = 5e-4;

}  // namespace

Penetration blend_details(const PlacedTree& a, const PlacedTree& b, const RelativePose& pose,
                          const PenetrationSettings& settings, Workspace& workspace,
                          const LevelSum* most) noexcept {
  DetailQueries queries(a, b, pose, settings, workspace);
  AskedFor how{settings.relative_error, false};
  if (settings.pair_budget == 0) return queries.ask(DetailPair(), how, most);
  const DetailChain chain(a.tree.header(), b.tree.header(), pose.a_from_b.scale);
  // Nothing to choose, or nothing dear.
  if (chain.size() == 1) return queries.ask(chain[0], how, most);
  const SphereTree coarse_a(a.tree.header(), matched_tree(a.tree.header(), chain.coarsest().a));
  const SphereTree coarse_b(b.tree.header(), matched_tree(b.tree.header(), chain.coarsest().b));
  const QuickLook look = quick_look(coarse_a, coarse_b, pose.a_from_b, false);
  const DetailWeight sure = chain.quick_weight(look.volume, settings.pair_budget);
  if (sure.weight == 1) return queries.ask(chain[0], how, most);

  // Whatever else is asked, the coarse estimate is the whole sum: only that is smooth.
  const Penetration coarse = queries.coarse_estimate(chain.coarsest());
  Penetration result;
  if (coarse.status != QueryStatus::ok) {
    // Stopped here, any level might have been meant.
    result = coarse;
    if (most != nullptr) queries.ask(chain.coarsest(), {}, most);
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
      const Penetration bounds = queries.ask(chain[i], {});
      result.volume_min = std::min(result.volume_min, bounds.volume_min);
      result.volume_max = std::max(result.volume_max, bounds.volume_max);
    }
  } else {
    const double unit3 = pose.unit_a * pose.unit_a * pose.unit_a;
    const DetailChain::Weights weights = chain.weights(coarse.volume / unit3, settings.pair_budget);
    const bool rough = coarse.volume_max - coarse.volume_min > kRough * coarse.volume;
    // Where lenses graze, to sum them again in double takes longer than a coarser level saves.
    how.keep_rounding = weights[0].weight < 1;
    double slope = 0;       // of the blend by the coarse estimate
    double sure_slope = 0;  // and by the quick look
    const auto weight_of = [&](std::size_t i) {
      return sure.weight * (i == 0 ? 1 : 0) + (1 - sure.weight) * weights[i].weight;
    };
    std::size_t largest = 0;
    for (std::size_t i = 1; i < chain.size(); ++i)
      if (weight_of(i) > weight_of(largest)) largest = i;
    for (std::size_t i = chain.size(); i-- > 0;) {  // the coarse ones first: they are sure to end
      const double alone = i == 0 ? 1 : 0;
      const double weight = weight_of(i);
      if (weight == 0 && weights[i].slope == 0) continue;
      const LevelSum* const by = i == largest ? most : nullptr;
      const bool is_coarse = i + 1 == chain.size() && !rough && by == nullptr;
      const Penetration part =
          is_coarse && queries.by_lenses_alone(chain[i]) ? coarse : queries.ask(chain[i], how, by);
      result.volume += weight * part.volume;
      result.volume_min += weight * part.volume_min;
      result.volume_max += weight * part.volume_max;
      if (result.volume > 0)
        result.centroid +=
            (weight * part.volume / result.volume) * (part.centroid - result.centroid);
      result.translation_gradient += weight * part.translation_gradient;
      result.rotation_gradient += weight * part.rotation_gradient;
      result.status = std::max(result.status, part.status);
      // At extreme sizes nought times the volume need not be nought.
      if (weights[i].slope != 0)
        slope += (1 - sure.weight) * weights[i].slope / unit3 * part.volume;
      if (sure.slope != 0) sure_slope += sure.slope * (alone - weights[i].weight) * part.volume;
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
  }
  result.node_visits = queries.visits();
  result.sphere_pairs = queries.pairs();
  return result;
}

}  // namespace ist
