#pragma once

#include <tbb/parallel_for.h>

#include <cmath>
#include <cstddef>

#include "mesh/mesh_view.h"
#include "mesh/triangle_frame.h"
#include "stage/raw_array.h"

namespace ist {

/// Of all triangles, unit frame². Of `mesh` the arrays suffice.
inline double surface_area(const MeshView& mesh) {
  RawArray<double> areas(mesh.triangle_count);
  tbb::parallel_for(std::size_t{0}, areas.size(), [&](std::size_t t) {
    const auto corner = [&](std::size_t i) {
      return mesh.vertices + 3 * std::size_t{mesh.triangles[3 * t + i]};
    };
    double u[3], v[3], n[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = corner(1)[k] - corner(0)[k];
      v[k] = corner(2)[k] - corner(0)[k];
    }
    cross3(u, v, n);
    areas[t] = std::sqrt(dot3(n, n)) / 2;
  });
  double area = 0;  // in order: the same for any number of threads
  for (const double of_triangle : areas) area += of_triangle;
  return area;
}

}  // namespace ist
