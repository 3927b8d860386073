#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/base/device_array.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/hierarchy/wide_tree.h"

namespace ist::gpu {

/// A mesh and its hierarchy in device memory. The arrays belong to the queue of their construction.
class DeviceMesh {
 public:
  /// Uploads the vertices and the 1 … 2^30 triangles, from pageable or pinned memory, and builds
  /// the hierarchy in the queue's order. The host arrays must stay valid until Queue::wait().
  DeviceMesh(Queue& queue, const MeshView& mesh);

  /// The view for kernels; its pointers are to device memory.
  const WideTree& tree() const { return tree_; }
  std::size_t bytes() const {
    return vertices_.bytes() + blocks_.bytes() + nodes_.bytes() + oriented_.bytes();
  }

 private:
  DeviceArray<double> vertices_;
  DeviceArray<WideBlock> blocks_;
  DeviceArray<WideNode> nodes_;
  DeviceArray<WideOriented> oriented_;
  WideTree tree_;
};

/// The order of a mesh's triangles (indices) in its hierarchy: successive triangles are close
/// together in every part that makes a block or a node (mesh/hierarchy/wide_tree.h). The mesh is
/// cut across its longest side, and so are the parts, down to blocks: searches then visit a third
/// fewer blocks and nodes than with Hilbert's curve. `vertices`: double[3 · …] in the unit frame,
/// `triangles`: uint32[3 · count], both in device memory. The order depends on the mesh alone.
DeviceArray<std::uint32_t> order_triangles(Queue& queue, const double* vertices,
                                           const std::uint32_t* triangles, std::uint32_t count);

}  // namespace ist::gpu
