#pragma once

#include <ist/mesh.h>

#include "mesh/import/source_file.h"

namespace ist {

/// Parses the bytes of a file for load_mesh().
TriangleMesh read_mesh(const SourceFile& file, const ImportSettings& settings);

/// A glTF node by node, in the file's frame: x_world = in_world · x.
struct MeshScene {
  struct Part {
    std::string name;          ///< not unique
    std::size_t mesh = 0;      ///< index into `meshes`, which parts share
    Eigen::Affine3d in_world;  ///< it may mirror and shear
  };
  std::vector<TriangleMesh> meshes;  ///< one without triangles is empty
  std::vector<Part> parts;
  std::vector<std::string> notes;  ///< as TriangleMesh::notes
  bool of_doubles = false;  ///< some number of its nodes is neither a float32 nor a decimal of one
};

/// Throws Error like load_mesh().
MeshScene read_mesh_scene(const std::string& path);

/// True if load_mesh() has a reader for files with this extension.
bool is_mesh_format(const std::string& path);

/// All files that load_mesh(path) reads, `path` first: a glTF stores its numbers beside it.
///
/// Nothing for a format that a third party reads, which may open other files. Throws Error if
/// `path` cannot be read; missing files are left out.
std::optional<std::vector<std::string>> files_of_mesh(const std::string& path);

}  // namespace ist
