#pragma once

#include "cuda/base/device_array.h"
#include "packing/grids/distance_grid.h"

// Triangles and the distance grid's cells, in device memory: HostGrid's steps of the same names.

namespace ist::gpu {

/// The float frames of all triangles.
void prepare_triangles(Queue& queue, const DeviceArray<double>& vertices,
                       const DeviceArray<std::uint32_t>& corners,
                       DeviceArray<packing::GridTriangle>& triangles);

/// Adds to each cell the number of triangles that overlap it, and to `crossings` their terms in the
/// winding number along its row's centre line. `large`: an element for every triangle.
void count_triangles(Queue& queue, const packing::GridScene& mesh,
                     const packing::GridLayout& layout, std::uint32_t count,
                     DeviceArray<std::uint32_t>& counts, DeviceArray<std::int32_t>& crossings,
                     DeviceArray<std::uint32_t>& large);

/// Marks the words of what is outside as inactive, the others with 0; turns crossings into the
/// windings of records.
void classify_rows(Queue& queue, const packing::GridLayout& layout,
                   const DeviceArray<std::uint32_t>& counts, DeviceArray<std::int32_t>& windings,
                   DeviceArray<std::uint32_t>& words);

/// Fills the triangle lists of the records that `words` lead to. `filled`: a counter a cell.
void fill_triangle_lists(Queue& queue, const packing::GridScene& mesh,
                         const packing::GridLayout& layout, std::uint32_t count,
                         const DeviceArray<std::uint32_t>& words,
                         const DeviceArray<packing::CellRecord>& records,
                         DeviceArray<std::int32_t>& filled, DeviceArray<std::uint32_t>& large,
                         DeviceArray<std::uint32_t>& lists);

}  // namespace ist::gpu
