#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "asset/asset_writer.h"
#include "mesh/mesh_solid.h"
#include "stage/work_stop.h"

namespace ist {

/// Triangles of a field, unless another error is asked for.
inline constexpr std::uint32_t kFieldTriangles = 25'000;

/// Bytes of a field unless another error is asked for: what the spheres take in an asset of 10,000.
inline constexpr std::size_t kFieldBytes = 1'000'000;

/// The surface of a mesh's solid for queries: the mesh's own triangles where they are few, else
/// fewer near them (asset_layout.h draws it). Its error is proven.
///
/// `max_error`: unit frame, > 0; of a mesh of many triangles as few stay as that allows. 0:
/// kFieldTriangles at most.
/// Nothing for a mesh that meets itself, where that reaches further than 0.5 % of the solid's size
/// or half of `max_error`. Throws Error
/// where floats cannot be as exact as `max_error`, WorkStop::Stopped if `stop` ends it. Same bytes
/// for any number of threads and on any machine.
std::optional<FieldArrays> build_field(const MeshSolid& solid, double max_error,
                                       const WorkStop& stop = WorkStop());

}  // namespace ist
