#pragma once

#include <ist/asset_layout.h>
#include <ist/bake.h>
#include <tbb/parallel_for.h>
#include <limits>
#include <utility>

#include "bake/check/checked_mesh.h"

namespace ist {

/// Collects the worst value of one invariant; a value > 0 is a violation.
struct Tally {
  double worst = -std::numeric_limits<double>::infinity();
  std::size_t where = 0;
  std::size_t checked = 0;
  std::size_t violations = 0;

  void add(double value, std::size_t index) {
    ++checked;
    if (!(value <= 0)) ++violations;  // including NaN
    if (!(value <= worst)) {
      worst = value;
      where = index;
    }
  }

  void add(const Tally& other) {
    checked += other.checked;
    violations += other.violations;
    if (!(other.worst <= worst)) {
      worst = other.worst;
      where = other.where;
    }
  }

  Invariant named(std::string name, std::string meaning) const {
    return {std::move(name), checked == 0 ? 0 : worst, std::move(meaning), where, checked,
            violations};
  }
};

inline void append(std::vector<Invariant>& all, std::vector<Invariant> more) {
  for (Invariant& one : more) all.push_back(std::move(one));
}

/// Runs visit(i, tally) for i < count on all threads; the sum does not depend on how many.
template <class Visit>
Tally tally_all(std::size_t count, const Visit& visit) {
  std::vector<Tally> parts(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { visit(i, parts[i]); });
  Tally sum;
  for (const Tally& part : parts) sum.add(part);
  return sum;
}

inline Eigen::Vector3d centre(const Sphere& s) { return {s.x, s.y, s.z}; }

/// Compares one tree with the table of its spheres: leaves, balls, cover balls, volumes and κ.
/// `covers` is null for the matched tree.
std::vector<Invariant> check_tree(const AssetHeader& asset, const TreeHeader& tree,
                                  const Sphere* spheres, const float* covers,
                                  const std::string& name);

/// Inner spheres lie in the solid and are disjoint; covers contain spheres.
std::vector<Invariant> check_spheres(const AssetHeader& asset, const CheckedSolid& checked);

/// The matched spheres of a detail (0: the finest) match the solid. Names start with `name`.
std::vector<Invariant> check_matched(const AssetHeader& asset, std::uint32_t detail,
                                     const CheckedMesh& checked, const std::string& name);

/// Every point of the solid lies in some cover ball: proven by subdivision.
Invariant check_cover(const AssetHeader& asset, const CheckedSolid& checked);

/// Compares the mesh of an asset that has one with the baked mesh, and checks it alone: its
/// triangles and errors, closed, its blocks, neighbours, shells and boxes.
///
/// `baked`: the baked mesh, or the mesh that approximates the solid; `checked`: the same in
/// `frame`.
std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& baked,
                                       const UnitFrame& frame, const CheckedMesh& checked);

/// For every sphere, the others that it overlaps.
std::vector<std::vector<std::uint32_t>> overlapping_pairs(const Sphere* spheres, std::size_t count);

}  // namespace ist
