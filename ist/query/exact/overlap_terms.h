#pragma once

#include <cstdint>

#include "query/exact/exact_scratch.h"

namespace ist {

/// What eight pieces of the boundary add to the sums of an overlap, a lane each.
struct alignas(64) ExactTerms {
  /// Tetrahedra: those of a segment, and of an edge at each of its ends. Their sum would lose
  /// digits where all are large and the overlap is small.
  double six_volumes[3][8];
  double moment[3][8], force[3][8], torque[3][8];
  double rounding[8];  ///< six times what the volume may be off by
};

/// What eight crossings add to octants, a lane each: triangles of A and of B between the segment
/// and the apex, and those between the apex and a pierced edge opposite to it, at each end.
struct alignas(64) OctantPieces {
  static constexpr int kTriangles = 4, kEnd = 2, kNear = 4;
  /// From the centre in the octants' axes: the apexes of A and of B, from kEnd the ends, and from
  /// kNear the nearer ends of their edges.
  double at[6][3][8];
  double times[4][8];  ///< how often a triangle counts
  double six_volumes[4][8], moment[4][3][8], area[4][3][8], torque[4][3][8];
  /// All of them together, the areas by surface.
  double sum_six_volumes[8], sum_moment[3][8], sum_area[2][3][8], sum_torque[3][8];
  std::uint8_t octant[6][8];  ///< a bit an axis: the corner's coordinate is not less than 0
  std::uint32_t of_b[4];      ///< a bit a lane: the triangle is of B's surface

  /// Corner k of a triangle.
  int corner(int triangle, int k, std::uint32_t lane) const noexcept {
    if (k == 0) return static_cast<int>(of_b[triangle] >> lane & 1);
    return triangle < 2 ? kEnd + (k == 1 ? triangle : 1 - triangle)
                        : (k == 1 ? kEnd : kNear) + triangle - 2;
  }
};

/// Where octants are seen from: the axes, and for each lane the centre of its part, from the origin
/// of the sums.
struct alignas(64) OctantView {
  double centre[3][8] = {};
  exact::Point origin, axis[3];
};

/// Of crossings `first` … `first` + 7.
void octant_pieces(const Crossings& crossings, std::uint32_t first, const OctantView& view,
                   OctantPieces& out) noexcept;

/// The vertices of a crossed block from the origin of the sums, and the corners that the cones of
/// its triangles start at.
void place_fans(const PlacedVertices& placed, const MeshBlock& mesh, const exact::Point& origin,
                CrossedBlock& out) noexcept;

/// Of crossings `first` … `first` + 7: the segments that two triangles share, and the pierced edges
/// opposite to an apex from their nearer ends on.
void crossing_terms(const Crossings& crossings, std::uint32_t first, const exact::Point& origin,
                    ExactTerms& out) noexcept;

/// Of a crossed block's triangles 8 h … 8 h + 7: cones over the edges opposite to their apexes,
/// `whole` times each. They have neither force nor torque, and but one tetrahedron each.
void triangle_terms(const CrossedBlock& crossed, const std::int8_t (&whole)[kWidth], int h,
                    ExactTerms& out) noexcept;

}  // namespace ist
