#pragma once

#include <cmath>

#include "base/team.h"
#include "packing/grids/cell_listing.h"

// The closest point on surface ∪ spheres through the distance grid (paper §3). A cell's discrete
// distance shows that the Manhattan ball of that radius around it contains no primitive, and how
// much of a row of cells may be skipped. The answer is the minimum of one float formula over all
// primitives, then the smallest tag, whatever the grid and the order of the search.

namespace ist::packing {

struct NearestPrimitive {
  float distance = 0;  ///< negative inside a sphere
  std::uint32_t tag = kNoTag;
};

/// Distance and direction from a primitive to a point.
struct Clearance {
  float distance = 0;
  Float3 away;  ///< unit vector from the closest point to the query; zero at distance zero
};

IST_HD inline FramePoint<float> closest_on(const TriangleFrame<float>& f, Float3 p) {
  const float q[3] = {p.x, p.y, p.z};
  return closest_in_frame(f, q);
}

IST_HD inline float distance_to_triangle(const GridTriangle& triangle, Float3 p) {
  return sqrtf(closest_on(triangle.frame, p).distance2);
}

IST_HD inline float distance_to_sphere(const Sphere& s, Float3 p) {
  return norm(Float3{p.x - s.x, p.y - s.y, p.z - s.z}) - s.r;
}

IST_HD inline float distance_to(const GridScene& scene, std::uint32_t tag, Float3 p) {
  return (tag & kTriangleTag) != 0 ? distance_to_triangle(scene.triangles[tag & ~kTriangleTag], p)
                                   : distance_to_sphere(scene.spheres[tag], p);
}

IST_HD inline Clearance clearance_from(const GridScene& scene, std::uint32_t tag, Float3 p) {
  if ((tag & kTriangleTag) == 0) {
    const Sphere& s = scene.spheres[tag];
    const Float3 d{p.x - s.x, p.y - s.y, p.z - s.z};
    const float length = norm(d);
    return {length - s.r, (length > 0 ? 1 / length : 0.0f) * d};
  }
  const TriangleFrame<float>& f = scene.triangles[tag & ~kTriangleTag].frame;
  const FramePoint<float> q = closest_on(f, p);
  const float d[3] = {p.x - f.origin[0], p.y - f.origin[1], p.z - f.origin[2]};
  const float x = dot3(d, f.u) - q.x, y = dot3(d, f.v) - q.y, z = dot3(d, f.n);
  const float distance = sqrtf(q.distance2);
  const Float3 away{x * f.u[0] + y * f.v[0] + z * f.n[0], x * f.u[1] + y * f.v[1] + z * f.n[1],
                    x * f.u[2] + y * f.v[2] + z * f.n[2]};
  return {distance, (distance > 0 ? 1 / distance : 0.0f) * away};
}

/// Visits the entries of the lanes' cells, all lists in one sequence that the lanes share.
template <class Team, class Visit>
IST_HD void visit_lists(const Team& team, const DistanceGrid& grid, const CellRecord& mine,
                        Visit&& visit) {
  if constexpr (Team::kWidth == 1) {
    for (std::uint32_t n = 0; n < mine.triangle_count; ++n)
      visit(kTriangleTag | grid.triangle_lists[mine.triangles + n]);
    for (std::uint32_t n = 0; n < mine.sphere_count; ++n)
      visit(grid.sphere_lists[mine.spheres + n]);
  } else {
    const int lane = team.lane();
    const auto count = static_cast<int>(mine.triangle_count + mine.sphere_count);
    int sum = count;
    for (int d = 1; d < Team::kWidth; d *= 2) {
      const int other = team.broadcast(sum, lane >= d ? lane - d : lane);
      if (lane >= d) sum += other;
    }
    const int before = sum - count;  // entries of previous lanes
    const int total = team.broadcast(sum, Team::kWidth - 1);
    for (int first = 0; first < total; first += Team::kWidth) {
      const int entry = first + lane;
      int owner = 0;  // the last lane whose entries begin at or before this one
      for (int step = Team::kWidth / 2; step > 0; step /= 2)
        if (team.broadcast(before, owner + step) <= entry) owner += step;
      const auto n = static_cast<std::uint32_t>(entry - team.broadcast(before, owner));
      const std::uint32_t triangle_count = team.broadcast(mine.triangle_count, owner);
      const std::uint32_t triangles = team.broadcast(mine.triangles, owner);
      const std::uint32_t spheres = team.broadcast(mine.spheres, owner);
      if (entry < total)
        visit(n < triangle_count ? kTriangleTag | grid.triangle_lists[triangles + n]
                                 : grid.sphere_lists[spheres + (n - triangle_count)]);
    }
  }
}

/// A *crew* is several teams that work on one search, each on its part of the rows; otherwise all
/// make the same calls. It has part(), parts(), and the functions that nearest_primitive() uses
/// below.
template <class Team>
concept Crew = requires(const Team& team) {
  team.parts();
};

template <class Team>
IST_HD bool takes_part(const Team& team, int group) {
  if constexpr (Crew<Team>) return group % team.parts() == team.part();
  return true;
}

/// Visits the primitives of all cells within bound() of p, in growing square rings of rows along x,
/// one row a lane. `bound()` is the same in all lanes: nothing further away counts. `visit(tag)` is
/// called by single lanes; `settle()` by all, between visits.
template <class Team, class Bound, class Visit, class Settle>
IST_HD void for_primitives_near(const Team& team, const DistanceGrid& grid, Float3 p, Bound&& bound,
                                Visit&& visit, Settle&& settle) {
  const GridLayout& g = grid.layout;
  const int ci = g.at_x(p.x), cj = g.at_y(p.y), ck = g.at_z(p.z);
  const std::uint32_t own = grid.word(ci, cj, ck);
  const int empty = own == DistanceGrid::kInactive ? 0 : DistanceGrid::distance(own);
  const int most = (g.n[1] > g.n[2] ? g.n[1] : g.n[2]);
  int group = 0;
  for (int ring = 0; ring < most; ++ring) {
    if (static_cast<float>(ring - 1) * g.size - kSearchMargin > bound()) return;
    const int rows = ring == 0 ? 1 : 8 * ring;
    for (int first = 0; first < rows; first += Team::kWidth) {
      if (!takes_part(team, group++)) continue;
      const int row = first + team.lane();
      int dj = 0, dk = 0;
      if (ring > 0) {
        const int side = row / (2 * ring), along = row % (2 * ring) - ring;
        dj = side == 0 ? along : side == 1 ? ring : side == 2 ? -along : -ring;
        dk = side == 0 ? -ring : side == 1 ? along : side == 2 ? ring : -along;
      }
      const int j = cj + dj, k = ck + dk;
      const bool exists = row < rows && j >= 0 && j < g.n[1] && k >= 0 && k < g.n[2];
      float gap_y = dj > 0 ? g.low_y(j) - p.y : dj < 0 ? p.y - g.low_y(j + 1) : 0.0f;
      float gap_z = dk > 0 ? g.low_z(k) - p.z : dk < 0 ? p.z - g.low_z(k + 1) : 0.0f;
      gap_y = gap_y > 0 ? gap_y : 0;
      gap_z = gap_z > 0 ? gap_z : 0;
      const float gap2 = gap_y * gap_y + gap_z * gap_z;
      const int beside = (dj < 0 ? -dj : dj) + (dk < 0 ? -dk : dk);
      const int skip = empty > beside ? empty - beside : 0;
      for (int direction = 1; direction >= -1; direction -= 2) {
        int i = direction > 0 ? ci + skip : ci - (skip > 1 ? skip : 1);
        bool done = !exists;
        while (team.any(!done)) {
          std::uint32_t slot = DistanceGrid::kInactive;
          const float reach = bound() * (1 + 1e-6f) + kSearchMargin;
          while (!done) {
            float gap_x = direction > 0 ? g.low_x(i) - p.x : p.x - g.low_x(i + 1);
            gap_x = gap_x > 0 ? gap_x : 0;
            done = i < 0 || i >= g.n[0] || gap2 + gap_x * gap_x > reach * reach;
            if (done) break;
            const std::uint32_t word = grid.word(i, j, k);
            const int distance = word == DistanceGrid::kInactive ? 1 : DistanceGrid::distance(word);
            i += distance == 0 ? direction : direction * distance;
            if (distance != 0) continue;
            slot = DistanceGrid::slot(word);
            break;
          }
          visit_lists(team, grid,
                      slot == DistanceGrid::kInactive ? CellRecord{} : grid.records[slot], visit);
          settle();
        }
      }
    }
  }
}

/// The primitive nearest to p, the same in all lanes. `hint`: one that may be near, or kNoTag.
template <class Team>
IST_HD NearestPrimitive nearest_primitive(const Team& team, const GridScene& scene, Float3 p,
                                          std::uint32_t hint = kNoTag) {
  NearestPrimitive mine{hint == kNoTag ? 1e10f : distance_to(scene, hint, p), hint};
  float shared = mine.distance;
  if constexpr (Crew<Team>) team.begin_search();
  for_primitives_near(
      team, scene.grid, p, [&] { return shared; },
      [&](std::uint32_t tag) {
        const float distance = distance_to(scene, tag, p);
        if (distance < mine.distance || (distance == mine.distance && tag < mine.tag))
          mine = {distance, tag};
      },
      [&] {
        shared = team.min(mine.distance);
        if constexpr (Crew<Team>) shared = team.least_so_far(shared);
      });
  const float least = team.min(mine.distance);
  const std::uint32_t tag = team.min(mine.distance == least ? mine.tag : kNoTag);
  if constexpr (Crew<Team>) {
    const std::uint64_t found = team.end_search(std::uint64_t{ordered_bits(least)} << 32 | tag);
    return {from_ordered_bits(static_cast<std::uint32_t>(found >> 32)),
            static_cast<std::uint32_t>(found)};
  } else {
    return {least, tag};
  }
}

}  // namespace ist::packing
