#pragma once

#include <memory>

#include "packing/backend/solid_backend.h"

namespace ist {

/// The seam for a solid known by its signed distance, with a mesh in its place, on the host: packed
/// and covered by the signed distance, calibrated by the mesh. Both lie in the mesh's unit frame.
/// `error` [u]: the two surfaces lie within it of each other, and it counts into protrusions.
/// Solid and mesh must outlive the backend.
std::unique_ptr<SolidBackend> make_polygonised_backend(const Solid& solid, const MeshSolid& mesh,
                                                       double error);

}  // namespace ist
