#include <Eigen/Geometry>
#include <algorithm>
#include <optional>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/base/no_answer.h"
#include "query/contact/contact_bins.h"
#include "query/contact/write_patches.h"
#include "query/descent/descent.h"
#include "query/descent/workspace.h"
#include "query/exact_penetration.h"
#include "query/field/pair_overlap.h"

namespace ist {
namespace {

/// Whether contacts are divided along B's tree: the smaller solid's, whose contacts stay with its
/// own corners while it slides, or the only one fine enough. The pose has no say.
bool divides_b(const SphereTree& a, double radius_a, const SphereTree& b, double radius_b) {
  const std::uint32_t blocks_a = a.level[0].count;
  const std::uint32_t blocks_b = b.level[0].count;
  const std::uint32_t fewer = std::min(blocks_a, blocks_b);
  if (fewer < kFewContactBlocks && blocks_a != blocks_b) return blocks_b > blocks_a;
  return radius_b <= radius_a;
}

/// Contact patches of two trees, by the method that penetration() takes.
class PairPatches {
 public:
  PairPatches(const PlacedTree& a, const PlacedTree& b, const ContactSettings& settings,
              const RelativePose& pose, Workspace::Impl& scratch)
      : a_(a),
        b_(b),
        pose_(pose),
        limits_(limits_of(settings)),
        scratch_(scratch),
        tree_a_(sphere_tree(a.tree, settings.measure)),
        tree_b_(sphere_tree(b.tree, settings.measure)),
        both_(a, *tree_a_.header, b, *tree_b_.header, pose, scratch),
        use_(settings.measure == Measure::inner ? FieldUse::never : settings.field),
        method_(pair_method(a, *tree_a_.header, b, *tree_b_.header, pose, use_)) {}

  ContactPatches run(std::span<ContactPatch> patches) {
    if (lacks_surface(method_, use_)) return not_held<ContactPatches>();
    ContactPatches result;
    ContactBins& bins = scratch_.contact;
    if (!method_.lenses) {
      start_probed();
      result.penetration = both_.exact(method_.b_probes, limits_, &bins);
      result.count = write_probed(result.penetration, patches);
      return result;
    }
    const Stopwatch time(limits_);
    const double radius_a = tree_a_.header->root[3];
    const double radius_b = tree_b_.header->root[3] * pose_.a_from_b.scale;
    const bool of_b = divides_b(tree_a_, radius_a, tree_b_, radius_b);
    bins.start(of_b ? tree_b_ : tree_a_, of_b);
    Descent descent(tree_a_, tree_b_, pose_, limits_, scratch_, &bins);
    descent.run();
    const std::uint32_t filled = bins.collect(descent.precision());
    const Penetration lenses = descent.penetration();
    const double unit3 = pose_.unit_a * pose_.unit_a * pose_.unit_a;
    const ExactWeight weight = exact_weight(method_, lenses, unit3);
    const std::optional<DescentLimits> left = PairOverlap::left_by(lenses, limits_, time);
    // The patches are those of the larger part.
    if (left && weight.weight >= 0.5) {
      start_probed();
      result.penetration = both_.with_exact(method_, lenses, weight, *left, &bins);
      result.count = write_probed(result.penetration, patches);
      return result;
    }
    result.penetration = weight.most == 0 ? lenses
                         : left           ? both_.with_exact(method_, lenses, weight, *left)
                                          : both_.without_exact(method_, lenses);
    result.count = write_patches({bins, filled, pose_, of_b ? radius_b : radius_a},
                                 result.penetration, patches);
    return result;
  }

  double deepest() const {
    return 2 * pose_.unit_a *
           std::min(tree_a_.header->root[3], tree_b_.header->root[3] * pose_.a_from_b.scale);
  }

 private:
  /// Bins for the spheres that probe.
  void start_probed() { scratch_.contact.start(method_.b_probes ? tree_b_ : tree_a_, true); }

  /// The patches of the spheres that probed.
  std::size_t write_probed(const Penetration& whole, std::span<ContactPatch> patches) {
    const std::uint32_t filled = scratch_.contact.collect(Precision::float64);
    if (method_.b_probes)
      return write_patches(
          {scratch_.contact, filled, pose_, tree_b_.header->root[3] * pose_.a_from_b.scale}, whole,
          patches);
    // A's spheres probe B: the patches come as pushes on A.
    const std::optional<RelativePose> turned = relative_pose(b_, a_);
    if (!turned) return 0;
    const std::size_t count = write_patches(
        {scratch_.contact, filled, *turned, tree_a_.header->root[3] * turned->a_from_b.scale},
        turned_over(whole, b_, a_), patches);
    Eigen::Vector3d between;
    for (int k = 0; k < 3; ++k) between[k] = a_.pose.t[k] - b_.pose.t[k];
    for (ContactPatch& patch : patches.first(count)) {
      patch.torque = -(patch.torque + between.cross(patch.force));
      patch.force = -patch.force;
    }
    return count;
  }

  const PlacedTree& a_;
  const PlacedTree& b_;
  const RelativePose& pose_;
  const DescentLimits limits_;
  Workspace::Impl& scratch_;
  const SphereTree tree_a_, tree_b_;
  PairOverlap both_;
  const FieldUse use_;
  const PairMethod method_;
};

}  // namespace

ContactPatches contact_patches(const PlacedTree& a, const PlacedTree& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept {
  if (settings.measure == Measure::exact)
    return exact_patches(a, b, settings, workspace, patches, {}).contact;
  if (lack_spheres(a, b)) return not_held<ContactPatches>();
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<ContactPatches>();
  PairPatches both(a, b, settings, *pose, *workspace.impl());
  const ContactPatches result = both.run(patches);
  finish_patches(patches.first(result.count), both.deepest());
  return result;
}

OverlapOutline overlap_outline(const PlacedTree& a, const PlacedTree& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches,
                               std::span<OutlineSegment> segments) noexcept {
  return exact_patches(a, b, settings, workspace, patches, segments);
}

}  // namespace ist
