#pragma once

#include <tbb/parallel_for.h>

#include <cmath>
#include <cstddef>

#include "mesh/exact_triangle.h"
#include "stage/raw_array.h"

namespace ist {

/// Of all triangles, unit frame². Of `mesh` the arrays suffice.
inline double surface_area(const MeshView& mesh) {
  RawArray<double> areas(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t i) {
    const Corners t = corners_of(mesh, i);
    double n[3];
    area_normal(t.p[0], t.p[1], t.p[2], n);
    areas[i] = std::sqrt(dot3(n, n)) / 2;
  });
  double area = 0;  // in order: the same for any number of threads
  for (const double of_triangle : areas) area += of_triangle;
  return area;
}

}  // namespace ist
