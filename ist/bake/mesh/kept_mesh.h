#pragma once

#include <ist/asset.h>

#include "bake/asset/asset_writer.h"
#include "base/aside.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"

namespace ist {

/// Blocks around a vertex: where there are more, a block names only some of the others.
inline constexpr std::size_t kMostAround = 256;

/// The boundary of a solid as an asset stores it.
struct KeptMesh {
  std::shared_ptr<const MeshArrays> mesh;  ///< null: none, and `state` says why
  MeshState state = MeshState::none;
  double self_overlap_volume = 0;  ///< unit frame, as AssetView::self_overlap_volume
};

/// `resolution`: how the solid's mesh was made. Deterministic on any machine.
KeptMesh keep_mesh(const MeshSolid& solid, const Resolution& resolution);

/// A solid's mesh, laid out once and shared by all its assets; `wanted`: false: no mesh.
struct SharedMesh : Aside<KeptMesh> {
  SharedMesh(const MeshSolid& solid, const Resolution& resolution, bool wanted, unsigned threads)
      : Aside(threads, [&solid, &resolution, wanted](const WorkStop&) {
          return wanted ? keep_mesh(solid, resolution) : KeptMesh();
        }) {}
};

}  // namespace ist
