#pragma once

#include <ist/mesh.h>

#include <optional>
#include <string>
#include <vector>

#include "mesh/import/source_file.h"

namespace ist {

/// What load_mesh() does with a file once its bytes are in memory.
TriangleMesh read_mesh(const SourceFile& file, const ImportSettings& settings);

/// Whether load_mesh() has a reader for files that end like this one.
bool is_mesh_format(const std::string& path);

/// All files that load_mesh(path) reads, `path` first: a glTF keeps its numbers beside it.
///
/// Nothing for a format that a third party reads, which may open others. Throws Error where `path`
/// cannot be read; what a broken file refers to is left out.
std::optional<std::vector<std::string>> files_of_mesh(const std::string& path);

}  // namespace ist
