#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/bits.h"
#include "base/raw_array.h"

namespace ist {

using Triangle = std::array<std::uint32_t, 3>;

/// The sides of all triangles, grouped by edge. Side 3t + k runs from corner k of triangle t to the
/// next. Triangles with repeated corners have no edges here: their sides cancel.
class EdgeTable {
 public:
  explicit EdgeTable(std::span<const Triangle> triangles);

  std::size_t size() const { return edges_.size(); }
  std::size_t side_count() const { return edge_of_side_.size(); }  ///< of all triangles
  /// The sides on an edge, ascending.
  std::span<const std::uint32_t> sides(std::size_t edge) const;
  /// Its two vertices, the smaller index first. Edges are sorted by them.
  std::uint32_t low(std::size_t edge) const { return edges_[edge].low; }
  std::uint32_t high(std::size_t edge) const { return edges_[edge].high; }
  /// The edge of a side; kNoIndex for a triangle with repeated corners.
  std::uint32_t edge_of(std::size_t side) const { return edge_of_side_[side]; }

 private:
  struct Edge {
    std::uint32_t low, high, first_side;
  };
  RawArray<Edge> edges_;
  RawArray<std::uint32_t> sides_, edge_of_side_;
};

/// True if side 3t + k runs from the smaller to the larger vertex index.
bool runs_up(const std::vector<Triangle>& triangles, std::uint32_t side);

bool has_repeated_corner(const Triangle& triangle);

}  // namespace ist
