#include <ist/query.h>

#include "query/base/no_answer.h"
#include "query/lod/level_blend.h"
#include "query/lod/unlike_sizes.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

Penetration by_spheres(const PlacedAsset& a, const PlacedAsset& b,
                       const PenetrationSettings& settings, const RelativePose& pose,
                       Workspace& workspace) noexcept {
  const AssetHeader &header_a = a.asset.header(), &header_b = b.asset.header();
  const bool inner = settings.measure == Measure::inner;
  if (!inner && asks_levels(a, b, settings))
    return blend_levels(a, b, pose, settings, workspace, exact_penetration);
  return lens_sum(a, inner ? header_a.inner_tree : header_a.matched_tree, b,
                  inner ? header_b.inner_tree : header_b.matched_tree, pose, limits_of(settings),
                  *workspace.impl());
}

}  // namespace

Penetration find_penetration(const PlacedAsset& a, const PlacedAsset& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  const PairMethod method = pair_method(a, b, settings, pose);
  if (method.spheres && lack_spheres(a, b)) return missing_data<Penetration>();
  if (!pose || workspace.impl() == nullptr) return invalid_input<Penetration>();
  if (!method.spheres)
    return with_error_status(exact_penetration(a, b, settings, *pose, workspace), settings);
  const Penetration spheres = by_spheres(a, b, settings, *pose, workspace);
  const ExactWeight weight = exact_weight(method, spheres, pose->unit3());
  if (weight.most == 0) return spheres;
  const std::optional<PenetrationSettings> left = left_for_exact(settings, spheres.node_visits);
  if (!left) return without_exact(a, b, spheres);
  return blended(spheres, exact_penetration(a, b, *left, *pose, workspace), weight, pose->unit3());
}

}  // namespace ist
