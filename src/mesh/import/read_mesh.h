#pragma once

#include <ist/mesh.h>

#include "mesh/import/source_file.h"

namespace ist {

/// What load_mesh() does with a file once its bytes are in memory.
TriangleMesh read_mesh(const SourceFile& file, const ImportSettings& settings);

}  // namespace ist
