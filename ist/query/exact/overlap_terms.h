#pragma once

#include <cstdint>

#include "query/exact/exact_scratch.h"

namespace ist {

/// Computes the terms of crossings `first` … `first` + 7 for octants.
void octant_pieces(const Crossings& crossings, std::uint32_t first, const OctantView& view,
                   OctantPieces& out) noexcept;

/// Places the vertices of a crossed block relative to the origin of the sums, and finds the apexes
/// of its triangles' cones.
void place_fans(const PlacedVertices& placed, const MeshBlock& mesh, const exact::Point& origin,
                CrossedBlock& out) noexcept;

/// Computes the terms of crossings `first` … `first` + 7: of the common segments of two triangles,
/// and of pierced edges opposite to an apex from their nearer ends on.
void crossing_terms(const Crossings& crossings, std::uint32_t first, const exact::Point& origin,
                    ExactTerms& out) noexcept;

/// Computes the terms of a crossed block's triangles 8 h … 8 h + 7: cones over the edges opposite
/// to their apexes, `whole` times each. They have neither force nor torque, and one tetrahedron
/// each.
void triangle_terms(const CrossedBlock& crossed, const std::int8_t (&whole)[kWidth], int h,
                    ExactTerms& out) noexcept;

}  // namespace ist
