#pragma once

#include <ist/mesh.h>
#include <string>

#include "mesh/two_meshes.h"

namespace ist {

/// Repaired meshes whose confidence is less are refused.
constexpr double kLeastConfidence = 0.6;

/// Fraction of the bounds' diagonal within which a repair counts as having kept the surface.
constexpr double kKept = 1e-4;

/// Compares a closed mesh with the surface it was made of, whose triangles may face either side;
/// see RepairQuality. `kept`: a fraction of the diagonal (kKept). `both`: made from the two meshes.
/// Uses the caller's TBB threads; their number does not change the result.
RepairQuality judge(const TriangleMesh& soup, const ClosedMesh& made, const TwoMeshes& both,
                    double kept);

/// The same in a sentence.
std::string describe(const RepairQuality& judged);

}  // namespace ist
