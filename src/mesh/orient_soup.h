#pragma once

#include <ist/mesh.h>

namespace ist {

/// Turns the triangles of a soup so that as many as can be show their fronts to the outside.
///
/// Neighbours across edges of two triangles are made to agree, as far as the surface is orientable.
/// Each patch that hangs together so is then turned if of what is seen of it from far away, along
/// the three axes both ways, twice as much is backs as fronts. Where neither prevails so, as in a
/// bowl, the side that it bulges to is its front. Patches that nobody sees go with the majority: as
/// authored, unless most of what is seen had to be turned. The same for any threads.
void orient_soup(TriangleMesh& soup);

}  // namespace ist
