#pragma once

#include <ist/bake.h>

#include <oneapi/tbb/collaborative_call_once.h>

#include <memory>

#include "asset/asset_writer.h"
#include "backend/solid_backend.h"
#include "mesh/mesh_solid.h"

namespace ist {

/// A solid's field, made when it is first asked for and shared by all its assets.
class SolidField {
 public:
  SolidField(const MeshSolid& solid, const FieldSettings& settings)
      : solid_(solid), settings_(settings) {}

  /// Null: not wanted, or the mesh meets itself. From any thread.
  std::shared_ptr<const FieldArrays> arrays();

 private:
  const MeshSolid& solid_;
  const FieldSettings settings_;
  oneapi::tbb::collaborative_once_flag made_;
  std::shared_ptr<const FieldArrays> arrays_;
};

/// bake() of a mesh whose solid, field and backend are at hand, on the threads of the current
/// arena. The settings have been checked; where they run is the backend's affair.
Asset bake_solid(const ClosedMesh& mesh, const MeshSolid& solid, SolidField& field,
                 SolidBackend& backend, const PackingSettings& settings,
                 const ProgressCallback& progress);

/// Everything of that asset but its bytes.
AssetArrays bake_arrays(const ClosedMesh& mesh, const MeshSolid& solid, SolidField& field,
                        SolidBackend& backend, const PackingSettings& settings,
                        const ProgressCallback& progress);

}  // namespace ist
