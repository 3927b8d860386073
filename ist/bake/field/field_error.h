#pragma once

#include <tbb/concurrent_unordered_map.h>

#include <array>
#include <cstddef>
#include <vector>

#include "bake/field/field_hierarchy.h"
#include "bake/field/swept_error.h"
#include "bake/field/vertex_clusters.h"
#include "mesh/mesh_view.h"
#include "stage/work_stop.h"

namespace ist {

/// Distances of points from a mesh, each found once: most triangles of a field stay as they are
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

/// How a field's surface differs from the mesh that it is the image of. Unit frame. Deterministic.
class FieldError {
 public:
  /// All must outlive this. `mesh` has a hierarchy, `hierarchy` is that of the field's triangles,
  /// `from_mesh` are distances from the mesh. What is asked of it may be ended by `stop`.
  FieldError(const MeshView& mesh, KnownDistances& from_mesh, const Clustered& field,
             const FieldHierarchy& hierarchy, const WorkStop& stop);

  /// What is seen at samples, by cluster: how far a vertex of it is from the field, or the middle
  /// of a field's triangle about its place from the mesh. Exact where above `enough`.
  std::vector<double> seen(double enough);

  /// A bound e such that
  /// - either surface lies within e of the other, and
  /// - the winding number is the same about both at every point further than e from the field's.
  ///
  /// The second is proven by moving every vertex of the mesh straight to its place in the field:
  /// the triangles on their way sweep all points at which the winding numbers differ, and lie
  /// within e of the field all along. Rounding is included. `seen`: the largest error seen.
  struct Proven {
    double most = 0;  ///< e
    /// [cluster] What is shown about its vertices; exact where above `enough`.
    std::vector<double> at_cluster;
  };
  Proven proven(double seen, double enough) const;

 private:
  /// The largest number of a field's triangle about each cluster's place.
  std::vector<double> by_cluster(const std::vector<double>& of_triangle) const;

  const MeshView& mesh_;
  const Clustered& field_;
  const WorkStop& stop_;
  SweptError swept_;
  std::vector<double> middle_;  ///< [field triangle] its middle's distance from the mesh
};

}  // namespace ist
