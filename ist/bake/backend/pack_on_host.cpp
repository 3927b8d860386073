#include "bake/backend/pack_on_host.h"

#include <ist/error.h>

#include "packing/banded/banded_packer.h"
#include "packing/banded/field_surface.h"
#include "packing/banded/mesh_surface.h"
#include "packing/base/packing_settings.h"
#include "packing/grids/pack_grids.h"

namespace ist::packing {
namespace {

SpherePacking packed(const Solid& solid, const UnitFrame& frame, const PackingSettings& settings,
                     const ProgressCallback& progress) {
  const MeshSolid* const mesh = solid.mesh();
  Stage stage("pack", progress, settings.time_limit);
  if (settings.grid != GridMode::banded) {
    if (mesh == nullptr)
      throw Error(
          "packing: only the banded mode packs solids that are not meshes; set grid to banded");
    return pack_grids(*mesh, settings, stage);
  }
  const PackingLimits limits = packing_limits(solid, frame.scale(), settings);
  if (mesh != nullptr) {
    const MeshSurface surface(*mesh);
    return BandedPacker(surface, limits, stage).run();
  }
  const FieldSurface surface(solid, frame);
  return BandedPacker(surface, limits, stage).run();
}

}  // namespace

SpherePacking pack_on_host(const Solid& solid, const PackingSettings& settings,
                           const ProgressCallback& progress) {
  const MeshSolid* const mesh = solid.mesh();
  const UnitFrame frame = mesh != nullptr ? mesh->frame() : unit_frame(solid.bounds());
  SpherePacking result = packed(solid, frame, settings, progress);
  result.frame = frame;
  return result;
}

}  // namespace ist::packing
