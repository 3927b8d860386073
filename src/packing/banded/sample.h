#pragma once

#include <ist/types.h>

#include "base/hashing.h"
#include "base/team.h"
#include "base/vec3.h"

// Samples of the surroundings of a point. Written for a team (base/team.h) whose lanes share a
// SampleMemory. Every result is a function of the *set* of features, not of their order.

namespace ist::packing {

/// The distance to one feature (sphere, triangle, surface point) around a point x. For |y| ≤ h,
///   distance + gradient·y ≤ feature's distance at x + y ≤ distance + gradient·y + curvature h²:
/// the left side because these features are convex, the right side because the distance to a point
/// at range l obeys |v + y| ≤ l + v·y/l + |y|²/(2l).
struct Constraint {
  Float3 gradient;        ///< unit vector away from the feature; 0 at the feature itself
  float distance = 0;     ///< signed: negative inside a sphere
  float curvature = 0;    ///< 1/(2l), l the distance to the sphere's centre or to the closest point
  std::uint32_t tag = 0;  ///< identifies the feature: breaks ties independently of the order
};

// Tags: a sphere's is its index; a triangle's and its plane's are these with the triangle's index.
constexpr std::uint32_t kSurfaceTag = 0x80000000u;
constexpr std::uint32_t kPlaneTag = 0xC0000000u;

/// The offset of a point from a feature that is a ball about its closest point.
struct FeatureOffset {
  Float3 away;       ///< from the closest point, or a sphere's centre, to the query
  float range2 = 0;  ///< |away|²
  float radius = 0;  ///< of a sphere; 0 for a surface
  std::uint32_t tag = 0;
};

/// The result of a surface search within a limit.
template <class Feature>
struct NearestFeature {
  Feature feature{};
  float distance = 0;  ///< of the feature; the limit if there is none
  bool found = false;
};

/// The ball {centre, radius} seen from x. A surface point is a ball of radius 0.
IST_HD inline FeatureOffset ball_offset(Float3 centre, float radius, std::uint32_t tag, Float3 x) {
  const Float3 away = x - centre;
  return {away, dot(away, away), radius, tag};
}

IST_HD inline Constraint constraint_of(const FeatureOffset& offset, float range) {
  const float inverse = range > 0 ? 1 / range : 0;
  return {inverse * offset.away, range - offset.radius, range > 0 ? 0.5f * inverse : 1e30f,
          offset.tag};
}

constexpr int kSampleCapacity =
    26;  ///< with the sides of a cell, one row a lane (linear_program.h)

/// Constraints side by side, so that lanes read neighbouring words.
struct SampleMemory {
  float gradient[3][kSampleCapacity];
  float distance[kSampleCapacity];
  float curvature[kSampleCapacity];
  std::uint32_t tag[kSampleCapacity];
};

template <class Team>
IST_HD Constraint get(const Team& team, const SampleMemory* at, int i) {
  const SampleMemory& memory = *team.memory(at);
  return {{memory.gradient[0][i], memory.gradient[1][i], memory.gradient[2][i]},
          memory.distance[i],
          memory.curvature[i],
          memory.tag[i]};
}

template <class Team>
IST_HD void put(const Team& team, SampleMemory* at, int i, const Constraint& c) {
  SampleMemory& memory = *team.memory(at);
  memory.gradient[0][i] = c.gradient.x;
  memory.gradient[1][i] = c.gradient.y;
  memory.gradient[2][i] = c.gradient.z;
  memory.distance[i] = c.distance;
  memory.curvature[i] = c.curvature;
  memory.tag[i] = c.tag;
}

/// The field around a point: its clearance (distance to the features searched; ≤ 0 inside a sphere)
/// and the constraints of the features that can matter near it. Any subset of constraints gives a
/// bound, so one that does not fit may be left out. The same in all lanes except for the memory.
struct Sample {
  SampleMemory* at = nullptr;
  int size = 0;
  float clearance = 0;
};

constexpr float kFarAway = 3e38f;  ///< distance of missing features

/// Index of the item with the least (value, tag) of all lanes; equal items are interchangeable.
/// Lanes without an item pass kFarAway. `value` becomes the least.
template <class Team>
IST_HD int index_of_least(const Team& team, float& value, std::uint32_t tag, int index) {
  if constexpr (Team::kWidth == 1) return index;
  const float least = team.min(value);
  const bool holds = value == least;
  value = least;
  int holders = 0;
  int lane = team.first(holds, holders);
  if (holders > 1) {
    const std::uint32_t low = team.min(holds ? tag : 0xFFFFFFFFu);
    lane = team.first(holds && tag == low, holders);
  }
  return team.broadcast(index, lane);
}

/// Adds a constraint that all lanes know, unless the sample is full.
template <class Team>
IST_HD void add(const Team& team, const Constraint& c, Sample& s) {
  if (c.distance < s.clearance) s.clearance = c.distance;
  if (s.size == kSampleCapacity) return;
  if (team.lane() == 0) put(team, s.at, s.size, c);
  ++s.size;
  team.sync();
}

/// Drops constraints further than the nearest + window.
template <class Team>
IST_HD_ONCE Sample keep_near(const Team& team, float window, Sample s) {
  const SampleMemory& memory = *team.memory(s.at);
  const float limit = s.clearance + window;
  int kept = 0;
  const int end = Team::kWidth < kSampleCapacity ? s.size : 1;  // one step of a wide team
  IST_ROLLED for (int base = 0; base < end; base += Team::kWidth) {
    const int i = base + team.lane();
    const bool keep = i < s.size && memory.distance[i] <= limit;
    int total = 0;
    const int place = kept + team.exclusive_count(keep, total);
    const int here = s.size - base < Team::kWidth ? s.size - base : Team::kWidth;
    if (kept != base || total != here) {
      Constraint c;
      if (keep) c = get(team, s.at, i);
      team.sync();
      if (keep) put(team, s.at, place, c);
    }
    kept += total;
  }
  s.size = kept;
  team.sync();
  return s;
}

/// Adds one constraint to a full sample of `capacity` constraints, and drops the farthest by
/// (distance, tag). All lanes know `c`.
template <class Team>
IST_HD void add_nearer(const Team& team, const Constraint& c, int capacity, const Sample& s) {
  const SampleMemory& memory = *team.memory(s.at);
  float least = kFarAway;  // of the negated distances
  std::uint32_t tag = 0xFFFFFFFFu;
  int index = 0;
  IST_ROLLED for (int i = team.lane(); i < capacity; i += Team::kWidth) {
    const float value = -memory.distance[i];
    const std::uint32_t reversed = ~memory.tag[i];
    if (value < least || (value == least && reversed < tag)) {
      least = value;
      tag = reversed;
      index = i;
    }
  }
  index = index_of_least(team, least, tag, index);
  const bool nearer = c.distance < -least || (c.distance == -least && c.tag < memory.tag[index]);
  team.sync();
  if (nearer && team.lane() == 0) put(team, s.at, index, c);
  team.sync();
}

/// Adds the constraints of the lanes that have one, and keeps the nearest if not all fit.
template <class Team>
IST_HD_COLD Sample add_nearest(const Team& team, bool has, const Constraint& mine, int capacity,
                               Sample s) {
  IST_ROLLED for (int lane = 0; lane < Team::kWidth; ++lane) {
    if (team.broadcast(has ? 1 : 0, lane) == 0) continue;
    Constraint c;
    c.gradient = {team.broadcast(mine.gradient.x, lane), team.broadcast(mine.gradient.y, lane),
                  team.broadcast(mine.gradient.z, lane)};
    c.distance = team.broadcast(mine.distance, lane);
    c.curvature = team.broadcast(mine.curvature, lane);
    c.tag = team.broadcast(mine.tag, lane);
    if (s.size == capacity) {
      add_nearer(team, c, capacity, s);
    } else {
      if (team.lane() == 0) put(team, s.at, s.size, c);
      ++s.size;
      team.sync();
    }
  }
  return s;
}

/// Samples the spheres near x: those no further than the nearest + window, and only the nearest of
/// them if fewer than `spare` entries would stay free. The grid's reach limits the search.
template <class Team, class Spheres>
IST_HD_ONCE Sample sample_spheres(const Team& team, Float3 x, const Spheres& spheres, float window,
                                  int spare, SampleMemory* at) {
  constexpr int kBatch = Team::kBatch;
  FeatureOffset offset[kBatch];
  float range[kBatch], distance[kBatch];
  const int capacity = kSampleCapacity - spare;
  int count = 0, batches = 0;
  Sample out{at, 0, spheres.reach()};
  team.sync();  // all lanes are done with the previous content
  const auto flush = [&] {
    float nearest = kFarAway;
    IST_ROLLED for (int i = 0; i < count; ++i) {
      range[i] = sqrtf(offset[i].range2);
      distance[i] = range[i] - offset[i].radius;
    }
    IST_ROLLED for (int i = 0; i < count; ++i) nearest =
        distance[i] < nearest ? distance[i] : nearest;
    nearest = team.min(nearest);
    out.clearance = nearest < out.clearance ? nearest : out.clearance;
    IST_ROLLED for (int i = 0; i < count; ++i) {
      const bool near = distance[i] <= out.clearance + window;
      int total = 0;
      const int place = team.exclusive_count(near, total);
      if (total == 0) continue;
      if (out.size + total > capacity) {
        team.sync();
        out = keep_near(team, window, out);
      }
      if (out.size + total <= capacity) {
        if (near) put(team, out.at, out.size + place, constraint_of(offset[i], range[i]));
        out.size += total;
      } else {
        out = add_nearest(team, near, constraint_of(offset[i], range[i]), capacity, out);
      }
    }
    count = 0;
    ++batches;
  };
  spheres.for_near(team, x, [&](bool valid, std::uint32_t index, const Sphere& s) {
    offset[count] = ball_offset({s.x, s.y, s.z}, s.r, index, x);
    if (!valid) offset[count].range2 = kFarAway;
    if (++count == kBatch) flush();
  });
  if constexpr (kBatch > 1)
    if (count > 0) flush();
  team.sync();
  // The first batch was filtered by its own nearest.
  return batches > 1 ? keep_near(team, window, out) : out;
}

/// Clearance of a point to the spheres alone, no more than the grid's reach.
template <class Team, class Spheres>
IST_HD float sphere_clearance(const Team& team, Float3 x, const Spheres& spheres) {
  float clearance = spheres.reach();
  spheres.for_near(team, x, [&](bool valid, std::uint32_t, const Sphere& s) {
    const float distance = norm(x - Float3{s.x, s.y, s.z}) - s.r;
    if (valid && distance < clearance) clearance = distance;
  });
  return team.min(clearance);
}

}  // namespace ist::packing
