#include <ist/query.h>

#include "query/base/no_answer.h"
#include "query/detail/coincident.h"
#include "query/detail/detail_blend.h"
#include "query/detail/wanted_error.h"
#include "query/exact_penetration.h"
#include "query/field/pair_overlap.h"
#include "query/solid_queries.h"

namespace ist {

Penetration find_penetration(const PlacedTree& a, const PlacedTree& b,
                             const PenetrationSettings& settings, Workspace& workspace) noexcept {
  // Surfaces alone have no other measure.
  const bool exact =
      settings.measure == Measure::exact || (by_error(settings) && lack_spheres(a, b));
  if (!exact && lack_spheres(a, b)) return not_held<Penetration>();
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<Penetration>();
  if (exact)
    return with_error_status(exact_penetration(a, b, settings, *pose, workspace), settings);
  const AssetHeader& header_a = a.tree.header();
  const AssetHeader& header_b = b.tree.header();
  const bool inner = settings.measure == Measure::inner;
  const TreeHeader& tree_a = inner ? header_a.inner_tree : header_a.matched_tree;
  const TreeHeader& tree_b = inner ? header_b.inner_tree : header_b.matched_tree;
  const SurfaceUse use = inner ? SurfaceUse::never : settings.surface;
  const PairMethod method = pair_method(a, tree_a, b, tree_b, *pose, use);
  if (lacks_surface(method, use)) return not_held<Penetration>();
  if (!inner &&
      (settings.pair_budget > 0 || by_error(settings) || are_one_asset(header_a, header_b))) {
    return blend_details(a, b, *pose, settings, workspace);
  }
  PairOverlap both(a, tree_a, b, tree_b, *pose, *workspace.impl());
  return both.by(method, limits_of(settings));
}

}  // namespace ist
