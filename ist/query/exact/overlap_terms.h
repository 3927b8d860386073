#pragma once

#include <cstdint>

#include "query/exact/exact_scratch.h"

namespace ist {

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
