#pragma once

#include "mesh/geometry/ray_crossing.h"
#include "mesh/hierarchy/wide_nearest.h"
#include "mesh/hierarchy/wide_traversal.h"

// Winding numbers and line crossings of a WideTree, by a team (base/team.h); the answers are
// those of winding.h. All lanes ask the same and get the same.

namespace ist {

/// The part of a ray query that picks boxes, in no particular order.
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
                       int* out_sign, int room)
      : WideRay{of, RayBox::line(y, z)},
        team(members),
        yz{y, z},
        x(out_x),
        sign(out_sign),
        capacity(room) {}

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

/// All crossings of the line (·, y, z), in no particular order: writes where and with which sign
/// (+1: the winding number rises towards +x), and returns how many there are. Beyond `capacity`
/// none is written. Ends with a sync of the team.
template <class Team>
IST_HD int line_crossings(const Team& team, const WideTree& tree, double y, double z, double* x,
                          int* sign, int capacity) {
  WideLineQuery<Team> query(team, tree, y, z, x, sign, capacity);
  traverse(team, tree, query);
  team.sync();
  return query.count;
}

}  // namespace ist
