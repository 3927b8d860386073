#pragma once

#include <string>

#include <ist/mesh.h>

#include "mesh/two_meshes.h"

namespace ist {

/// Repaired meshes whose confidence is less are refused.
constexpr double kLeastConfidence = 0.6;

/// Of the diagonal of the bounds: surface that a repair left this near to where it was, it kept.
constexpr double kKept = 1e-4;

/// Compares a closed mesh with the surface it was made of, whose triangles may face any way; see
/// RepairQuality. `kept`: over the diagonal, what lies this near counts as kept. On the caller's
/// TBB threads, the same for any number of them. `both`: of the two meshes.
RepairQuality judge(const TriangleMesh& soup, const ClosedMesh& made, const TwoMeshes& both,
                    double kept);

/// The same in a sentence.
std::string describe(const RepairQuality& judged);

}  // namespace ist
