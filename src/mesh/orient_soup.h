#pragma once

#include <ist/mesh.h>

namespace ist {

/// Turns the triangles of a soup so that as many as can be show their fronts to the outside.
///
/// Neighbours across edges of two triangles are made to agree, as far as the surface is orientable.
/// Each patch that hangs together so is then turned if more of its backs than of its fronts are
/// seen from far away, along the three axes both ways. Patches that nobody sees go with the
/// majority: as authored, unless most of what is seen had to be turned. The same for any threads.
void orient_soup(TriangleMesh& soup);

}  // namespace ist
