#pragma once

#include <cstddef>
#include <vector>

#include "mesh/geometry/mesh_view.h"
#include "packing/grids/distance_grid.h"

namespace ist::packing {

/// The distance grid in host memory, processed by all threads of the arena.
class HostGrid {
 public:
  /// Keeps a reference to `mesh`.
  explicit HostGrid(const MeshView& mesh);

  /// Builds a new grid of that layout. Throws Error if more cells are active than a word can
  /// address.
  void build(const GridLayout& layout, const std::vector<Sphere>& spheres);
  /// Adds spheres from `first_new` on: inactive cells, lists and discrete distances.
  void update(const std::vector<Sphere>& spheres, std::size_t first_new);

  /// Valid until the next change of the grid or of `spheres`.
  GridScene scene(const std::vector<Sphere>& spheres) const;

  std::size_t cells() const { return layout_.count(); }
  std::size_t active_cells() const { return active_; }
  std::size_t bytes() const;
  bool hashed() const { return !keys_.empty(); }

 private:
  void count_triangles(std::vector<std::uint32_t>& counts,
                       std::vector<std::int32_t>& crossings) const;
  void classify(const std::vector<std::uint32_t>& counts, std::vector<std::int32_t>& windings);
  void cover(const std::vector<Sphere>& spheres, std::size_t first_new);
  void fill_triangle_lists();
  void drop_inactive();
  void hash_words();
  void list_spheres(const std::vector<Sphere>& spheres);
  void measure_distances();
  std::uint32_t place_of(std::uint32_t cell) const;  ///< in words_; words_.size(): missing

  const MeshView mesh_;
  std::vector<GridTriangle> triangles_;
  GridLayout layout_;
  std::vector<std::uint32_t> words_, keys_;
  std::vector<CellRecord> records_;
  std::vector<std::uint32_t> triangle_lists_, sphere_lists_;
  std::size_t active_ = 0;  ///< records of cells that are still active
};

}  // namespace ist::packing
