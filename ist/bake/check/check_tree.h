#pragma once

#include <string>
#include <vector>

#include <ist/bake.h>

#include <ist/asset_layout.h>

namespace ist {

/// One tree against the table of its spheres: leaves, balls, cover balls, volumes and κ. `covers`
/// is null for the matched tree.
std::vector<Invariant> check_tree(const AssetHeader& asset, const TreeHeader& tree,
                                  const Sphere* spheres, const float* covers,
                                  const std::string& name);

}  // namespace ist
