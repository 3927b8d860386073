#pragma once

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

#include "part.h"

// The same solids as Bullet's own shapes: for comparison.

/// A shape and what it only points to.
struct PeerShape {
  std::vector<double> coordinates;
  std::vector<int> indices;
  std::unique_ptr<btStridingMeshInterface> mesh;
  std::vector<std::unique_ptr<btCollisionShape>> children;
  std::unique_ptr<btCollisionShape> shape;
};

/// btGImpactMeshShape over all triangles, in the body's frame.
std::unique_ptr<PeerShape> make_gimpact_shape(const Part& part, double margin);

/// One convex hull, of at most 42 corners, as engines have them: btShapeHull's.
std::unique_ptr<PeerShape> make_hull_shape(const Part& part, double margin);

/// btBoxShape where the part is a box about its body's origin, else one convex hull.
std::unique_ptr<PeerShape> make_own_shape(const Part& part, double margin);

/// Convex hulls of a decomposition by HACD, in the body's frame. Null where Bullet's extras are
/// missing (dev setup --bullet).
std::unique_ptr<PeerShape> make_hulls_shape(const Part& part, std::size_t hulls, double margin);

bool have_hulls();
