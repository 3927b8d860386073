#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>

#include <string>
#include <utility>
#include <vector>

#include "bake/check/checked_mesh.h"

namespace ist {

inline Eigen::Vector3d centre(const Sphere& s) { return {s.x, s.y, s.z}; }

/// One tree against the table of its spheres: leaves, balls, cover balls, volumes and κ. `covers`
/// is null for the matched tree.
std::vector<Invariant> check_tree(const AssetHeader& asset, const TreeHeader& tree,
                                  const Sphere* spheres, const float* covers,
                                  const std::string& name);

/// Inner spheres lie in the solid and apart; covers contain spheres.
std::vector<Invariant> check_spheres(const AssetHeader& asset, const CheckedSolid& checked);

/// The matched spheres of a detail (0: the finest) stand for the solid. Names start with `name`.
std::vector<Invariant> check_matched(const AssetHeader& asset, std::uint32_t detail,
                                     const CheckedMesh& checked, const std::string& name);

/// Every point of the solid lies in some cover ball: proven by subdivision.
Invariant check_cover(const AssetHeader& asset, const CheckedSolid& checked);

/// For every sphere, the others that it overlaps.
std::vector<std::vector<std::uint32_t>> overlapping_pairs(const Sphere* spheres, std::size_t count);

}  // namespace ist
