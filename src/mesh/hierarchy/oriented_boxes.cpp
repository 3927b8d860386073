#include <tbb/parallel_for.h>
#include <vector>

#include "mesh/geometry/exact_triangle.h"
#include "mesh/hierarchy/bvh.h"
#include "mesh/hierarchy/wide_build.h"

namespace ist {
namespace {

constexpr std::size_t kMost = 1024;  ///< triangles; a box around more excludes little

/// Collects the triangles below a child, up to kMost + a block.
void gather(const MeshView& mesh, std::uint32_t child, std::vector<std::uint32_t>& triangles) {
  if (child == kBvhEmpty || triangles.size() > kMost) return;
  if ((child & kBvhLeaf) != 0) {
    for (const std::uint32_t t : mesh.blocks[child & ~kBvhLeaf].triangle)
      if (t != kNoTriangle) triangles.push_back(t);
  } else {
    for (const std::uint32_t below : mesh.nodes[child].child) gather(mesh, below, triangles);
  }
}

/// The box around many triangles or none excludes nothing.
WideOrientedBox box_around(const MeshView& mesh, const std::vector<std::uint32_t>& triangles) {
  WideMoments moments;
  if (triangles.empty() || triangles.size() > kMost) {
    WideOrientedBox everything(moments);
    constexpr float kFar = 4;  // coordinates are within ±1
    for (int k = 0; k < 3; ++k) everything.lower[k] = -(everything.upper[k] = kFar);
    return everything;
  }
  const double* const origin = corners_of(mesh, triangles[0]).p[0];
  for (const std::uint32_t t : triangles) moments.add(corners_of(mesh, t), origin);
  WideOrientedBox box(moments);
  for (const std::uint32_t t : triangles)
    for (const double* const corner : corners_of(mesh, t).p) box.extend(corner);
  return box;
}

}  // namespace

std::unique_ptr<OrientedBoxes<kBvhWidth>[]> oriented_boxes(const MeshView& mesh,
                                                           std::size_t nodes) {
  const auto corners = [&](std::size_t t) {
    return corners_of(mesh, static_cast<std::uint32_t>(t));
  };
  if (!(mean_slenderness(mesh.triangle_count, corners) > kSlender)) return nullptr;
  auto boxes = std::make_unique_for_overwrite<OrientedBoxes<kBvhWidth>[]>(nodes);
  tbb::parallel_for(std::size_t{0}, nodes, [&](std::size_t node) {
    std::vector<std::uint32_t> triangles;
    for (int i = 0; i < kBvhWidth; ++i) {
      triangles.clear();
      gather(mesh, mesh.nodes[node].child[i], triangles);
      box_around(mesh, triangles).write_to(boxes[node], i);
    }
  });
  return boxes;
}

}  // namespace ist
