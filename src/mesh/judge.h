#pragma once

#include <string>

#include <ist/mesh.h>

namespace ist {

/// Repaired meshes whose confidence is less are refused.
constexpr double kLeastConfidence = 0.6;

/// Compares a closed mesh with the surface it was made of, whose triangles may face any way; see
/// Judgement. On the caller's TBB threads, the same for any number of them.
Judgement judge(const TriangleMesh& soup, const ClosedMesh& made);

/// The same in a sentence.
std::string describe(const Judgement& judged);

}  // namespace ist
