#pragma once

#include <ist/mesh.h>

#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Consistently oriented pieces of a closed surface.
struct Shells {
  std::vector<std::uint32_t> of_triangle;
  std::uint32_t count = 0;
};

/// For every side of a triangle (EdgeTable), the neighbour's side that continues the surface across
/// the edge; kNoIndex if there is none.
using SidePartners = std::vector<std::uint32_t>;

/// Partners at edges of exactly two sides.
SidePartners manifold_partners(const EdgeTable& edges);

/// Partners at edges of four, six … sides too: neighbours in the angle about the edge. Of the two
/// possible pairings, the one with more consistently oriented pairs is used, then the one with the
/// smaller angles.
SidePartners all_partners(const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Triangles connected by edges of at most `most` sides. 2: patches of a manifold.
DisjointSets connected_pieces(const EdgeTable& edges, std::size_t most = SIZE_MAX);

/// Partners of an oriented surface. At edges of four, six … sides, consistently oriented neighbours
/// in the angle about the edge are paired, the smallest angles first. The resulting pieces are
/// closed if the surface is.
SidePartners nearest_partners(const std::vector<Eigen::Vector3d>& vertices,
                              const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Flips triangles so that partners are oriented consistently; the smaller part of each connected
/// piece is flipped. If this is impossible (a Möbius strip), returns a side that shows it, and
/// flips nothing.
std::optional<std::uint32_t> make_consistent(std::vector<Triangle>& triangles,
                                             const SidePartners& partners);

/// An edge that is not used equally often in both directions, if any. Otherwise the surface is a
/// closed 2-cycle and the winding number is defined.
std::optional<std::uint32_t> find_unbalanced_edge(const std::vector<Triangle>& triangles,
                                                  const EdgeTable& edges);

/// The smallest balanced pieces, which may be flipped one by one: triangles are joined across edges
/// of two sides, and across others if their pieces are not balanced alone.
Shells find_shells(const std::vector<Triangle>& triangles, const EdgeTable& edges);

/// Volume by the divergence theorem, and the sum of its terms' magnitudes, to which the rounding
/// error is relative.
struct SignedVolume {
  double volume = 0;     ///< [u³]
  double magnitude = 0;  ///< [u³]
  /// True if the volume is rounding alone.
  bool is_flat() const;
};

struct Nesting {
  std::size_t flipped = 0;        ///< shells turned
  std::size_t cavities = 0;       ///< inward shells within solid
  std::size_t nested_solids = 0;  ///< outward shells within solid, which add no volume
  std::size_t flat = 0;           ///< shells without volume
  SignedVolume volume;            ///< of all shells, after turning
};

/// Orients every shell outward, except that an inward shell within solid is a cavity and stays. If
/// an outermost shell is flipped, so is its content: a mesh that is inside out as a whole keeps its
/// cavities (docs/design.md 3.6).
Nesting orient_shells(const std::vector<Eigen::Vector3d>& vertices,
                      std::vector<Triangle>& triangles, const Shells& shells);

}  // namespace ist
