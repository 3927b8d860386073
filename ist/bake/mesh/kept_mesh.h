#pragma once

#include <ist/asset.h>
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "bake/asset/asset_writer.h"
#include "base/thread_arena.h"
#include "mesh/geometry/mesh_view.h"
#include "mesh/mesh_solid.h"
#include "mesh/resolve/resolve.h"

namespace ist {

/// Maximum of blocks around a vertex; if there are more, a block lists only some of the others.
inline constexpr std::size_t kMostAround = 256;

/// The boundary of a solid as an asset stores it.
struct KeptMesh {
  std::shared_ptr<const MeshArrays> mesh;  ///< null: none, and `state` says why
  MeshState state = MeshState::none;
  double self_overlap_volume = 0;  ///< unit frame, as AssetView::self_overlap_volume
};

/// `resolution`: how the solid's mesh was made. Deterministic on any machine.
KeptMesh keep_mesh(const MeshSolid& solid, const Resolution& resolution);

/// A solid's mesh, laid out once and shared by all its assets. `wanted`: false: no mesh.
struct SharedMesh : Aside<KeptMesh> {
  SharedMesh(const MeshSolid& solid, const Resolution& resolution, bool wanted, unsigned threads)
      : Aside(threads, [&solid, &resolution, wanted](const WorkStop&) {
          return wanted ? keep_mesh(solid, resolution) : KeptMesh();
        }) {}
};

/// A closed, oriented mesh over float vertices, unit frame.
struct FloatMesh {
  using Vertex = std::array<float, 3>;
  using Triangle = std::array<std::uint32_t, 3>;  ///< counter-clockwise seen from outside

  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
};

FloatMesh in_floats(const MeshView& mesh);

/// Triangles of one block: at most kWidth, with at most kWidth vertices.
struct BlockPatch {
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> vertices;  ///< theirs, each once

  std::uint8_t place_of(std::uint32_t vertex) const {
    return static_cast<std::uint8_t>(std::find(vertices.begin(), vertices.end(), vertex) -
                                     vertices.begin());
  }
};

/// Cuts a mesh into full and compact patches. Each grows from a triangle by neighbours that add few
/// vertices and are near its middle; remaining small pieces are joined if they are near and share a
/// vertex. Every triangle is in one patch. Deterministic.
std::vector<BlockPatch> cut_into_patches(const FloatMesh& mesh);

/// An order of points in which neighbours are near each other: their box is halved across its
/// longest side recursively, so that every group of 16, 256, … from the start is compact. Ties are
/// broken by index. The same for any number of threads.
std::vector<std::uint32_t> spatial_order(std::span<const std::array<float, 3>> points);

}  // namespace ist
