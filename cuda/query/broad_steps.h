#pragma once

#include <cstdint>

#include "base/bits.h"
#include "cuda/base/atomics.h"
#include "cuda/query/broad_arrays.h"

// The steps of a scene's broad phase, for warps and for teams of 32 on the host: place bodies, sort
// them along a curve, fit nodes around them from the lowest up, find pairs, sort and write them.

namespace ist::gpu {

/// Moves bit k of x to bit 3 k, for 21 bits.
IST_HD inline std::uint64_t spread_by_three(std::uint64_t x) {
  x = (x | x << 32) & 0x001F00000000FFFFull;
  x = (x | x << 16) & 0x001F0000FF0000FFull;
  x = (x | x << 8) & 0x100F00F00F00F00Full;
  x = (x | x << 4) & 0x10C30C30C30C30C3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

/// Computes the box of body i and its position on the curve.
IST_HD inline void place_body(const BroadArrays& scene, std::uint32_t i) {
  const BroadBody& body = scene.bodies[i];
  const Pose& pose = scene.poses[i];
  const Rotation rotation = Rotation::of(pose.q);
  BroadBox box = BroadBox::none();
  std::uint64_t key = ~std::uint64_t{0};
  bool stands = usable(rotation, pose.t, body.scale) && !body.box.empty;
  if (stands) {
    const std::uint64_t last = (std::uint64_t{1} << 3 * scene.axis_bits) - 1;
    std::uint64_t place = last;
    if (body.box.endless) {
      for (int k = 0; k < 3; ++k) box.low[k] = -HUGE_VALF, box.high[k] = HUGE_VALF;
    } else {
      const WorldBox at = body.box.placed(rotation, pose.t, body.wider);
      stands = at.fits();
      if (stands) at.write(box.low, box.high);
      place = 0;
      const double cells = static_cast<double>(std::uint64_t{1} << scene.axis_bits);
      for (int k = 0; k < 3; ++k) {
        const double x = scene.cells * (at.low[k] + at.high[k]) / 2 + cells / 2;
        const double cell = x > 0 ? (x < cells - 1 ? x : cells - 1) : 0;
        place |= spread_by_three(static_cast<std::uint64_t>(cell)) << k;
      }
    }
    if (stands) {
      box.first_world = box.last_world = body.world;
      key = std::uint64_t{body.world} << 3 * scene.axis_bits | place;
    }
  }
  scene.placed[i] = box;
  scene.keys[i] = key;
  scene.status[i] = stands ? QueryStatus::ok : QueryStatus::invalid_input;
}

/// Fits node j of a level around its children.
template <class Team>
IST_HD void fit_node(const Team& team, const BroadArrays& scene, int level, std::uint32_t j) {
  static_assert(Team::kWidth == kFan);
  const std::uint32_t child = kFan * j + static_cast<std::uint32_t>(team.lane());
  BroadBox box = BroadBox::none();
  bool still = false;
  if (child < scene.nodes[level - 1]) {
    if (level == 1) {
      const std::uint32_t body = scene.order[child];
      box = scene.placed[body];
      still = !scene.bodies[body].moves;
    } else {
      box = scene.boxes[level - 1][child];
      still = scene.still[level - 1][child] != 0;
    }
  }
  if (level == 1) scene.boxes[0][child] = box;
  const std::uint32_t stills = team.ballot(still);
  for (int k = 0; k < 3; ++k) {
    box.low[k] = team.min(box.low[k]);
    box.high[k] = team.max(box.high[k]);
  }
  box.first_world = team.min(box.first_world);
  box.last_world = team.max(box.last_world);
  if (team.lane() != 0) return;
  scene.still[level][j] = stills;
  if (level < scene.top) scene.boxes[level][j] = box;
}

/// True if two bodies whose boxes intersect form a pair.
IST_HD inline bool may_meet(const BroadArrays& scene, std::uint32_t i, std::uint32_t j) {
  const BroadBody &a = scene.bodies[i], &b = scene.bodies[j];
  if ((a.layers & b.meets) == 0 || (b.layers & a.meets) == 0 || (a.box.is_shape && b.box.is_shape))
    return false;
  const std::uint64_t key = scene.key(i, j);
  std::uint32_t low = 0, high = scene.excluded_count;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    if (scene.excluded[middle] < key)
      low = middle + 1;
    else
      high = middle;
  }
  return low == scene.excluded_count || scene.excluded[low] != key;
}

/// The pending nodes: for each level all children of one node.
struct BroadMemory {
  struct Node {
    int level;
    std::uint32_t j;
  } waiting[kFan * kMostLevels];
};

template <class Team>
IST_HD BroadBox broadcast(const Team& team, const BroadBox& box, int from) {
  BroadBox out;
  for (int k = 0; k < 3; ++k) {
    out.low[k] = team.broadcast(box.low[k], from);
    out.high[k] = team.broadcast(box.high[k], from);
  }
  out.first_world = team.broadcast(box.first_world, from);
  out.last_world = team.broadcast(box.last_world, from);
  return out;
}

/// Finds the pairs of the moving bodies of node g of level 1: with all bodies that do not move, and
/// with moving ones that follow on the curve.
template <class Team>
IST_HD void find_pairs_of(const Team& team, const BroadArrays& scene, std::uint32_t g,
                          BroadMemory& memory) {
  static_assert(Team::kWidth == kFan);
  const std::uint32_t first = kFan * g, me = first + static_cast<std::uint32_t>(team.lane());
  const std::uint32_t body = me < scene.count ? scene.order[me] : kNoIndex;
  const bool moves = body != kNoIndex && scene.bodies[body].moves;
  const BroadBox mine = moves ? scene.boxes[0][me] : BroadBox::none();
  if (!team.any(mine.last_world >= mine.first_world)) return;
  BroadBox all = mine;
  for (int k = 0; k < 3; ++k) {
    all.low[k] = team.min(mine.low[k]);
    all.high[k] = team.max(mine.high[k]);
  }
  all.first_world = team.min(mine.first_world);
  all.last_world = team.max(mine.last_world);

  int waiting = 1;
  if (team.lane() == 0) memory.waiting[0] = {scene.top, 0};
  while (waiting > 0) {
    team.sync();
    const auto [level, j] = memory.waiting[--waiting];
    team.sync();
    const std::uint32_t child = kFan * j + static_cast<std::uint32_t>(team.lane());
    const std::uint32_t stills = scene.still[level][j];
    const BroadBox box =
        child < scene.nodes[level - 1] ? scene.boxes[level - 1][child] : BroadBox::none();
    // Bodies before these on the curve count only if they do not move.
    const bool is_still = (stills >> team.lane() & 1) != 0;
    const bool behind = (std::uint64_t{child} + 1) << 5 * (level - 1) > first;
    for (const std::uint32_t lane : set_bits(team.ballot((is_still || behind) && all.meets(box)))) {
      const std::uint32_t other = kFan * j + lane;
      bool meets = mine.meets(broadcast(team, box, static_cast<int>(lane)));
      if (level > 1) {
        // (these bodies may be far apart)
        if (!team.any(meets)) continue;
        if (team.lane() == 0) memory.waiting[waiting] = {level - 1, other};
        ++waiting;
        continue;
      }
      meets = meets && ((stills >> lane & 1) != 0 || me < other);
      if (!team.any(meets)) continue;
      const std::uint32_t partner = scene.order[other];
      meets = meets && may_meet(scene, body, partner);
      const std::uint32_t place = append(team, meets, scene.met);
      if (meets && place < scene.max_pairs) scene.found[place] = scene.key(body, partner);
    }
  }
}

/// Writes pair k, or marks it as empty.
IST_HD inline void write_pair(const BroadArrays& scene, std::uint32_t k) {
  const std::uint32_t met = scene.met[0];
  const std::uint32_t count = met <= scene.max_pairs ? met : 0;
  if (k == 0) scene.met[1] = count;
  if (k >= count) {
    scene.a[k] = scene.b[k] = scene.solid_a[k] = scene.solid_b[k] = kNoIndex;
    return;
  }
  const std::uint64_t key = scene.sorted[k];
  const auto a = static_cast<std::uint32_t>(key >> scene.index_bits);
  const auto b = static_cast<std::uint32_t>(key & ((std::uint64_t{1} << scene.index_bits) - 1));
  scene.a[k] = a;
  scene.b[k] = b;
  scene.solid_a[k] = scene.bodies[a].solid;
  scene.solid_b[k] = scene.bodies[b].solid;
  scene.pose_a[k] = scene.poses[a];
  scene.pose_b[k] = scene.poses[b];
  scene.scale_a[k] = scene.bodies[a].scale;
  scene.scale_b[k] = scene.bodies[b].scale;
}

}  // namespace ist::gpu
