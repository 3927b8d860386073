#pragma once

#include <cstdint>
#include <vector>

#include "bake/field/field_hierarchy.h"
#include "bake/field/field_mesh.h"
#include "bake/field/swept_error.h"
#include "mesh/mesh_view.h"
#include "stage/work_stop.h"

namespace ist {

/// How a field's surface differs from the mesh that it is the image of. Unit frame. Deterministic.
class FieldError {
 public:
  /// All must outlive this. `mesh` has a hierarchy; `vertex_of`: a mesh vertex's place in the
  /// field.
  /// What is asked of it may be ended by `stop`.
  FieldError(const MeshView& mesh, const FieldMesh& field, const FieldHierarchy& hierarchy,
             const std::vector<std::uint32_t>& vertex_of, const WorkStop& stop);

  /// What is seen at samples, by vertex of the mesh: its distance from the field, or that of the
  /// middle of a field's triangle about its place from the mesh. Exact where above `enough`.
  std::vector<double> seen(double enough) const;

  /// A bound e such that
  /// - either surface lies within e of the other, and
  /// - the winding number is the same about both at every point further than e from the field's.
  ///
  /// The second is proven by moving every vertex of the mesh straight to its place in the field:
  /// the triangles on their way sweep all points at which the winding numbers differ, and lie
  /// within e of the field all along. Rounding is included. `seen`: the largest error seen.
  struct Proven {
    double most = 0;                ///< e
    std::vector<double> at_vertex;  ///< what is shown about each vertex of the mesh
  };
  Proven proven(double seen) const;

 private:
  const MeshView& mesh_;
  const FieldMesh& field_;
  const std::vector<std::uint32_t>& vertex_of_;
  const WorkStop& stop_;
  SweptError swept_;
  std::vector<double> middle_;  ///< [field triangle] its middle's distance from the mesh
};

}  // namespace ist
