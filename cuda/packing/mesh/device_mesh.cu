#include "cuda/packing/mesh/device_mesh.h"

#include "cuda/base/check.h"
#include "cuda/base/pageable_upload.h"
#include "cuda/base/warp_team.h"
#include "mesh/hierarchy/wide_build.h"

namespace ist::gpu {
namespace {

constexpr unsigned kThreads = 128;
constexpr unsigned kWarps = kThreads / 32;

__device__ Corners corners_of(const double* vertices, const std::uint32_t* t) {
  return {{vertices + 3 * std::size_t{t[0]}, vertices + 3 * std::size_t{t[1]},
           vertices + 3 * std::size_t{t[2]}}};
}

/// Writes the union of the lanes' boxes as the box of a node's child. `place` counts nodes and
/// blocks together and is not the root's.
__device__ void write_joint_box(WideBox box, WideNode* nodes, std::uint32_t place) {
  const WarpTeam team;
  for (int k = 0; k < 3; ++k) {
    box.lower[k] = team.min(box.lower[k]);
    box.upper[k] = team.max(box.upper[k]);
  }
  if (team.lane() != 0) return;
  box.write_to(nodes[(place - 1) / kWideWidth], static_cast<int>((place - 1) % kWideWidth));
}

/// Sums over the lanes, the same in all of them.
__device__ void add_up(WideMoments& moments) {
  moments.for_each([](float& sum) {
    for (int step = 16; step > 0; step /= 2) sum += __shfl_xor_sync(WarpTeam::kAll, sum, step);
  });
}

/// Writes the oriented box of the triangles of all lanes.
__device__ void write_oriented_box(const Corners& corners, bool present, const double* origin,
                                   WideOriented& boxes, int child) {
  const WarpTeam team;
  WideMoments moments;
  if (present) moments.add(corners, origin);
  add_up(moments);
  WideOrientedBox box(moments);
  if (present)
    for (const double* corner : corners.p) box.extend(corner);
  for (int k = 0; k < 3; ++k) {
    box.lower[k] = team.min(box.lower[k]);
    box.upper[k] = team.max(box.upper[k]);
  }
  if (team.lane() == 0) box.write_to(boxes, child);
}

/// One warp a block of triangles; missing blocks leave empty boxes in the last node.
__global__ void fill_blocks(const double* vertices, const std::uint32_t* triangles,
                            const std::uint32_t* order, std::uint32_t count, WideBlock* blocks,
                            std::uint32_t block_count, WideNode* nodes, WideOriented* oriented,
                            std::uint32_t first_leaf) {
  const std::uint32_t index = blockIdx.x * kWarps + threadIdx.x / 32;
  const int lane = static_cast<int>(threadIdx.x % 32);
  const std::uint32_t slot = index * kWideWidth + static_cast<std::uint32_t>(lane);
  if (index >= (block_count + kWideWidth - 1) / kWideWidth * kWideWidth) return;
  WideBox box;
  const bool present = slot < count;
  std::uint32_t triangle = kNoTriangle, corner[3] = {};
  if (present) {
    triangle = order[slot];
    for (int k = 0; k < 3; ++k) corner[k] = triangles[3 * std::size_t{triangle} + std::size_t(k)];
    box = box_of(corners_of(vertices, corner));
  }
  if (index < block_count) write_lane(blocks[index], lane, vertices, triangle, corner);
  write_joint_box(box, nodes, first_leaf + index);
  const std::uint32_t first_corner = __shfl_sync(WarpTeam::kAll, corner[0], 0);
  write_oriented_box(corners_of(vertices, corner), present,
                     vertices + 3 * std::size_t{first_corner}, oriented[index / kWideWidth],
                     static_cast<int>(index % kWideWidth));
}

/// Writes the box of each of a level's nodes, counted from `first`, to the level above. One warp a
/// node.
__global__ void join_boxes(WideNode* nodes, std::uint32_t first, std::uint32_t node_count) {
  const std::uint32_t index = blockIdx.x * kWarps + threadIdx.x / 32;
  const int lane = static_cast<int>(threadIdx.x % 32);
  if (index >= (node_count + kWideWidth - 1) / kWideWidth * kWideWidth) return;
  WideBox box;
  if (index < node_count) {
    for (int k = 0; k < 3; ++k) {
      box.lower[k] = nodes[first + index].lower[k][lane];
      box.upper[k] = nodes[first + index].upper[k][lane];
    }
  }
  write_joint_box(box, nodes, first + index);
}

}  // namespace

DeviceMesh::DeviceMesh(Queue& queue, const MeshView& mesh) {
  const std::uint32_t count = mesh.triangle_count;
  const std::uint32_t block_count = (count + kWideWidth - 1) / kWideWidth;
  const int depth = wide_depth(block_count);
  tree_.first_leaf = first_wide_node(depth);
  tree_.block_count = block_count;
  tree_.triangle_count = count;
  tree_.vertex_count = mesh.vertex_count;
  const cudaStream_t stream = queue.stream();

  DeviceArray<std::uint32_t> triangles(queue, 3 * std::size_t{count});
  vertices_ = DeviceArray<double>(queue, 3 * std::size_t{mesh.vertex_count});
  {
    PageableUpload upload(queue, vertices_.bytes() + triangles.bytes());
    upload.copy(vertices_.data(), mesh.vertices, vertices_.bytes());
    upload.copy(triangles.data(), mesh.triangles, triangles.bytes());
  }
  const DeviceArray<std::uint32_t> order =
      order_triangles(queue, vertices_.data(), triangles.data(), count);

  blocks_ = DeviceArray<WideBlock>(queue, block_count);
  std::uint32_t node_count = blocks_for(block_count, kWideWidth);
  nodes_ = DeviceArray<WideNode>(queue, first_wide_node(depth - 1) + node_count);
  oriented_ = DeviceArray<WideOriented>(queue, node_count);
  launch("building the mesh's hierarchy", fill_blocks,
         blocks_for(std::size_t{node_count} * kWideWidth, kWarps), kThreads, stream,
         vertices_.data(), triangles.data(), order.data(), count, blocks_.data(), block_count,
         nodes_.data(), oriented_.data(), tree_.first_leaf);
  for (int level = depth - 1; level > 0; --level) {
    const std::uint32_t parents = blocks_for(node_count, kWideWidth);
    launch("building the mesh's hierarchy", join_boxes,
           blocks_for(std::size_t{parents} * kWideWidth, kWarps), kThreads, stream, nodes_.data(),
           first_wide_node(level), node_count);
    node_count = parents;
  }
  tree_.vertices = vertices_.data();
  tree_.blocks = blocks_.data();
  tree_.nodes = nodes_.data();
  tree_.oriented = oriented_.data();
}

}  // namespace ist::gpu
