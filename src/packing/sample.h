#pragma once

#include <vector>

#include "packing/constraint.h"
#include "packing/sphere_grid.h"

namespace ist::packing {

/// The field around a point: its clearance (distance to what was looked at; ≤ 0 inside a sphere)
/// and the constraints of the features that can matter near it. Any subset of constraints gives a
/// bound, so one that does not fit may be left out.
struct Sample {
  static constexpr int kCapacity = 64;
  Constraint constraint[kCapacity];
  int size = 0;
  float clearance = 0;

  void add(const Constraint& c) {
    if (c.distance < clearance) clearance = c.distance;
    if (size < kCapacity) constraint[size++] = c;
  }

  /// Forgets what is further than the nearest + window.
  void keep_near(float window) {
    int kept = 0;
    for (int i = 0; i < size; ++i)
      if (constraint[i].distance <= clearance + window) constraint[kept++] = constraint[i];
    size = kept;
  }
};

inline void copy(const Sample& from, Sample& to) {
  to.size = from.size;
  to.clearance = from.clearance;
  for (int i = 0; i < from.size; ++i) to.constraint[i] = from.constraint[i];
}

/// Starts the sample at x with the spheres near it: those no further than the nearest + window.
/// Leaves room for `spare` more constraints. Sees no further than the grid's reach.
inline void sample_spheres(Float3 x, const std::vector<Sphere>& spheres, const SphereGrid& grid,
                           float window, int spare, Sample& out) {
  // In batches, so that distances are worked out side by side.
  constexpr int kBatch = 64;
  float dx[kBatch], dy[kBatch], dz[kBatch], radius[kBatch], range[kBatch], distance[kBatch];
  const int room = Sample::kCapacity - spare;
  int count = 0;
  out.size = 0;
  out.clearance = grid.reach();
  const auto flush = [&] {
    for (int i = 0; i < count; ++i) {
      range[i] = std::sqrt(dx[i] * dx[i] + dy[i] * dy[i] + dz[i] * dz[i]);
      distance[i] = range[i] - radius[i];
    }
    for (int i = 0; i < count; ++i)
      out.clearance = distance[i] < out.clearance ? distance[i] : out.clearance;
    for (int i = 0; i < count; ++i) {
      if (distance[i] > out.clearance + window) continue;
      if (out.size == room) out.keep_near(window);
      if (out.size == room) {
        int farthest = 0;
        for (int k = 1; k < room; ++k)
          if (out.constraint[k].distance > out.constraint[farthest].distance) farthest = k;
        if (distance[i] >= out.constraint[farthest].distance) continue;
        out.constraint[farthest] = out.constraint[--out.size];
      }
      const float inverse = range[i] > 0 ? 1 / range[i] : 0;
      out.constraint[out.size++] = {{inverse * dx[i], inverse * dy[i], inverse * dz[i]},
                                    distance[i],
                                    range[i] > 0 ? 0.5f * inverse : 1e30f};
    }
    count = 0;
  };
  grid.for_near(x, [&](std::uint32_t i) {
    const Sphere& s = spheres[i];
    dx[count] = x.x - s.x;
    dy[count] = x.y - s.y;
    dz[count] = x.z - s.z;
    radius[count] = s.r;
    if (++count == kBatch) flush();
  });
  flush();
  out.keep_near(window);
}

/// Clearance of a point to the spheres alone, no more than the grid's reach.
inline float sphere_clearance(Float3 x, const std::vector<Sphere>& spheres,
                              const SphereGrid& grid) {
  float clearance = grid.reach();
  grid.for_near(x, [&](std::uint32_t i) {
    const Sphere& s = spheres[i];
    const float distance = norm(x - Float3{s.x, s.y, s.z}) - s.r;
    if (distance < clearance) clearance = distance;
  });
  return clearance;
}

}  // namespace ist::packing
