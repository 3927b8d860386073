#pragma once

#include <cmath>

#include "base/bits.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/geometry/ray_crossing.h"
#include "mesh/hierarchy/wide_tree.h"

// Distances, winding numbers and line crossings of a WideTree, by a team (base/team.h). All lanes
// pass the same arguments and get the same result. The answers are those of closest_point.h,
// exact_triangle.h and winding.h, bit for bit.

namespace ist {

/// Closest triangle by the float formula.
struct WideNearest {
  float distance2 = 0;                   ///< unit frame, squared
  std::uint32_t triangle = kNoTriangle;  ///< index in the mesh, the smallest among equals
  std::uint32_t slot = kNoSlot;          ///< its slot in the tree
};

/// Closest triangle by the double formula.
struct WideExact {
  double distance = 0;                   ///< unit frame
  std::uint32_t triangle = kNoTriangle;  ///< index in the mesh, the smallest among equals
  std::uint32_t slot = kNoSlot;          ///< its slot in the tree
};

IST_HD inline Corners corners_in(const WideTree& tree, const WideBlock& block, int lane) {
  const auto at = [&](int i) { return tree.vertex(block.corner[i][lane]); };
  return {{at(0), at(1), at(2)}};
}

/// The exact corners of the triangle in a slot.
IST_HD inline Corners corners_in(const WideTree& tree, std::uint32_t slot) {
  return corners_in(tree, tree.block(slot / kWideWidth), static_cast<int>(slot % kWideWidth));
}

/// The part of a distance query that orders and prunes boxes.
struct WideBall {
  const WideTree& tree;
  const float* p;
  float error;
  std::uint32_t last = 0;  ///< see traverse()

  IST_HD WideBall(const WideTree& of, const float point[3], float rounding, float radius2)
      : tree(of), p(point), error(rounding) {
    shrink(radius2);
  }

  IST_HD void shrink(float radius2) {
    constexpr std::uint32_t kInfiniteBits = 0x7F800000u;
    const std::uint32_t bits = bits_of(prune_distance2(radius2, error));
    last = bits < kInfiniteBits ? bits + 1 : kInfiniteBits;
  }
  IST_HD std::uint32_t limit() const { return last; }
  IST_HD std::uint32_t key(std::uint32_t node, int child) const {
    const std::uint32_t oriented_from = tree.last_level();
    return bits_of(node < oriented_from
                       ? box_distance2(tree.node(node), child)
                       : oriented_distance2<float>(tree.oriented_node(node), child, p, error));
  }

  IST_HD float box_distance2(const WideNode& node, int child) const {
    float sum = 0;
    for (int k = 0; k < 3; ++k) {
      const float below = node.lower[k][child] - p[k];
      const float above = p[k] - node.upper[k][child];
      const float outside = below > above ? below : above;
      const float gap = outside > 0 ? outside : 0;
      sum += gap * gap;
    }
    return sum;
  }
};

/// `kLoosely`: also visits every triangle that is no further than the closest one plus two errors,
/// and records whether a lane found more than one.
template <class Team, bool kLoosely = false>
struct WideNearestQuery : WideBall {
  const Team& team;
  float radius2;
  WideNearest best;         ///< of this lane
  float runner_up = 1e30f;  ///< squared distance of this lane's second closest, if any

  IST_HD WideNearestQuery(const Team& members, const WideTree& of, const float point[3],
                          float rounding, float limit2)
      : WideBall(of, point, rounding, limit2), team(members), radius2(limit2) {
    best.distance2 = limit2;
  }

  IST_HD void visit(std::uint32_t index) {
    const WideBlock& block = tree.block(index);
    for (int lane = team.lane(); lane < kWideWidth; lane += Team::kWidth) {
      const std::uint32_t triangle = block.triangle[lane];
      const float distance2 = closest_in_frame(frame_in(block, lane), p).distance2;
      if (triangle == kNoTriangle) continue;
      if (distance2 < best.distance2 || (distance2 == best.distance2 && triangle < best.triangle)) {
        if (best.triangle != kNoTriangle) runner_up = best.distance2;
        best = {distance2, triangle, index * kWideWidth + static_cast<std::uint32_t>(lane)};
      } else if (distance2 < runner_up) {
        runner_up = distance2;
      }
    }
    const float least = team.min(best.distance2);
    if (least < radius2) {
      radius2 = least;
      shrink(reach2());
    }
  }

