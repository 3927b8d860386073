#pragma once

#include <utility>

#include <ist/bake.h>

namespace ist::testing {

/// `threads`: 0: all.
inline PackingSettings of_size(std::size_t spheres, unsigned threads = 0) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.threads = threads;
  return settings;
}

/// `keep_mesh`: the asset contains its mesh.
inline Asset baked(TriangleMesh mesh, const char* name, std::size_t spheres,
                   bool keep_mesh = true) {
  PackingSettings settings = of_size(spheres);
  settings.keep_mesh = keep_mesh;
  return bake(close_mesh(std::move(mesh), name), settings);
}

}  // namespace ist::testing
