#pragma once

#include <ist/mesh.h>

namespace ist {

/// In spacings of doubles at the mesh's largest coordinate: bound on the change of coordinates by
/// the rounding of a rotation, scale and translation.
constexpr double kNearSteps = 64;

/// A closed mesh with touching parts, changed by about the size of rounding.
struct Pressed {
  TriangleMesh mesh;                      ///< near vertices are merged; empty: nothing was changed
  std::vector<Eigen::Vector3d> vertices;  ///< of `mesh`, pressed
  double moved = 0;                       ///< [u] bound on the motion of any vertex
  double apart = 0;  ///< [u] bound on the motion of separated faces from their touching place
};

/// Presses faces that touch each other, up to the rounding of coordinates, into each other:
/// touching parts then overlap, under every rotation, or have the same corners. Faces that touch
/// exactly stay, and so do thin needles. The same for any number of threads.
Pressed press_together(const TriangleMesh& mesh);

}  // namespace ist
