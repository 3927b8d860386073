#pragma once

#include <ist/query.h>

#include <optional>

#include "query/base/relative_pose.h"
#include "query/descent/descent.h"

namespace ist::testing {

/// What a deadline with time for so many shares of the leaves, of sixteen, would leave: counted,
/// not timed, so that every machine answers the same. Matched measure.
inline Penetration by_shares(const PlacedTree& a, const PlacedTree& b, double shares,
                             Workspace& workspace) {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  const SphereTree tree_a = sphere_tree(a.tree, Measure::matched);
  const SphereTree tree_b = sphere_tree(b.tree, Measure::matched);
  DescentLimits limits;
  limits.shares = shares;
  Descent descent(tree_a, tree_b, *pose, limits, *workspace.impl());
  descent.run();
  return descent.penetration();
}

}  // namespace ist::testing
