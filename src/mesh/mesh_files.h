#pragma once

#include <ist/mesh.h>

#include "mesh/import/source_file.h"

namespace ist {

/// Parses the bytes of a file for load_mesh().
TriangleMesh read_mesh(const SourceFile& file, const ImportSettings& settings);

/// A glTF node by node, in the file's frame: x_world = in_world · x.
struct MeshScene {
  struct Part {
    std::string name;          ///< may be another's too
    std::size_t mesh = 0;      ///< index into `meshes`, which parts share
    Eigen::Affine3d in_world;  ///< it may mirror and shear
  };
  std::vector<TriangleMesh> meshes;  ///< one without triangles is empty
  std::vector<Part> parts;
  std::vector<std::string> notes;  ///< as TriangleMesh::notes
  bool of_doubles = false;  ///< some number of its nodes is no float32, and no decimal of one
};

/// Throws Error as load_mesh() does.
MeshScene read_mesh_scene(const std::string& path);

/// Whether load_mesh() has a reader for files that end like this one.
bool is_mesh_format(const std::string& path);

/// All files that load_mesh(path) reads, `path` first: a glTF keeps its numbers beside it.
///
/// Nothing for a format that a third party reads, which may open others. Throws Error where `path`
/// cannot be read; what a broken file refers to is left out.
std::optional<std::vector<std::string>> files_of_mesh(const std::string& path);

}  // namespace ist