  /// Squared float distance up to which every triangle is visited.
  IST_HD float reach2() const {
    return kLoosely ? prune_distance2(prune_distance2(radius2, error), error) : radius2;
  }

  IST_HD WideNearest result() const {
    const float least = team.min(best.distance2);
    const std::uint32_t triangle = team.min(best.distance2 == least ? best.triangle : kNoTriangle);
    return {least, triangle, team.min(best.triangle == triangle ? best.slot : kNoSlot)};
  }
};

/// The closest triangle of the mesh, like nearest_triangle(). `limit2`: squared distance beyond
/// which triangles are ignored; if none is that close, distance2 = limit2 and triangle =
/// kNoTriangle.
template <class Team>
IST_HD WideNearest nearest(const Team& team, const WideTree& tree, const float p[3],
                           float limit2 = 1e30f) {
  WideNearestQuery<Team> query(team, tree, p, distance_error_at(p), limit2);
  traverse(team, tree, query);
  return query.result();
}

template <class Team>
struct WideWithinQuery : WideBall {
  const Team& team;
  float radius2;
  std::uint32_t* slots;
  int capacity;
  int count = 0;

  IST_HD WideWithinQuery(const Team& members, const WideTree& of, const float point[3],
                         float within2, std::uint32_t* out, int most)
      : WideBall(of, point, distance_error_at(point), within2),
        team(members),
        radius2(within2),
        slots(out),
        capacity(most) {}

  IST_HD void visit(std::uint32_t index) {
    const WideBlock& block = tree.block(index);
    for (int lane = team.lane(); lane < kWideWidth; lane += Team::kWidth) {
      const float distance2 = closest_in_frame(frame_in(block, lane), p).distance2;
      const bool near = block.triangle[lane] != kNoTriangle && distance2 <= radius2;
      int found = 0;
      const int place = count + team.exclusive_count(near, found);
      if (near && place < capacity)
        slots[place] = index * kWideWidth + static_cast<std::uint32_t>(lane);
      count += found;
    }
    if (count > capacity) last = 0;
  }
};

/// Writes the slots of all triangles whose float distance² from p is at most radius2, in any order,
/// and returns their number. If that exceeds `capacity`, the output is meaningless. Ends with a
/// sync of the team.
template <class Team>
IST_HD int triangles_within(const Team& team, const WideTree& tree, const float p[3], float radius2,
                            std::uint32_t* slots, int capacity) {
  WideWithinQuery<Team> query(team, tree, p, radius2, slots, capacity);
  traverse(team, tree, query);
  team.sync();
  return query.count;
}

template <class Team>
struct WideExactQuery : WideBall {
  const Team& team;
  const double* exact;
  const ExactReach& reach;
  float radius2 = 0;
  double best2;  ///< of this lane, like the two below
  std::uint32_t triangle = kNoTriangle, slot = kNoSlot;

  IST_HD WideExactQuery(const Team& members, const WideTree& of, const double point[3],
                        const ExactReach& rounded, double limit2)
      : WideBall(of, rounded.p, rounded.error, 0),
        team(members),
        exact(point),
        reach(rounded),
        best2(limit2) {
    narrow(limit2);
  }

  IST_HD void narrow(double distance2) {
    radius2 = reach.reach2(distance2);
    shrink(radius2);
  }

  /// Includes a triangle's exact distance.
  IST_HD void look_at(std::uint32_t at) {
    const WideBlock& block = tree.block(at / kWideWidth);
    const int lane = static_cast<int>(at % kWideWidth);
    double point[3];
    const double distance2 = exact_closest_in(corners_in(tree, block, lane), exact, point);
    const std::uint32_t candidate = block.triangle[lane];
    if (distance2 < best2 ||
        (distance2 == best2 && candidate < triangle && triangle != kNoTriangle)) {
      best2 = distance2;
      triangle = candidate;
      slot = at;
    }
  }

  IST_HD void visit(std::uint32_t index) {
    const WideBlock& block = tree.block(index);
    bool looked = false;
    for (int lane = team.lane(); lane < kWideWidth; lane += Team::kWidth) {
      if (block.triangle[lane] == kNoTriangle ||
          !(closest_in_frame(frame_in(block, lane), p).distance2 <= radius2))
        continue;
      look_at(index * kWideWidth + static_cast<std::uint32_t>(lane));
      looked = true;
    }
    if (team.any(looked)) narrow(team.min(best2));
  }

