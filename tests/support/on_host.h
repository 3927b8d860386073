#pragma once

#include <ist/bake.h>

#include "bake/backend/make_backend.h"
#include "base/thread_arena.h"
#include "packing/calibrate/calibration.h"
#include "packing/cover/cover.h"

namespace ist::testing {

/// A solid's host backend.
inline std::unique_ptr<SolidBackend> host_backend(const MeshSolid& solid) {
  return make_backend(solid, Device::cpu);
}

/// Calibrates a whole packing.
inline Calibration calibrate(const MeshSolid& solid, SolidBackend& backend,
                             std::span<const Sphere> inner, const ProgressCallback& progress) {
  const std::size_t all = inner.size();
  Calibration result;
  calibrate_prefixes(solid, backend, inner, {&all, 1}, progress,
                     [&](std::size_t, Calibration made) { result = std::move(made); });
  return result;
}

/// calibrate() on so many host threads, 0 = all.
inline Calibration calibrate_on_host(const MeshSolid& solid, std::span<const Sphere> inner,
                                     unsigned threads = 0, const ProgressCallback& progress = {}) {
  return thread_arena(threads).execute(
      [&] { return calibrate(solid, *host_backend(solid), inner, progress); });
}

/// cover_radii() on so many host threads, 0 = all.
inline std::vector<float> cover_on_host(const MeshSolid& solid, std::span<const Sphere> inner,
                                        unsigned threads = 0,
                                        const ProgressCallback& progress = {}) {
  return thread_arena(threads).execute(
      [&] { return cover_radii(solid, *host_backend(solid), inner, progress); });
}

}  // namespace ist::testing
