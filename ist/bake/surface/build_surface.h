#pragma once

#include <optional>

#include "bake/asset/asset_writer.h"
#include "bake/surface/float_mesh.h"
#include "mesh/mesh_solid.h"
#include "stage/work_stop.h"

namespace ist {

/// A surface for queries: as it is asked, and as it will lie in the file.
struct BuiltSurface {
  SurfaceArrays arrays;
  FloatMesh mesh;
  bool own = false;  ///< the solid's own triangles, none of them left out or merged
};

/// The surface of a mesh's solid for queries: the mesh's own triangles or fewer near them
/// (asset_layout.h draws it). Its error is proven.
///
/// `max_error`: unit frame; as few triangles stay as that allows. 0: all.
/// Nothing for a mesh that meets itself, where that reaches further than 0.5 % of the solid's size
/// or half of `max_error`. Throws Error
/// where floats cannot be as exact as `max_error`, WorkStop::Stopped if `stop` ends it. Same bytes
/// for any number of threads and on any machine.
std::optional<BuiltSurface> build_surface(const MeshSolid& solid, double max_error,
                                          const WorkStop& stop = WorkStop());

}  // namespace ist