  IST_HD WideExact result(double limit) const {
    const double least = team.min(best2);
    const std::uint32_t nearest = team.min(best2 == least ? triangle : kNoTriangle);
    if (nearest == kNoTriangle) return {limit, kNoTriangle, kNoSlot};
    return {std::sqrt(least), nearest, team.min(triangle == nearest ? slot : kNoSlot)};
  }
};

/// Closest triangle by the double formula over every triangle, like exact_closest_point(): if
/// nothing is closer than `limit`, distance = limit and triangle = kNoTriangle.
template <class Team>
IST_HD WideExact exact_nearest(const Team& team, const WideTree& tree, const double p[3],
                               double limit) {
  const ExactReach reach(p);
  WideExactQuery<Team> query(team, tree, p, reach, limit * limit);
  // The float answer first: its traversal visits the few triangles that may be closer in double.
  WideNearestQuery<Team, true> coarse(team, tree, reach.p, reach.error, query.radius2);
  traverse(team, tree, coarse);
  const float candidate2 = coarse.reach2();
  if (coarse.best.triangle != kNoTriangle && coarse.best.distance2 <= candidate2)
    query.look_at(coarse.best.slot);
  if (team.any(coarse.runner_up <= candidate2)) {
    query.narrow(team.min(query.best2));
    traverse(team, tree, query);
  }
  return query.result(limit);
}

/// The part of a ray query that selects boxes, in any order.
struct WideRay {
  const WideTree& tree;
  RayBox box;

  IST_HD std::uint32_t limit() const { return 0xFFFFFFE0u; }
  IST_HD std::uint32_t key(std::uint32_t node, int child) const {
    const WideNode& boxes = tree.node(node);
    bool hit = true;
    for (int k = 0; k < 3; ++k)
      hit = hit & (boxes.lower[k][child] <= box.upper[k]) & (boxes.upper[k][child] >= box.lower[k]);
    return hit ? 0 : limit();
  }
};

template <class Team>
struct WideWindingQuery : WideRay {
  const Team& team;
  const double* p;
  int winding = 0;  ///< of this lane's triangles

  IST_HD WideWindingQuery(const Team& members, const WideTree& of, const double point[3])
      : WideRay{of, RayBox::ray(point)}, team(members), p(point) {}

  IST_HD void visit(std::uint32_t index) {
    const WideBlock& block = tree.block(index);
    for (int lane = team.lane(); lane < kWideWidth; lane += Team::kWidth)
      if (block.triangle[lane] != kNoTriangle)
        winding += ray_winding(corners_in(tree, block, lane), p);
  }
};

/// Winding number of p (unit frame) about a closed mesh.
template <class Team>
IST_HD int winding_number(const Team& team, const WideTree& tree, const double p[3]) {
  WideWindingQuery<Team> query(team, tree, p);
  traverse(team, tree, query);
  return team.sum(query.winding);
}

template <class Team>
IST_HD bool inside(const Team& team, const WideTree& tree, const double p[3]) {
  return winding_number(team, tree, p) >= 1;
}

template <class Team>
struct WideLineQuery : WideRay {
  const Team& team;
  double yz[2];
  double* x;
  int* sign;
  int capacity;
  int count = 0;

  IST_HD WideLineQuery(const Team& members, const WideTree& of, double y, double z, double* out_x,
                       int* out_sign, int most)
      : WideRay{of, RayBox::line(y, z)},
        team(members),
        yz{y, z},
        x(out_x),
        sign(out_sign),
        capacity(most) {}

  IST_HD void visit(std::uint32_t index) {
    const WideBlock& block = tree.block(index);
    for (int lane = team.lane(); lane < kWideWidth; lane += Team::kWidth) {
      int facing = 0;
      if (block.triangle[lane] != kNoTriangle) facing = pierced(corners_in(tree, block, lane), yz);
      int found = 0;
      const int place = count + team.exclusive_count(facing != 0, found);
      if (facing != 0 && place < capacity) {
        x[place] = crossing_x(corners_in(tree, block, lane), yz);
        sign[place] = -facing;
      }
      count += found;
    }
  }
};

/// Writes the position and sign (+1: the winding number rises towards +x) of all crossings of the
/// line (·, y, z), in any order, and returns their number. Those beyond `capacity` are not written.
/// Ends with a sync of the team.
template <class Team>
IST_HD int line_crossings(const Team& team, const WideTree& tree, double y, double z, double* x,
                          int* sign, int capacity) {
  WideLineQuery<Team> query(team, tree, y, z, x, sign, capacity);
  traverse(team, tree, query);
  team.sync();
  return query.count;
}

}  // namespace ist
