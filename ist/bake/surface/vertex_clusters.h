#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/surface/float_mesh.h"
#include "mesh/item_groups.h"
#include "mesh/mesh_view.h"
#include "stage/raw_array.h"

namespace ist {

/// Of a triangle.
struct AreaVector {
  double n[3];    ///< twice the area times the normal
  double length;  ///< of n
};

/// A corner of a triangle and its plane.
struct CornerPlane {
  AreaVector triangle;
  double x[3];
};

/// Where a cluster of corners goes: as near as can be to their planes, weighted by area, and held
/// to their mean.
std::array<double, 3> placed(std::span<const CornerPlane> planes);

/// Distance of p from the plane that passes farthest from it.
double farthest_plane(std::span<const CornerPlane> planes, const std::array<double, 3>& p);

/// A surface with its vertices clustered.
struct Clustered {
  FloatMesh mesh;
  std::vector<std::uint32_t> cluster_of;  ///< [mesh vertex]
  std::vector<std::uint32_t> vertex_of;   ///< [cluster] its place in `mesh`; some share one

  std::uint32_t image(std::uint32_t mesh_vertex) const {
    return vertex_of[cluster_of[mesh_vertex]];
  }
};

/// Clusters of a closed mesh's vertices: those in one cell of an octree become one, in cells as
/// large as a tolerance allows. What is left of the triangles is closed, and as a chain the image
/// of the mesh. Deterministic.
class VertexClusters {
 public:
  /// `mesh`: arrays alone; its vertices must outlive this. `coarsest`: edge of the largest cells,
  /// unit frame, > 0; halved from level to level.
  VertexClusters(const MeshView& mesh, double coarsest, int levels);

  /// Vertices go to the largest cell in which the planes of all triangles pass within `tolerance`
  /// (unit frame) of the cluster's place; where no cell is small enough, they stay.
  Clustered within(double tolerance);

  /// Counts the clusters of the last within() as so far (unit frame) from their vertices, where
  /// that is further than their planes are.
  void raise(const std::vector<double>& distance_of_cluster);

 private:
  /// What is known of a cluster comes when it is asked for: most are far too large or too small.
  struct Level {
    double cell;  ///< edge, unit frame
    std::vector<std::uint32_t> of_vertex;
    ItemGroups<> vertices;                     ///< [cluster]
    std::vector<std::array<double, 3>> place;  ///< [cluster] where known; unit frame
    std::vector<double> off;  ///< [cluster] of the farthest plane, or less until known; unit frame
    std::vector<std::uint8_t> known;  ///< [cluster] or asked for
  };
  struct Doubt {
    std::uint32_t level, cluster;
  };

  Level level_of(double cell) const;
  /// Finds out where a cluster goes and how far that is off.
  void settle(Level& level, std::uint32_t cluster) const;
  CornerPlane plane_of(std::uint32_t corner, std::uint32_t vertex) const;
  /// Names of clusters of all levels, and of single vertices after them, for every vertex.
  std::vector<std::uint32_t> chosen(double tolerance);
  std::array<double, 3> place_of(std::size_t cluster, std::uint32_t vertex) const;
  std::vector<FloatMesh::Triangle> spanning(const std::vector<std::uint32_t>& cluster_of) const;

  const MeshView mesh_;
  ItemGroups<> corners_;        ///< [vertex] 3 triangle + k
  RawArray<AreaVector> areas_;  ///< [triangle]
  std::vector<Level> levels_;
  std::vector<std::uint32_t> names_;  ///< of the clusters of the last within()
};

}  // namespace ist
