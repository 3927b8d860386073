#include <ist/query.h>

#include "query/descent/descent.h"
#include "query/detail/coincident.h"
#include "query/detail/detail_blend.h"

namespace ist {

Penetration penetration(const PlacedTree& a, const PlacedTree& b,
                        const PenetrationSettings& settings, Workspace& workspace) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) {
    Penetration refused;
    refused.status = QueryStatus::invalid_input;
    return refused;
  }
  if (settings.measure == Measure::matched &&
      (settings.pair_budget > 0 || are_one_asset(a.tree.header(), b.tree.header())))
    return blend_details(a, b, *pose, settings, workspace);
  const SphereTree tree_a = sphere_tree(a.tree, settings.measure);
  const SphereTree tree_b = sphere_tree(b.tree, settings.measure);
  Descent descent(tree_a, tree_b, *pose, limits_of(settings), *workspace.impl());
  descent.run();
  return descent.penetration();
}

}  // namespace ist
