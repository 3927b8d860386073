#pragma once

#include <ist/mesh.h>

#include "library/settings/bake_settings.h"

namespace ist {

struct InputMesh {
  DeclaredFrame declared;
  ClosedMesh closed;
};

/// close_mesh() by `settings`; if it throws and a wrap is requested, wrap_mesh() with a note.
/// Throws Error.
ClosedMesh close_as_asked(TriangleMesh mesh, const std::string& name, const MeshSettings& settings);

/// Loads, scales, rotates and closes a mesh. Throws Error.
InputMesh read_input_mesh(const std::string& path, const MeshSettings& settings);

/// Scales a loaded mesh by scale_mesh() and then rotates it: the quarter turn about the third axis
/// that maps up_axis to world_up.
void place(TriangleMesh& mesh, const MeshSettings& settings);

/// An asset, and its errors by partner if an error was requested.
struct Baked {
  Asset asset;
  std::vector<PartnerError> partners = {};
};

/// bake_mesh_only(), bake_to_error() or bake(), according to the settings. Throws Error.
Baked bake_as_asked(const ClosedMesh& mesh, const BakeSettings& asked,
                    const ProgressCallback& progress);

}  // namespace ist
