#pragma once

#include <ist/mesh.h>

namespace ist {

/// In spacings of doubles at the mesh's largest coordinate: the most that turning, scaling and
/// moving may change coordinates by rounding.
constexpr double kNearSteps = 64;

/// A closed mesh whose parts touch, changed by rounding's size.
struct Pressed {
  TriangleMesh mesh;  ///< vertices that were near each other are one; empty: nothing was changed
  std::vector<Eigen::Vector3d> vertices;  ///< of `mesh`, pressed
  double moved = 0;                       ///< [u] none is further from where it was
  double apart = 0;  ///< [u] what was moved apart is no further from where it touched
};

/// Faces that lie on each other from opposite sides, but for the rounding of coordinates, are
/// pressed into each other: what touches then overlaps, at every turn, or has the same corners.
/// Faces that do so exactly stay, and so do thin needles. The same for any number of threads.
Pressed press_together(const TriangleMesh& mesh);

}  // namespace ist
