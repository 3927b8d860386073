#include <ist/packing.h>

#include "bake/backend/make_backend.h"
#include "packing/base/packing_settings.h"
#include "stage/thread_arena.h"

namespace ist {

SpherePacking pack(const Solid& solid, const PackingSettings& settings,
                   const ProgressCallback& progress) {
  packing::check_settings(settings);
  return thread_arena(settings.threads).execute([&] {
    return make_backend(solid, {settings.device, settings.gpu})->pack(settings, progress);
  });
}

}  // namespace ist
