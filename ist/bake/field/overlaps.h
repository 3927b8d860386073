#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/mesh_solid.h"

namespace ist {

/// What of a mesh that meets itself is not the boundary of its solid.
struct Overlaps {
  enum class Part : std::uint8_t {
    boundary,  ///< between winding numbers 0 and 1, all of it
    inner,     ///< none of it
    mixed      ///< it meets another triangle: perhaps in parts
  };
  std::vector<Part> part;                           ///< [triangle]
  std::vector<std::array<std::uint32_t, 2>> pairs;  ///< that meet, sorted
  /// Unit frame: every triangle lies within it of the solid's boundary, and where the winding
  /// number is neither 0 nor 1, a triangle is as near. Infinite where that is not known.
  ///
  /// Such points are in bounded regions whose sides are of triangles that are no boundary. Each
  /// region lies in the hull of triangles that hang together, so that from its points a side is no
  /// further than half the hull's width, in any direction. The triangles reach the boundary where
  /// they share a corner with it.
  double off = 0;
};

/// Nothing where the meeting triangles are not found in reasonable time.
std::optional<Overlaps> find_overlaps(const MeshSolid& solid);

}  // namespace ist
