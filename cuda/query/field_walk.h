#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/pair_descent.h"
#include "cuda/query/solid_ref.h"

// The traversal of a tree against a field that bounds the distance to its surface: ShapeDescent
// (query/shape_queries.cpp), depth first, by one team, two blocks at a time.

namespace ist::gpu {

// Dispatches to the kinds of fields (query/shape/plain_shapes.h).

/// A lower bound of the distance to the surface, negative inside.
IST_HD inline double distance_in(const FieldRef& field, const double (&x)[3], bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return field.half_space.sample(x).distance;
    case FieldKind::ball:
      return field.ball.sample(x).distance;
    case FieldKind::capsule:
      return field.capsule.sample(x).distance;
    case FieldKind::cylinder:
      return field.cylinder.sample(x).distance;
    case FieldKind::grid:
      return field.grid.sample(x, sound).distance;
    case FieldKind::box:
      return field.box.sample(x).distance;
    case FieldKind::height:
      return field.height.sample(x).distance;
    default:
      return 0;
  }
}

IST_HD inline double distance_error(const FieldRef& field) {
  return field.kind == FieldKind::grid ? field.grid.error : 0;
}

/// The part of a ball inside a smooth field (kSmooth).
IST_HD inline BallPart part_in(const FieldRef& field, const double (&x)[3], double r, bool& sound) {
  switch (field.kind) {
    case FieldKind::half_space:
      return flat_part(field.half_space.sample(x), r);
    case FieldKind::ball:
      return field.ball.part(x, r);
    case FieldKind::capsule:
      return flat_part(field.capsule.sample(x), r);
    case FieldKind::cylinder:
      return field.cylinder.part(x, r);
    case FieldKind::grid:
      return flat_part(field.grid.sample(x, sound), r);
    default:
      return {};
  }
}

struct ProbeMemory {
  PairPlace place;
  double whole[4];  ///< ball around the tree, the field's frame
  TreeRef tree;
  SumsRef sums;
  FieldRef field;
};

/// Places a ball of a block in the field's frame; false if the lane has none.
IST_HD inline bool place_ball(const ProbeMemory& m, int level, std::uint32_t block, int lane,
                              double (&x)[3], double& r) {
  const NodeBall ball =
      lane_ball(in_global_memory(m.tree.blocks[level])[block],
                in_global_memory(m.tree.origins[level])[block], static_cast<std::uint32_t>(lane));
  m.place.a_from_b.apply_fused(ball.centre, x);
  r = ball.r * m.place.a_from_b.scale;
  return r > 0;
}

struct WalkMemory : ProbeMemory {
  std::uint32_t stack[kMaxLevels * (kItems - kPairsAtOnce) + kPairsAtOnce];  ///< nodes to open
  std::uint32_t leaves[kPairsAtOnce + kItems];
};

template <class Team>
class FieldWalk {
 public:
  IST_HD FieldWalk(const Team& team, WalkMemory& memory, PartSums& sums)
      : team_(team), m_(memory), sums_(sums) {}

  /// False if the field contains NaN. leaf(blocks, have) sums one or two leaf blocks, and none at
  /// the end.
  template <class Leaf>
  IST_HD bool run(const Leaf& leaf) {
    int size = 0, leaves = 0;
    if (team_.lane() == 0) (m_.tree.top == 0 ? m_.leaves : m_.stack)[0] = node(m_.tree.top, 0);
    (m_.tree.top == 0 ? leaves : size) = 1;
    team_.sync();
    for (int have = 1; have > 0;) {
      if (size > 0 && leaves < kPairsAtOnce) {
        open(size, leaves);
      } else {
        have = leaves < kPairsAtOnce ? leaves : kPairsAtOnce;
        leaves -= have;
        sums_.visits += static_cast<std::uint32_t>(have);
        leaf(m_.leaves + leaves, have);
        team_.sync();
      }
    }
    return !team_.any(!sound_);
  }

  /// Sums the spheres of leaf blocks one by one, for smooth fields.
  IST_HD void add_spheres(const std::uint32_t* blocks, int have) {
    for (int i = 0; i < kItems / Team::kWidth; ++i) {
      const int item = i * Team::kWidth + team_.lane();
      const int half = item / static_cast<int>(kWidth);
      double x[3], r;
      if (half >= have || !place_ball(m_, 0, blocks[half], item % static_cast<int>(kWidth), x, r))
        continue;
      const BallPart part = part_in(m_.field, x, r, sound_);
      if (!(part.volume > 0)) continue;
      const double* const t = m_.place.a_from_b.t;
      const double at[3] = {x[0] - t[0], x[1] - t[1], x[2] - t[2]};
      sums_.add(at, part.volume, part.gradient, part.moment);
      ++sums_.spheres;
    }
  }

 private:
  IST_HD static std::uint32_t node(int level, std::uint32_t block) {
    return static_cast<std::uint32_t>(level) << kNodeBits | block;
  }

  IST_HD void open(int& size, int& leaves) {
    const int have = size < kPairsAtOnce ? size : kPairsAtOnce;
    constexpr int kItemsALane = kItems / Team::kWidth;
    std::uint32_t entry[kItemsALane];
    for (int i = 0; i < kItemsALane; ++i) {
      const int half = (i * Team::kWidth + team_.lane()) / static_cast<int>(kWidth);
      entry[i] = half < have ? m_.stack[size - 1 - half] : 0;
    }
    team_.sync();
    size -= have;
    sums_.visits += static_cast<std::uint32_t>(have);
    for (int i = 0; i < kItemsALane; ++i) {
      const int item = i * Team::kWidth + team_.lane();
      const int half = item / static_cast<int>(kWidth), lane = item % static_cast<int>(kWidth);
      const int level = static_cast<int>(entry[i] >> kNodeBits);
      const std::uint32_t block = entry[i] & ((1u << kNodeBits) - 1);
      const std::uint32_t child = block * kWidth + static_cast<std::uint32_t>(lane);
      bool waits = false;
      double x[3], r;
      if (half < have && place_ball(m_, level, block, lane, x, r)) {
        const double d = distance_in(m_.field, x, sound_),
                     reach = sure_reach(r, distance_error(m_.field));
        waits = d > -reach && d < reach;
        if (d <= -reach)
          sums_.add_whole(m_.sums.level[level - 1][child], m_.sums.spheres_below(level - 1, child),
                          m_.place.a_from_b);
      }
      const bool leaf = waits && level == 1;
      int total = 0;
      int place = leaves + team_.exclusive_count(leaf, total);
      leaves += total;
      if (leaf) m_.leaves[place] = child;
      place = size + team_.exclusive_count(waits && !leaf, total);
      size += total;
      if (waits && !leaf) m_.stack[place] = node(level - 1, child);
    }
    team_.sync();
  }

  const Team& team_;
  WalkMemory& m_;
  PartSums& sums_;
  bool sound_ = true;
};

}  // namespace ist::gpu
