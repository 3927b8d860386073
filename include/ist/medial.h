#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include <ist/api.h>
#include <ist/gpu.h>
#include <ist/packing.h>
#include <ist/progress.h>
#include <ist/solid.h>

namespace IST_API ist {

/// A point of a solid's medial axis, where a ball touches the surface from several sides.
struct MedialNode {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [u], the mesh's frame
  double radius = 0;  ///< [u] distance from the surface, within 4e-6 of the half-extent
  int contacts = 0;   ///< directions found to the surface, over 45° apart: 2, 3, 4 or more
};

struct MedialSettings {
  unsigned resolution = 0;  ///< cells on the solid's longest side, one node each at most; 1 … 1024
                            ///< or 0 = automatic (32–72)
  std::uint64_t seed = 0;  ///< other seeds give other nodes of the same axis
  unsigned threads = 0;    ///< 0 = all cores; never changes the result
  Device device = Device::automatic;
  GpuSettings gpu = {};  ///< if `device` is a GPU
};

/// An approximation of the medial axis: the first round of a grid packing.
///
/// One prototype per grid cell moves away from the surface, confined to its cell. Those that come
/// to rest between surface points over 45° apart are the nodes: Voronoi nodes between four, else
/// points of the axis' sheets and seams. Ordered by cell; the same for any device and number of
/// threads.
///
/// Throws Error on settings out of range, and for a Solid that is not a mesh.
std::vector<MedialNode> medial_nodes(const Solid& solid, const MedialSettings& settings = {});

}  // namespace ist
