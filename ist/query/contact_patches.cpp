#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/base/no_answer.h"
#include "query/base/relative_pose.h"
#include "query/contact/contact_bins.h"
#include "query/contact/write_patches.h"
#include "query/exact/keep_largest.h"
#include "query/lod/level_blend.h"
#include "query/lod/unlike_sizes.h"
#include "query/lod/wanted_error.h"
#include "query/scratch/workspace.h"
#include "query/solid_queries.h"
#include "query/tree_overlap/descent.h"

namespace ist {
namespace {

/// Contact patches of two trees, by lenses.
class LensPatches {
 public:
  LensPatches(const PlacedAsset& a, const TreeHeader& tree_a, const PlacedAsset& b,
              const TreeHeader& tree_b, const RelativePose& pose, Workspace::Impl& scratch)
      : pose_(pose),
        scratch_(scratch),
        tree_a_(a.asset.header(), tree_a),
        tree_b_(b.asset.header(), tree_b),
        of_b_(divides_b(tree_a_.level[0].count, tree_a_.header->root[3], tree_b_.level[0].count,
                        tree_b_.header->root[3] * pose.a_from_b.scale)) {}

  /// Sums the whole contact, and sorts it into the workspace's bins.
  Penetration sum(const DescentLimits& limits) {
    ContactBins& bins = scratch_.contact;
    bins.start(of_b_ ? tree_b_ : tree_a_, of_b_);
    Descent descent(tree_a_, tree_b_, pose_, limits, scratch_, &bins);
    descent.run();
    filled_ = bins.collect(descent.precision());
    return whole_ = descent.penetration();
  }

  const Penetration& whole() const { return whole_; }

  std::size_t write(std::span<ContactPatch> patches) {
    const double radius =
        of_b_ ? tree_b_.header->root[3] * pose_.a_from_b.scale : tree_a_.header->root[3];
    return write_patches({scratch_.contact, filled_, pose_, radius}, whole_, patches);
  }

  double deepest() const {
    return 2 * pose_.unit_a *
           std::min(tree_a_.header->root[3], tree_b_.header->root[3] * pose_.a_from_b.scale);
  }

 private:
  const RelativePose& pose_;
  Workspace::Impl& scratch_;
  const SphereTree tree_a_, tree_b_;
  const bool of_b_;
  Penetration whole_;
  std::uint32_t filled_ = 0;
};

/// The part of a blend with the largest weight: a pair of levels, or the exact measure.
class ChosenPart final : public LargestPart {
 public:
  ChosenPart(const PlacedAsset& a, const PlacedAsset& b, const RelativePose& pose, bool inner,
             Workspace& workspace, std::span<ContactPatch> patches)
      : a_(a), b_(b), pose_(pose), inner_(inner), workspace_(workspace), patches_(patches) {}

  Penetration level(const LevelPair& pair, const DescentLimits& limits) noexcept override {
    levels.emplace(a_, tree_of(a_, pair.a), b_, tree_of(b_, pair.b), pose_, *workspace_.impl());
    return levels->sum(limits);
  }

  Penetration exact(const PenetrationSettings& settings) noexcept override {
    parts = exact_patches(a_, b_, settings, workspace_, patches_, {}, true).contact;
    return parts->penetration;
  }

  // At most one of these:
  std::optional<LensPatches> levels;
  std::optional<ContactPatches> parts;  ///< of the exact measure

 private:
  const TreeHeader& tree_of(const PlacedAsset& placed, std::uint32_t detail) const noexcept {
    const AssetHeader& header = placed.asset.header();
    return inner_ ? header.inner_tree : matched_tree(header, detail);
  }

  const PlacedAsset& a_;
  const PlacedAsset& b_;
  const RelativePose& pose_;
  const bool inner_;
  Workspace& workspace_;
  const std::span<ContactPatch> patches_;
};

}  // namespace

ContactPatches find_patches(const PlacedAsset& a, const PlacedAsset& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  const PairMethod method = pair_method(a, b, settings, pose);
  if (!method.spheres) {
    ContactPatches found = exact_patches(a, b, settings, workspace, patches, {}, true).contact;
    found.penetration = with_error_status(found.penetration, settings);
    return found;
  }
  if (lack_spheres(a, b)) return missing_data<ContactPatches>();
  if (!pose || workspace.impl() == nullptr) return invalid_input<ContactPatches>();
  ContactPatches result;
  const bool inner = settings.measure == Measure::inner;
  ChosenPart chosen(a, b, *pose, inner, workspace, patches);
  bool blends = !inner && asks_levels(a, b, settings);
  result.penetration =
      blends ? blend_levels(a, b, *pose, settings, workspace, exact_penetration, &chosen)
             : chosen.level(LevelPair(), limits_of(settings));
  const ExactWeight weight = exact_weight(method, result.penetration, pose->unit3());
  if (weight.most > 0) {
    blends = true;
    const auto left = left_for_exact(settings, result.penetration.node_visits);
    if (!left) {
      result.penetration = without_exact(a, b, result.penetration);
    } else if (weight.weight >= 0.5) {  // the patches are those of the larger part
      chosen.levels.reset();
      result.penetration = blended(result.penetration, chosen.exact(*left), weight, pose->unit3());
    } else {
      result.penetration =
          blended(result.penetration, exact_penetration(a, b, *left, *pose, workspace), weight,
                  pose->unit3());
    }
  }
  if (std::isnan(result.penetration.volume)) return result;
  if (!chosen.parts && !chosen.levels) return result;
  result.count = chosen.parts ? chosen.parts->count : chosen.levels->write(patches);
  const Penetration& part = chosen.parts ? chosen.parts->penetration : chosen.levels->whole();
  if (blends || result.count == 0)
    result.count = spread(part, result.penetration, result.count, patches);
  // A stopped exact query returns the spheres' patches.
  const bool by_parts = chosen.parts && part.status == QueryStatus::ok;
  finish_patches(patches.first(result.count), b.pose,
                 by_parts        ? exact_deepest(part.volume)
                 : chosen.levels ? chosen.levels->deepest()
                                 : std::numeric_limits<double>::infinity());
  return result;
}

OverlapOutline overlap_outline(const PlacedAsset& a, const PlacedAsset& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches,
                               std::span<OutlineSegment> segments) noexcept {
  return exact_patches(a, b, settings, workspace, patches, segments, false);
}

}  // namespace ist
