#pragma once

#include <ist/mesh.h>
#include <map>

#include "mesh/import/source_file.h"

namespace ist {

/// The polygons of a mesh file. Corner indices are valid; coordinates may still be infinite or NaN.
struct PolygonMesh {
  std::vector<Eigen::Vector3d> vertices;  ///< [u]
  std::vector<std::uint32_t> corners;     ///< of all polygons, one after the other
  std::vector<std::size_t> ends;          ///< polygon i ends before corners[ends[i]]
  /// Replaces both if a reader finds only triangles.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  /// Text files only: the line of each vertex that is not finite.
  std::map<std::uint32_t, std::size_t> line_of_nonfinite;
  DeclaredFrame declared;
  std::vector<std::string> notes;  ///< as TriangleMesh::notes

  void add_triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    corners.insert(corners.end(), {a, b, c});
    ends.push_back(corners.size());
  }
};

/// This library's own readers. Coordinates are double, every index and count is checked. Each
/// throws an Error that names the file and the line, byte or element.
PolygonMesh read_obj(const SourceFile& file);
PolygonMesh read_stl(const SourceFile& file);
PolygonMesh read_ply(const SourceFile& file);
PolygonMesh read_off(const SourceFile& file);

/// glTF 2.0: the default scene with its node transforms, instances, skins in the pose of their
/// joints, and morph targets by the default weights.
PolygonMesh read_gltf(const SourceFile& file);

/// The same, node by node: meshes in their own frames, shared by the nodes that instance them.
struct GltfParts {
  struct Part {
    std::string name;          ///< the node's; numbered for several instances
    std::size_t mesh = 0;      ///< index into `meshes`
    Eigen::Affine3d in_world;  ///< it may mirror and shear
  };
  std::vector<PolygonMesh> meshes;
  std::vector<Part> parts;  ///< in the order of the scene
  bool of_doubles = false;  ///< some number of its nodes is neither a float32 nor a decimal of one
  std::vector<std::string> notes;
};
GltfParts read_gltf_parts(const SourceFile& file);

/// COLLADA: the visual scene with its node transforms, in metres, on the file's axes; skins in bind
/// pose.
PolygonMesh read_collada(const SourceFile& file);

/// Any other format that assimp reads, the transforms of root and nodes applied, on the file's own
/// axes. Coordinates pass through float.
PolygonMesh read_with_assimp(const SourceFile& file);

/// Triangulates polygons: a fan where it is valid, else by ear clipping in the polygon's plane
/// (Newell normal), so that concave polygons are correct. Triangles are moved out of the mesh.
std::vector<std::array<std::uint32_t, 3>> triangulate(PolygonMesh& mesh);

/// Appends the triangles of one polygon of three or more corners.
void triangulate_polygon(const std::vector<Eigen::Vector3d>& vertices, const std::uint32_t* corners,
                         std::size_t count, std::vector<std::array<std::uint32_t, 3>>& out);

}  // namespace ist
