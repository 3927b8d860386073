#pragma once

#include <cstdint>
#include <vector>

#include "bake/field/field_hierarchy.h"
#include "bake/field/field_mesh.h"
#include "mesh/mesh_view.h"

namespace ist {

/// How far a field's surface is from the mesh that it is the image of: a bound e such that
/// - either surface lies within e of the other, and
/// - the winding number is the same about both at every point further than e from the field's.
///
/// The second is proven by moving every vertex of the mesh straight to its place in the field: the
/// triangles on their way sweep all points at which the winding numbers differ, and lie within e of
/// the field all along. Within about a quarter of the least such bound that this motion allows.
///
/// `mesh` has a hierarchy; `vertex_of`: a mesh vertex's place in the field. Unit frame, rounding
/// included. Deterministic.
double proven_error(const MeshView& mesh, const FieldMesh& field, const FieldHierarchy& hierarchy,
                    const std::vector<std::uint32_t>& vertex_of);

}  // namespace ist
