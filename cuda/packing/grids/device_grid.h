#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/base/device_array.h"
#include "mesh/geometry/mesh_view.h"
#include "packing/grids/distance_grid.h"

namespace ist::gpu {

// Triangles and the distance grid's cells, in device memory: HostGrid's steps of the same names.

/// The float frames of all triangles.
void prepare_triangles(Queue& queue, const DeviceArray<double>& vertices,
                       const DeviceArray<std::uint32_t>& corners,
                       DeviceArray<packing::GridTriangle>& triangles);

/// Adds to each cell the number of triangles that overlap it, and to `crossings` their terms of the
/// winding number along the centre line of its row. `large`: an element for every triangle.
void count_triangles(Queue& queue, const packing::GridScene& mesh,
                     const packing::GridLayout& layout, std::uint32_t count,
                     DeviceArray<std::uint32_t>& counts, DeviceArray<std::int32_t>& crossings,
                     DeviceArray<std::uint32_t>& large);

/// Marks the words of cells outside as inactive, the others with 0; turns crossings into the
/// windings of records.
void classify_rows(Queue& queue, const packing::GridLayout& layout,
                   const DeviceArray<std::uint32_t>& counts, DeviceArray<std::int32_t>& windings,
                   DeviceArray<std::uint32_t>& words);

/// Fills the triangle lists of the records that `words` refer to. `filled`: a counter a cell.
void fill_triangle_lists(Queue& queue, const packing::GridScene& mesh,
                         const packing::GridLayout& layout, std::uint32_t count,
                         const DeviceArray<std::uint32_t>& words,
                         const DeviceArray<packing::CellRecord>& records,
                         DeviceArray<std::int32_t>& filled, DeviceArray<std::uint32_t>& large,
                         DeviceArray<std::uint32_t>& lists);

/// The distance grid (packing/grids/host_grid.h) in device memory. Its arrays belong to the queue.
class DeviceGrid {
 public:
  /// Uploads the mesh's exact arrays, which must stay valid until Queue::wait().
  DeviceGrid(Queue& queue, const MeshView& mesh);

  /// Builds a new grid of that layout. Throws Error if more cells are active than a word can
  /// address.
  void build(const packing::GridLayout& layout);
  /// Appends spheres, which count after the next build() or update().
  void append(const Sphere* spheres, std::size_t count);
  void update();

  /// The scene for kernels; valid until the next change.
  packing::GridScene scene() const;
  const packing::GridLayout& layout() const { return layout_; }

  std::size_t active_cells() const { return active_; }
  std::size_t list_bytes() const { return triangle_lists_.bytes() + sphere_lists_.bytes(); }
  std::size_t bytes() const {
    return words_.bytes() + keys_.bytes() + records_.bytes() + list_bytes();
  }
  bool hashed() const { return keys_.size() > 0; }

 private:
  void cover(std::size_t first_new);
  void drop_inactive();
  void hash_words();
  void list_spheres();
  void measure_distances();

  Queue* queue_;
  std::uint32_t triangle_count_;
  DeviceArray<double> vertices_;
  DeviceArray<std::uint32_t> corners_;
  DeviceArray<packing::GridTriangle> triangles_;
  DeviceArray<Sphere> spheres_;
  std::size_t sphere_count_ = 0, listed_ = 0;  ///< the first `listed_` are in the lists

  packing::GridLayout layout_;
  DeviceArray<std::uint32_t> words_, keys_;
  DeviceArray<packing::CellRecord> records_;
  DeviceArray<std::uint32_t> triangle_lists_, sphere_lists_;
  DeviceArray<std::uint32_t> counter_;
  std::size_t active_ = 0;
};

}  // namespace ist::gpu
