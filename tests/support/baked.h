#pragma once

#include <utility>

#include <ist/bake.h>

namespace ist::testing {

/// `field`: whether the asset holds its surface.
inline Asset baked(TriangleMesh mesh, const char* name, std::size_t spheres, bool field = true) {
  PackingSettings settings;
  settings.max_spheres = spheres;
  settings.surface.wanted = field;
  return bake(close_mesh(std::move(mesh), name), settings);
}

}  // namespace ist::testing
