#include "packing/pack_on_cpu.h"

#include <ist/error.h>

#include "packing/band_limits.h"
#include "packing/banded_packer.h"
#include "packing/field_surface.h"
#include "packing/grids/pack_grids.h"
#include "packing/mesh_surface.h"
#include "packing/thread_arena.h"

namespace ist::packing {

SpherePacking pack_on_cpu(const Solid& solid, const PackingSettings& settings,
                          const ProgressCallback& progress) {
  const auto* mesh = dynamic_cast<const MeshSolid*>(&solid);
  const UnitFrame frame = mesh != nullptr ? mesh->frame() : unit_frame(solid.bounds());
  const double scale = frame.scale();
  const BandLimits limits = band_limits(solid, scale, settings);
  if (!(limits.volume > 0)) throw Error("packing: the solid's volume is not positive");
  if (settings.grid != GridMode::banded && mesh == nullptr)
    throw Error("packing: the grid modes pack meshes; pack other solids with the banded mode");

  SpherePacking result;
  thread_arena(settings.threads).execute([&] {
    if (settings.grid != GridMode::banded) {
      result = pack_grids(*mesh, settings, progress);
    } else if (mesh != nullptr) {
      const MeshSurface surface(*mesh);
      result = BandedPacker(surface, limits, settings.time_limit, scale, progress).run();
    } else {
      const FieldSurface surface(solid, frame);
      result = BandedPacker(surface, limits, settings.time_limit, scale, progress).run();
    }
  });
  result.frame = frame;
  return result;
}

}  // namespace ist::packing
