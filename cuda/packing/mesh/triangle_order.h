#pragma once

#include <cstdint>

#include "cuda/base/device_array.h"

namespace ist::gpu {

/// The order in which a hierarchy takes a mesh's triangles (indices): successive ones lie close
/// together, in every part of it that makes a block or a node (mesh/hierarchy/wide_tree.h). The
/// mesh is cut across its longest side, and so are the parts, down to blocks: searches then look at
/// a third fewer blocks and nodes than along Hilbert's curve. `vertices`: double[3 · …] in the unit
/// frame, `triangles`: uint32[3 · count], both in device memory. Of one mesh always the same.
DeviceArray<std::uint32_t> order_triangles(Queue& queue, const double* vertices,
                                           const std::uint32_t* triangles, std::uint32_t count);

}  // namespace ist::gpu
