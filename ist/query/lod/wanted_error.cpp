#include "query/lod/wanted_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/elementary.h"
#include "query/lod/unlike_sizes.h"

namespace ist {
namespace {

// A sum of lenses over n solid spheres (solid_volume()) errs by less than kErrorOfOne · n^(-8/9) in
// 19 of 20 random poses, and by a third of that in the median. Fitted to assets of 468 to 30,000
// spheres in poses of seven pairs of solids (`benchmarks/run.sh wanted_error`).
constexpr double kErrorOfOne = 0.09;
constexpr double kMostOverMedian = 3;
// In deep contact forces cancel and err by more than volumes. They err by 1° at 0.5 % if the
// required overlap grows by this factor per share of the smaller solid; only for levels with a
// finer one.
constexpr double kDeep = 4.5;

// The fraction of a level's required overlap from which on it is blended in.
constexpr double kTooRough = 0.7;

// Surfaces cross in kCrossings (√T_A (V/V_A)^⅜ + √T_B (V/V_B)^⅜) triangles, T being their numbers.
// A crossing costs as much as kPairsOfCrossing pairs of spheres; spheres must save kPairsSaved.
constexpr double kCrossings = 4.5, kPairsOfCrossing = 28, kPairsSaved = 250;
// Costs are compared at this multiple of a level's required overlap: the next coarser level takes
// over at four.
constexpr double kCompared = 2;

// A level is compared with one whose spheres are larger by at least this fraction …
constexpr double kLeastWider = 0.3;
// … and trusted up to this square of the derived error over the accepted one, from the second on
// not at all. In between a blend with the truth errs by no more than accepted.
constexpr double kTrusted2 = 0.75, kDistrusted2 = 3;

double eighth_root(double x) { return std::sqrt(std::sqrt(std::sqrt(x))); }

/// The number of spheres for an error, from the error of one: (error_of_one / error)^(9/8).
double spheres_for(double error_of_one, double error) {
  const double times = error_of_one / error;
  return times * eighth_root(times);
}

/// The number of solid spheres that an overlap needs for an error. Interpolates the errors that the
/// bake measured, if any: their inverse is nearly linear in the number.
double spheres_needed(const AssetHeader& asset, double error) {
  const TreeHeader& tree = asset.matched_tree;
  const double all = tree.volume_sum / solid_volume(asset, tree);
  double before = 0, error_before = 0;
  for (std::uint32_t k = kOverlapClasses; asset.predicted_poses > 0 && k-- > 1;) {
    const double here = kMostOverMedian * asset.predicted_error[k];
    if (!(here > 0)) continue;
    const double middle =
        std::sqrt(kOverlapClassFloor[k] * (k > 1 ? kOverlapClassFloor[k - 1] : 0.5));
    const double spheres = middle * all;
    if (here <= error) {
      if (before == 0) return spheres * spheres_for(here, error);
      const double part = (1 / error - 1 / error_before) / (1 / here - 1 / error_before);
      return before + (spheres - before) * part;
    }
    before = spheres;
    error_before = here;
  }
  return before > 0 ? before * spheres_for(error_before, error) : spheres_for(kErrorOfOne, error);
}

/// The approximate number of triangles that cross the other surface. `share`: of the volume.
double crossings(const AssetHeader& asset, double share) {
  const double root = std::sqrt(share), quarter = std::sqrt(root);
  return kCrossings *
         std::sqrt(static_cast<double>(at<MeshHeader>(asset, asset.mesh)->triangle_count)) *
         (quarter * std::sqrt(quarter));
}

}  // namespace

double solid_volume(const AssetHeader& asset, const TreeHeader& tree) noexcept {
  const double left_out = 1 / covered_part(asset) - 1;
  const double wider = 1 + left_out * tree.mean_radius / asset.matched_tree.mean_radius;
  return tree.volume_sum / tree.sphere_count * (wider * wider * wider);
}

WantedError::WantedError(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose,
                         const PenetrationSettings& settings, const LevelChain& chain,
                         bool exact) noexcept
    : error_(std::min(settings.relative_error, 1.0)), size_(chain.size()) {
  const AssetHeader& asset_a = a.asset.header();
  const AssetHeader& asset_b = b.asset.header();
  const double scale3 = pose.a_from_b.scale * pose.a_from_b.scale * pose.a_from_b.scale;
  for (std::size_t i = 0; i < size_; ++i) {
    const TreeHeader& tree_a = matched_tree(asset_a, chain[i].a);
    const TreeHeader& tree_b = matched_tree(asset_b, chain[i].b);
    const std::uint32_t coarser_a = std::min(chain[i].a + 1, asset_a.detail_count);
    const std::uint32_t coarser_b = std::min(chain[i].b + 1, asset_b.detail_count);
    const TreeHeader& wide_a = matched_tree(asset_a, coarser_a);
    const TreeHeader& wide_b = matched_tree(asset_b, coarser_b);
    coarser_[i] = detail_pair(coarser_a, LevelCost::of(wide_a), coarser_b, LevelCost::of(wide_b),
                              pose.a_from_b.scale);
    const auto both = [&](double of_a, double of_b) {
      return std::sqrt((of_a * of_a + of_b * of_b) / 2);
    };
    wider_[i] = both(wide_a.mean_radius, wide_b.mean_radius * pose.a_from_b.scale) /
                    both(tree_a.mean_radius, tree_b.mean_radius * pose.a_from_b.scale) -
                1;
    // The overlap from which on two levels are predicted to err by less than `error`.
    const auto overlap_for = [&](const TreeHeader& of_a, const TreeHeader& of_b, double error) {
      const double overlap =
          both(spheres_needed(asset_a, error) * solid_volume(asset_a, of_a),
               spheres_needed(asset_b, error) * solid_volume(asset_b, of_b) * scale3);
      return i == 0 ? overlap
                    : overlap *
                          (1 + kDeep * overlap / std::min(asset_a.volume, asset_b.volume * scale3));
    };
    double& from = from_[i];
    from = overlap_for(tree_a, tree_b, error_);
    if (wider_[i] >= kLeastWider) {
      // A level that the coarser one does not confirm costs two answers. At least half of the poses
      // confirm it once the coarser one's median error is small enough.
      from = std::max(from, overlap_for(wide_a, wide_b, kMostOverMedian * wider_[i] * error_));
    } else {
      from = std::numeric_limits<double>::infinity();
    }
    if (!exact) continue;
    const double compared = kCompared * from;
    const double crossing = crossings(asset_a, std::min(1.0, compared / asset_a.volume)) +
                            crossings(asset_b, std::min(1.0, compared / (asset_b.volume * scale3)));
    const double pairs = expected_pairs(chain[i], compared) + expected_pairs(coarser_[i], compared);
    if (!(pairs + kPairsSaved < kPairsOfCrossing * crossing))
      from = std::numeric_limits<double>::infinity();
  }
}

bool WantedError::by_spheres() const noexcept {
  return std::any_of(from_.begin(), from_.begin() + size_,
                     [](double from) { return std::isfinite(from); });
}

WantedError::Shares WantedError::shares(double coarse) const noexcept {
  Shares shares;
  LevelWeight& rest = shares.rest;
  for (std::size_t i = size_; i-- > 0;) {
    const double from = from_[i];
    // (a damaged asset's NaN is never accurate enough)
    const double t = coarse > kTooRough * from
                         ? std::min((coarse / from - kTooRough) / (1 - kTooRough), 1.0)
                         : 0;
    const LevelWeight part{smooth_step(t), t < 1 ? smooth_slope(t) / ((1 - kTooRough) * from) : 0};
    shares.levels[i] = rest * part;
    rest = rest * complement(part);
  }
  return shares;
}

LevelTrust WantedError::trust(std::size_t i, double own, double other, double most) const noexcept {
  const double accepted = error_ * wider_[i] * own;
  const double difference = other - own, excess = own - most;
  // (also for volumes of 0 or infinity)
  if (!(std::abs(difference) < 2 * accepted) || !(excess < 2 * error_ * most)) return {};
  const double x = difference / accepted, y = excess > 0 ? excess / (error_ * most) : 0;
  const double t = (x * x + y * y - kTrusted2) / (kDistrusted2 - kTrusted2);
  LevelTrust trust{1 - smooth_step(t)};
  if (!(t > 0 && t < 1)) return trust;
  const double slope = -2 * smooth_slope(t) / (kDistrusted2 - kTrusted2);
  trust.by_own = slope * (y / (error_ * most) - x * (other / own) / accepted);
  trust.by_other = slope * x / accepted;
  return trust;
}

}  // namespace ist
