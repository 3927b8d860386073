#pragma once

#include <ist/field.h>

#include "query/asset/shared_constants.h"
#include "query/asset/surface_tree.h"
#include "query/probe/membership.h"
#include "query/probe/surface_distance.h"

namespace ist {

/// The surface in an asset as a field of distances.
struct MeshShape {
  explicit MeshShape(const MeshField& f) noexcept : surface(surface_tree(f.tree)) {}
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept {
    const double at[3] = {x.x(), x.y(), x.z()};
    const NearestSurface found = nearest_surface(surface, at, kLongestLength);
    const Eigen::Vector3d point(found.point[0], found.point[1], found.point[2]);
    const Eigen::Vector3d way = found.distance > 0 ? Eigen::Vector3d((point - x) / found.distance)
                                                   : Eigen::Vector3d::Zero().eval();
    return inside_surface(surface, at, found.distance * (1 - 1e-12))
               ? FieldSample{found.distance, -way}
               : FieldSample{-found.distance, way};
  }
  double error() const noexcept { return surface.header->error; }

  SurfaceTree surface;
};

}  // namespace ist
