#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "cuda/query/batch_steps.h"
#include "cuda/query/field_walk.h"
#include "cuda/query/lens_sums.h"
#include "cuda/query/solid_ref.h"

// A batch's pairs of a tree and a field; batch_arrays.h has those of trees. Sums are in double.
// Whichever is A, the field comes first here: the tree is placed in the field's frame.

namespace ist::gpu {

/// The counters of a round of pairs with triangles (triangle_steps.h).
struct TriangleRound {
  std::uint32_t first;   ///< its first listed pair
  std::uint32_t walked;  ///< from there on, or more than there are
  std::uint32_t parts, words;
  std::uint32_t summed;  ///< parts
};

/// The counters of a batch with fields, initially zero.
struct FieldCounters {
  std::uint32_t listed[kFieldGroups];  ///< by FieldGroup
  std::uint32_t taken[kFieldGroups];   ///< of smooth fields, and of pairs outside rounds
  std::uint32_t large;                 ///< pairs that did not fit in their round
  TriangleRound round[2];              ///< the current one, and the one before
};

constexpr std::uint32_t kNoPart = ~0u;

struct TriangleQuery {
  PairPlace place;
  LensTotals walked;  ///< sums of balls that no triangle intersects
  std::uint32_t pair;
  std::uint32_t first_part;  ///< kNoPart: none
  bool fits;                 ///< its parts fit
};

/// Balls of a pair that triangles intersect, as left by a traversal: a MetView in words.
struct MetPart {
  std::uint32_t query;  ///< in the round
  std::uint32_t next;   ///< the next part of the same pair, or kNoPart
  std::uint32_t first_word;
  std::uint32_t balls, pairs;
  LensTotals totals;
};

struct TriangleWorkspace {
  TriangleQuery* queries;
  MetPart* parts;
  std::uint32_t* words;
  std::uint32_t query_capacity, part_capacity, word_capacity;
};

/// A batch's pairs of a tree and a field, and their working memory.
struct FieldBatch : SolidPairs {
  FieldCounters* counters;
  std::uint32_t* list[2];  ///< each holds all pairs
  TriangleWorkspace work;
};

/// The place of a group's k-th pair in the list. No pair is in two groups.
IST_HD inline std::uint32_t& listed_pair(const FieldBatch& batch, int group, std::uint32_t k) {
  return batch.list[group == kSmooth ? 0 : 1][k];
}

struct FieldSides {
  GpuPlacedSolids field, tree;
  bool turned;  ///< the field is B

  IST_HD FieldSides(const SolidPairs& batch, std::uint32_t i)
      : turned(solid_of(batch, batch.pairs.b, i).is_field()) {
    const GpuPlacedSolids &a = batch.pairs.a, &b = batch.pairs.b;
    field = {turned ? b.solid : a.solid, turned ? b.pose : a.pose, turned ? b.scale : a.scale};
    tree = {turned ? a.solid : b.solid, turned ? a.pose : b.pose, turned ? a.scale : b.scale};
  }
};

IST_HD inline bool place_field_pair(const FieldBatch& batch, std::uint32_t i, PairPlace& place) {
  const FieldSides sides(batch, i);
  return place_pair(batch, sides.field, sides.tree, i, place);
}

IST_HD inline void write_field_answer(const FieldBatch& batch, std::uint32_t i,
                                      const PairPlace& place, const LensTotals& totals) {
  WorldSums sums = world_sums(place, totals);
  const FieldSides sides(batch, i);
  if (sides.turned) {
    const Pose tree = pose_of(sides.tree, i), field = pose_of(sides.field, i);
    sums.rotation_gradient = turned_over(vec3(tree.t) - vec3(field.t), sums.translation_gradient,
                                         sums.rotation_gradient);
    sums.translation_gradient = -sums.translation_gradient;
  }
  write_answer(batch.answers, i, sums, totals);
}

/// Loads pair i into memory. Its place is set, or will be after the team's next sync.
template <class Team>
IST_HD void load_solids(const Team& team, const FieldBatch& batch, std::uint32_t i,
                        ProbeMemory& memory) {
  const FieldSides sides(batch, i);
  const SolidRef& asset = solid_of(batch, sides.tree, i);
  copy_words(team, asset.tree[static_cast<int>(batch.measure)], memory.tree);
  copy_words(team, asset.sums[static_cast<int>(batch.measure)], memory.sums);
  copy_words(team, solid_of(batch, sides.field, i).field, memory.field);
  team.sync();
  if (team.lane() == 0) {
    const double centre[3] = {memory.tree.root[0], memory.tree.root[1], memory.tree.root[2]};
    double x[3];
    memory.place.a_from_b.apply_fused(centre, x);
    for (int k = 0; k < 3; ++k) memory.whole[k] = x[k];
    memory.whole[3] = memory.tree.root[3] * memory.place.a_from_b.scale;
  }
  team.sync();
}

}  // namespace ist::gpu
