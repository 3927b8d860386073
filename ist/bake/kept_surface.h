#pragma once

#include <ist/packing.h>
#include <ist/tree_view.h>

#include <memory>

#include "bake/aside.h"
#include "bake/asset/asset_writer.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"
#include "stage/work_stop.h"

namespace ist {

/// Blocks around a vertex: where there are more, a block names only some of the others.
inline constexpr std::size_t kMostAround = 256;

/// What an asset keeps of its solid's surface.
struct KeptSurface {
  std::shared_ptr<const SurfaceArrays> surface;  ///< null: none
  std::shared_ptr<const MeshArrays> mesh;        ///< null: none, and `state` says why
  MeshState state = MeshState::none;
  double counted_twice = 0;  ///< unit frame, as TreeView::counted_twice
  double asked_error = 0;    ///< [u] 0: the mesh's own triangles
};

/// `resolution`: how the solid's mesh was made. `with_surface`: false: the mesh alone. No surface
/// where the mesh reaches far into itself, or `stop` ends it. Throws Error as build_surface() does.
/// Same bytes for any number of threads.
KeptSurface keep_surface(const MeshSolid& solid, const Resolution& resolution,
                         const SurfaceSettings& settings, bool with_surface,
                         const WorkStop& stop = WorkStop());

/// A solid's surface and mesh, made once and shared by all its assets. `time_limit`: after it
/// there is no surface. wait() throws Error as keep_surface() does.
struct SharedSurface : Aside<KeptSurface> {
  SharedSurface(const MeshSolid& solid, const Resolution& resolution,
                const SurfaceSettings& settings, unsigned threads, double time_limit = 0)
      : Aside(
            threads,
            [&solid, &resolution, settings](const WorkStop& stop) {
              return keep_surface(solid, resolution, settings, true, stop);
            },
            time_limit) {}
};

}  // namespace ist
