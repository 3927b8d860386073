#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include "mesh/geometry/mesh_view.h"

namespace ist {

/// A bounding volume hierarchy over all triangles of a mesh, built by the binned surface area
/// heuristic. The same for any number of threads. No query's answer depends on its shape.
struct Bvh {
  std::unique_ptr<BvhNode[]> nodes;
  std::unique_ptr<TriangleBlock[]> blocks;
  std::uint32_t root = kBvhEmpty;
  std::unique_ptr<OrientedBoxes<kBvhWidth>[]> oriented;  ///< for meshes of needles
};

/// Oriented boxes of a hierarchy's `nodes`, around the few triangles below each child, if the mesh
/// consists of needles; else null.
std::unique_ptr<OrientedBoxes<kBvhWidth>[]> oriented_boxes(const MeshView& mesh, std::size_t nodes);

/// Builds over `triangles` (three indices each) of exact unit-frame vertices (three doubles each).
Bvh build_bvh(std::span<const double> vertices, std::span<const std::uint32_t> triangles);

}  // namespace ist
