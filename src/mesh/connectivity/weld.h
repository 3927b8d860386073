#pragma once

#include <ist/mesh.h>
#include <bit>

#include "base/hashing.h"

namespace ist {

/// Hashes the bits of a point's coordinates; −0 counts as 0.
inline std::uint64_t hash_of_bits(const Eigen::Vector3d& p) {
  std::uint64_t hash = 0;
  for (const double x : p)
    hash = mixed(hash ^ std::bit_cast<std::uint64_t>(x + 0.0));  // −0 + 0 = 0
  return hash;
}

/// [point] The smallest index of a used point with equal coordinates (−0 = 0); unspecified for
/// unused ones. `used` [point]: 0 or 1; used points must be finite. Runs on the caller's TBB
/// threads.
std::vector<std::uint32_t> first_equal(const std::vector<Eigen::Vector3d>& points,
                                       const std::vector<std::uint8_t>& used);

/// Merges all vertices within `tolerance` [u] of the first of them in file order (0: equal
/// coordinates, −0 = 0), and renumbers triangles. Unreferenced vertices are dropped, the rest keep
/// their order. Every referenced coordinate must be finite.
TriangleMesh weld(TriangleMesh mesh, double tolerance);

/// Drops unreferenced vertices, the last step of the functions above.
void drop_unused(TriangleMesh& mesh);

/// weld() with a tolerance above 0, limited to the vertices in `among` (by index).
TriangleMesh weld_among(const TriangleMesh& mesh, double tolerance, const std::vector<bool>& among);

}  // namespace ist
