#pragma once

#include <ist/mesh.h>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Pieces of a closed surface that are oriented together.
struct Shells {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
};

/// For every side of a triangle (EdgeTable) the side of the neighbour that continues the surface
/// across the edge; kNoIndex where there is none.
using SidePartners = std::vector<std::uint32_t>;

/// Partners at edges of exactly two sides.
SidePartners manifold_partners(const EdgeTable& edges);

/// Partners at edges of four, six … sides too: neighbours in the angle about the edge. Of the two
/// possible pairings it takes the one in which more pairs agree about the outside, then the one
/// whose pairs enclose the smaller angles.
SidePartners all_partners(const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Triangles that hang together by edges of no more sides than `most`. 2: patches of a manifold.
DisjointSets connected_pieces(const EdgeTable& edges, std::size_t most = SIZE_MAX);

/// Partners of an oriented surface: at edges of four, six … sides neighbours in the angle about the
/// edge that agree about the outside, those with the smallest angle between them first. They make
/// pieces of which each is closed if all are.
SidePartners nearest_partners(const std::vector<Eigen::Vector3d>& vertices,
                              const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Turns triangles so that partners agree about the outside; the smaller part of each connected
/// piece turns. Returns a side at which that is impossible (a Möbius strip), if any, and then turns
/// none.
std::optional<std::uint32_t> make_consistent(std::vector<Triangle>& triangles,
                                             const SidePartners& partners);

/// An edge that is run unequally often in its two directions, if there is one. Without any, the
/// surface is a closed 2-cycle and the winding number is defined.
std::optional<std::uint32_t> find_unbalanced_edge(const std::vector<Triangle>& triangles,
                                                  const EdgeTable& edges);

/// The smallest pieces that are balanced by themselves and may be turned one by one: triangles are
/// joined across edges of two sides, and across others where their pieces are not balanced alone.
Shells find_shells(const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Volume by the divergence theorem, and the sum of its terms' magnitudes: what the
/// rounding error is relative to.
struct SignedVolume {
  double volume = 0;     ///< [u³]
  double magnitude = 0;  ///< [u³]
  /// Nothing but rounding is left of it.
  bool is_flat() const;
};

struct Nesting {
  std::size_t flipped = 0;        ///< shells turned
  std::size_t cavities = 0;       ///< inward shells within solid
  std::size_t nested_solids = 0;  ///< outward shells within solid: they add nothing
  std::size_t flat = 0;           ///< shells that enclose nothing
  SignedVolume volume;            ///< of all shells, after turning
};

/// Turns every shell outward, except that an inward shell within solid is a cavity and stays. An
/// outermost shell that turns takes along what lies in it, so that a mesh which is inside out as a
/// whole keeps its cavities (docs/design.md 3.6).
Nesting orient_shells(const std::vector<Eigen::Vector3d>& vertices,
                      std::vector<Triangle>& triangles, const Shells& shells);

}  // namespace ist
