#pragma once

#include <cstddef>
#include <cstdint>

#include "cuda/device_array.h"
#include "mesh/wide_tree.h"

namespace ist::gpu {

/// A mesh in host memory, pageable or pinned, and its way into the unit frame.
struct HostMesh {
  const double* vertices = nullptr;          ///< double[3 · vertex_count]
  const std::uint32_t* triangles = nullptr;  ///< uint32[3 · triangle_count], < vertex_count each
  std::size_t vertex_count = 0;
  std::size_t triangle_count = 0;  ///< 1 … 2^30
  double centre[3] = {};           ///< x_unit = (x − centre) / scale, rounded like UnitFrame's
  double scale = 1;
};

/// A mesh and its hierarchy in device memory. The arrays belong to the queue they were made on.
class DeviceMesh {
 public:
  /// Uploads and builds, in the queue's order. The host arrays are in use until Queue::wait().
  DeviceMesh(Queue& queue, const HostMesh& mesh);

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

}  // namespace ist::gpu
