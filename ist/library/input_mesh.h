#pragma once

#include <ist/mesh.h>

#include "library/settings/bake_settings.h"

namespace ist {

struct InputMesh {
  DeclaredFrame declared;
  ClosedMesh closed;
};

/// close_mesh() by `settings`; where it throws and they ask for a wrap, wrap_mesh(), noting why.
/// Throws Error.
ClosedMesh close_as_asked(TriangleMesh mesh, const std::string& name, const MeshSettings& settings);

/// Loads, scales, turns and closes a mesh. Throws Error.
InputMesh read_input_mesh(const std::string& path, const MeshSettings& settings);

/// Scales a loaded mesh by scale_mesh() and then turns it: the quarter turn about the third axis
/// that takes up_axis to world_up.
void place(TriangleMesh& mesh, const MeshSettings& settings);

/// An asset, and what its partners erred where an error was asked for.
struct Baked {
  Asset asset;
  std::vector<PartnerError> partners = {};
};

/// bake_mesh_only(), bake_to_error() or bake(), as the settings ask. Throws Error.
Baked bake_as_asked(const ClosedMesh& mesh, const BakeSettings& asked,
                    const ProgressCallback& progress);

}  // namespace ist
