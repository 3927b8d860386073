#pragma once

#include <tbb/concurrent_unordered_map.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/surface/hull_cuts.h"
#include "bake/surface/surface_hierarchy.h"
#include "bake/surface/vertex_clusters.h"
#include "mesh/item_groups.h"
#include "mesh/mesh_view.h"
#include "mesh/triangle_frame.h"
#include "stage/work_stop.h"

namespace ist {

/// How far from a surface the triangles of a mesh come while their vertices move straight
/// to their places in the surface. Distances in the unit frame, before rounding.
class SweptError {
 public:
  /// All must outlive this.
  SweptError(const MeshView& mesh, const Clustered& surface, const SurfaceHierarchy& hierarchy);

  /// Of a used vertex of the mesh where it starts from: exact where above `enough`, else no less;
  /// at most `known` where it is not more. Safe from several threads for different vertices.
  double at_vertex(std::uint32_t vertex, double known, double enough);

  /// All that a triangle of the mesh sweeps is within `distance` of one triangle near its vertices'
  /// places: bound() for that target is no more.
  bool is_within(std::uint32_t triangle, double distance) const;

  /// A bound for all points that a triangle of the mesh sweeps, at most `target` where that can be
  /// shown. `one_may_do`: false where is_within() says no.
  double bound(std::uint32_t triangle, double target, bool one_may_do) const;

 private:
  using Point = std::array<double, 3>;

  /// What a part of a triangle sweeps in a part of the time: it lies in the hull of six points.
  struct Prism {
    Point corner[6];  ///< at the start, at the end
    Point centre() const;
    double radius(const Point& centre) const;
    /// Halved across its longest side, or in time.
    std::array<Prism, 2> halves() const;
  };

  double distance2(std::uint32_t surface_triangle, const Point& p) const {
    return closest_in_frame(cuts_.frame(surface_triangle), p.data()).distance2;
  }
  /// Farthest corner from a triangle, squared; any value > limit2 once one is further. The distance
  /// to a triangle is convex, so that no point of the hull is further.
  double farthest2(std::uint32_t surface_triangle, const Prism& prism, double limit2) const;
  double bound(const Prism& prism, std::span<const std::uint32_t> candidates, double target,
               bool one_may_do) const;
  Point place_of(std::uint32_t surface_vertex) const {
    const FloatMesh::Vertex& x = surface_.mesh.vertices[surface_vertex];
    return {x[0], x[1], x[2]};
  }

  const MeshView& mesh_;
  const Clustered& surface_;
  const SurfaceHierarchy& hierarchy_;
  HullCuts cuts_;                         ///< of the surface
  const ItemGroups<> stars_;              ///< the triangles around each surface vertex
  std::vector<std::uint32_t> near_;       ///< [mesh vertex] a triangle that it is near to, if known
  std::vector<std::uint32_t> last_near_;  ///< [cluster] the last such; a hint alone
};

/// Distances of points from a mesh, each found once: most triangles of a surface stay as they are
/// while a few of its clusters are divided. Safe from several threads.
class KnownDistances {
 public:
  /// `mesh` has a hierarchy and must outlive this.
  explicit KnownDistances(const MeshView& mesh) : mesh_(mesh) {}

  double of(const std::array<double, 3>& p);

 private:
  struct Hash {
    std::size_t operator()(const std::array<double, 3>& p) const;
  };
  const MeshView& mesh_;
  tbb::concurrent_unordered_map<std::array<double, 3>, double, Hash> known_;
};

/// A bound on how far points of some triangles are from a surface, unit frame; within 1e-8 of what
/// is seen where that is less.
double farthest_from(const SurfaceHierarchy& surface, const FloatMesh& triangles);

/// How a surface differs from the mesh that it is the image of. Unit frame. Deterministic.
class SurfaceError {
 public:
  /// All must outlive this. `mesh` has a hierarchy, `hierarchy` is that of the surface's triangles,
  /// `from_mesh` are distances from the mesh. What is asked of it may be ended by `stop`.
  SurfaceError(const MeshView& mesh, KnownDistances& from_mesh, const Clustered& surface,
               const SurfaceHierarchy& hierarchy, const WorkStop& stop);

  /// What is seen at samples, by cluster: how far a vertex of it is from the surface, or the middle
  /// of a surface's triangle about its place from the mesh. Exact where above `enough`.
  std::vector<double> seen(double enough);

  /// A bound e such that
  /// - either of the two lies within e of the other, and
  /// - the winding number is the same about both at every point further than e from the surface's.
  ///
  /// The second is proven by moving every vertex of the mesh straight to its place in the surface:
  /// the triangles on their way sweep all points at which the winding numbers differ, and lie
  /// within e of the surface all along. Rounding is included. `seen`: the largest error seen.
  struct Proven {
    double most = 0;  ///< e
    /// [cluster] What is shown about its vertices; exact where above `enough`.
    std::vector<double> at_cluster;
  };
  Proven proven(double seen, double enough) const;

 private:
  /// The largest number of a surface's triangle about each cluster's place.
  std::vector<double> by_cluster(const std::vector<double>& of_triangle) const;

  const MeshView& mesh_;
  const Clustered& surface_;
  const WorkStop& stop_;
  SweptError swept_;
  std::vector<double> middle_;  ///< [surface triangle] its middle's distance from the mesh
};

}  // namespace ist
