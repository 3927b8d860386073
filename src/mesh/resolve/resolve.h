#pragma once

#include <ist/mesh.h>

namespace ist {

/// The volume that a mesh counts more than once, and how it was resolved; w: winding number.
struct Resolution {
  enum class How {
    as_it_is,   ///< the mesh is the boundary of the set w ≥ 1: nothing was changed
    resolved,   ///< the mesh is now that boundary
    unresolved  ///< nothing was changed; the other figures are unknown and 0
  };
  How how = How::as_it_is;
  double counted_twice = 0;    ///< [u³] ∫ (w − 1)⁺ before: excess of the mesh's volume
  double counted_against = 0;  ///< [u³] ∫ (−w)⁺ before: deficit of the mesh's volume
  /// [u] Bound on the distance of any vertex from its exact place. 0: none was moved.
  double moved = 0;
  std::string reason;  ///< a sentence: the changes, or the reason why there are none
};

struct ResolvedMesh {
  ClosedMesh mesh;
  Resolution resolution;
};

/// The mesh of the same solid without inner walls: winding number 0 or 1 almost everywhere.
///
/// Triangles are cut exactly where they meet, in integers. Pieces between winding numbers of 0 or
/// less and 1 or more are kept, and new vertices are finally rounded to double. Up to that rounding
/// the surface meets itself at most in points and edges. Faces that touch each other, exactly or up
/// to the rounding of a rotation (press.h), are not part of the boundary. Connected or meeting
/// parts that count nothing twice and have no such faces keep their triangles.
///
/// Same bytes for any number of threads, which are those of the current arena. Takes milliseconds
/// for thousands of meeting triangles. Never throws because of a mesh's shape.
///
/// Reports the stage "resolve" if there is work; throws Error if `progress` cancels.
ResolvedMesh resolve(ClosedMesh closed, const ProgressCallback& progress = {});

}  // namespace ist
