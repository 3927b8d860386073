#include <optional>

#include "query/base/no_answer.h"
#include "query/contact/write_patches.h"
#include "query/shape/gap_search.h"
#include "query/shape/overlap_search.h"
#include "query/shape/shape_descent.h"
#include "query/shape/with_shape.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

/// `tree`: of B, which bins refer to.
Penetration penetrate(const PlacedShape& a, const SphereTree& tree,
                      const std::optional<RelativePose>& pose, const DescentLimits& limits,
                      Workspace& workspace, ContactBins* bins) noexcept {
  if (!pose || workspace.impl() == nullptr) return invalid_input<Penetration>();
  if (bins != nullptr) bins->start(tree, true);
  return with_shape(
      a.shape,
      [&](auto& shape) {
        ShapeDescent descent(shape, tree, *pose, limits, *workspace.impl(), bins);
        descent.run();
        return descent.penetration();
      },
      invalid_input<Penetration>);
}

}  // namespace

Penetration find_penetration(const PlacedShape& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept {
  if (settings.measure == Measure::exact || lack_spheres(a, b)) return missing_data<Penetration>();
  return penetrate(a, sphere_tree(b.asset, settings.measure), relative_pose(a.pose, a.scale, b),
                   limits_of(settings), workspace, nullptr);
}

Separation find_separation(const PlacedShape& a, const PlacedAsset& b,
                           const SeparationSettings& settings, Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return missing_data<Separation>();
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<Separation>();
  const SphereTree tree = sphere_tree(b.asset, Measure::inner);
  const auto search = [&](auto& shape) {
    const Separation gap = GapSearch(shape, tree, *pose, settings, *workspace.impl()).run();
    const bool farther = settings.max_distance > 0 && gap.distance_min > settings.max_distance;
    return farther ? farther_than(settings.max_distance) : gap;
  };
  return with_shape(a.shape, search, invalid_input<Separation>);
}

YesNoAnswer find_overlap(const PlacedShape& a, const PlacedAsset& b,
                         Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return {YesNo::unknown, QueryStatus::missing_data};
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  if (!pose || workspace.impl() == nullptr) return {YesNo::unknown, QueryStatus::invalid_input};
  const SphereTree tree = sphere_tree(b.asset, Measure::inner);
  const auto search = [&](auto& shape) {
    return YesNoAnswer{ShapeOverlapSearch(shape, tree, *pose, *workspace.impl()).run(),
                       QueryStatus::ok};
  };
  return with_shape(a.shape, search, [] {
    return YesNoAnswer{YesNo::unknown, QueryStatus::invalid_input};
  });
}

ContactPatches find_patches(const PlacedShape& a, const PlacedAsset& b,
                            const ContactSettings& settings, Workspace& workspace,
                            std::span<ContactPatch> patches) noexcept {
  if (settings.measure == Measure::exact || lack_spheres(a, b))
    return missing_data<ContactPatches>();
  if (workspace.impl() == nullptr) return invalid_input<ContactPatches>();
  ContactPatches result;
  ContactBins& bins = workspace.impl()->contact;
  const SphereTree tree = sphere_tree(b.asset, settings.measure);
  const std::optional<RelativePose> pose = relative_pose(a.pose, a.scale, b);
  result.penetration = penetrate(a, tree, pose, limits_of(settings), workspace, &bins);
  if (result.penetration.status == QueryStatus::invalid_input) return result;
  const double radius = tree.header->root[3] * pose->a_from_b.scale;
  result.count = write_patches({bins, bins.collect(Precision::float64), *pose, radius},
                               result.penetration, patches);
  finish_patches(patches.first(result.count), b.pose, 2 * pose->unit_a * radius);
  return result;
}

}  // namespace ist
