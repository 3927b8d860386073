#pragma once

#include <ist/mesh.h>

namespace ist {

/// The volume that a mesh counts more than once, and how that was resolved; w: winding number.
struct Resolution {
  enum class How {
    as_it_is,   ///< the mesh is the boundary of where w ≥ 1: nothing was changed
    resolved,   ///< the mesh is now that boundary
    unresolved  ///< nothing was changed; the other figures are not known and 0
  };
  How how = How::as_it_is;
  double counted_twice = 0;  ///< [u³] ∫ (w − 1)⁺ before: what the mesh's volume has too much
  double counted_against = 0;  ///< [u³] ∫ (−w)⁺ before: what it has too little
  /// [u] no vertex is further than this from where it would be without rounding. 0: none has moved.
  double moved = 0;
  std::string reason;  ///< a sentence: what was done, or why nothing could be
};

struct ResolvedMesh {
  ClosedMesh mesh;
  Resolution resolution;
};

/// The same solid's mesh without inner walls: winding number 0 or 1 almost everywhere.
///
/// Triangles are cut exactly where they meet, in whole numbers; pieces between winding numbers of
/// 0 or less and 1 or more are kept, and new vertices are rounded to double at last. Up to that
/// rounding the surface meets itself at most in points and edges. Faces that lie on each other from
/// opposite sides, exactly or but for the rounding of a turn (press.h), are no boundary. Parts that
/// hang together, or meet, and count nothing twice and have no such faces keep their triangles.
///
/// Same bytes for any number of threads, which are those of the current arena. Takes milliseconds
/// for thousands of triangles that meet. Never throws for what a mesh looks like.
///
/// Reports the stage "resolve" if there is work; throws Error if `progress` cancels.
ResolvedMesh resolve(ClosedMesh closed, const ProgressCallback& progress = {});

}  // namespace ist
