#include <ist/bake.h>
#include <ist/types.h>
#include <string>

#include "bake/backend/make_backend.h"
#include "base/thread_arena.h"
#include "packing/base/packing_settings.h"

namespace ist {

std::vector<MedialNode> medial_nodes(const Solid& solid, const MedialSettings& settings) {
  if (solid.mesh() == nullptr) throw Error("medial axis: the solid must be a mesh");
  if (settings.resolution > kMostGridCells)
    throw Error("medial axis: resolution is " + std::to_string(settings.resolution) +
                ", must be at most " + std::to_string(kMostGridCells) + " (0 = automatic)");
  return thread_arena(settings.threads).execute([&] {
    return make_backend(solid, settings.device, settings.gpu)->medial_nodes(settings);
  });
}

SpherePacking pack(const Solid& solid, const PackingSettings& settings,
                   const ProgressCallback& progress) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    return make_backend(solid, settings.device, settings.gpu)->pack(settings, progress);
  });
}

}  // namespace ist
