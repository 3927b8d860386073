#pragma once

#include <cstdint>

#include "cuda/query/batch_steps.h"
#include "cuda/query/facet_fields.h"
#include "cuda/query/surface_walk.h"
#include "numerics/host_device.h"
#include "numerics/team.h"

// A batch of fields and trees, step by step, as batch_steps.h has it of trees. What is summed is
// in double.

namespace ist::gpu {

/// Counters of a batch with fields, by FieldGroup: zero at first.
struct FieldCounters {
  std::uint32_t listed[kFieldGroups];
  std::uint32_t taken[kFieldGroups];
};

/// A batch of fields and trees in the memory of who works on it.
struct FieldBatch {
  const FieldRef* fields;
  std::uint32_t field_count;
  const AssetRef* assets;
  std::uint32_t asset_count;
  Measure measure;
  GpuPairs pairs;  ///< asset_a: places of fields
  GpuPenetrations answers;

  FieldCounters* counters;
  std::uint32_t* list[2];  ///< room for all pairs each
};

/// Where the k-th pair of a group is listed: no pair is in two.
IST_HD inline std::uint32_t& listed_pair(const FieldBatch& batch, int group, std::uint32_t k) {
  if (group == kSmooth) return batch.list[0][k];
  return batch.list[1][group == kMesh ? k : batch.pairs.count - 1 - k];
}

IST_HD inline bool place_field_pair(const FieldBatch& batch, std::uint32_t i, PairPlace& place) {
  const GpuPairs& pairs = batch.pairs;
  const std::uint32_t a = pairs.asset_a[i], b = pairs.asset_b[i];
  if (a >= batch.field_count || b >= batch.asset_count) return false;
  const FieldRef& field = batch.fields[a];
  return field.kind != FieldKind::unusable &&
         place.place(field.frame, pose_of(pairs.pose_a, i), scale_of(pairs.scale_a, i),
                     batch.assets[b].frame, pose_of(pairs.pose_b, i), scale_of(pairs.scale_b, i));
}

/// How far outside a point is of the grid around a surface: the distance, squared.
IST_HD inline double outside_grid2(const SurfaceRef& s, const double (&x)[3]) {
  double square = 0;
  for (int k = 0; k < 3; ++k) {
    const double high = s.low[k] + s.cell * (kBrickWidth * s.bricks[k]);
    const double beyond = most(most(s.low[k] - x[k], x[k] - high), 0);
    square += beyond * beyond;
  }
  return square;
}

/// Which group pair i is of; −1: it is answered. One thread a pair.
IST_HD inline int sift_field_pair(const FieldBatch& batch, std::uint32_t i) {
  PairPlace place;
  if (!place_field_pair(batch, i, place)) {
    write_nothing(batch.answers, i, QueryStatus::invalid_input);
    return -1;
  }
  const FieldRef& field = batch.fields[batch.pairs.asset_a[i]];
  const AssetRef& asset = batch.assets[batch.pairs.asset_b[i]];
  const TreeRef& tree = asset.tree[static_cast<int>(batch.measure)];
  const double centre[3] = {tree.root[0], tree.root[1], tree.root[2]};
  double x[3];
  place.a_from_b.apply(centre, x);
  const double r = tree.root[3] * place.a_from_b.scale;
  if (field.kind == FieldKind::mesh) {
    const double reach = r * (1 + 1e-6);
    if (outside_grid2(field.mesh, x) < reach * reach) return kMesh;
    write_nothing(batch.answers, i, QueryStatus::ok);
    return -1;
  }
  bool sound = true;
  const double d = distance_in(field, x, sound), reach = sure_reach(field, r);
  if (sound && d > -reach && d < reach) return group_of(field.kind);
  if (!sound || d <= -reach) {
    write_nothing(batch.answers, i, sound ? QueryStatus::ok : QueryStatus::invalid_input);
    return -1;
  }
  const SumsRef& sums = asset.sums[static_cast<int>(batch.measure)];
  PartSums whole;
  whole.add_whole(sums.level[tree.top][0], sums.sphere_count, place.a_from_b);
  write_answer(batch.answers, i, place, whole.total(SerialTeam()));
  return -1;
}

/// Readies the memory for pair i.
template <class Team>
IST_HD void load_probe(const Team& team, const FieldBatch& batch, std::uint32_t i,
                       ProbeMemory& memory) {
  if (team.lane() == 0) place_field_pair(batch, i, memory.place);
  const AssetRef& asset = batch.assets[batch.pairs.asset_b[i]];
  copy_words(team, asset.tree[static_cast<int>(batch.measure)], memory.tree);
  copy_words(team, asset.sums[static_cast<int>(batch.measure)], memory.sums);
  copy_words(team, batch.fields[batch.pairs.asset_a[i]], memory.field);
  team.sync();
}

template <class Team>
IST_HD void finish_probe(const Team& team, const FieldBatch& batch, std::uint32_t i,
                         const PairPlace& place, const PartSums& sums, bool sound) {
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) {
    if (sound)
      write_answer(batch.answers, i, place, totals);
    else
      write_nothing(batch.answers, i, QueryStatus::invalid_input);
  }
  team.sync();
}

template <class Team>
IST_HD void sum_field_pair(const Team& team, const FieldBatch& batch, std::uint32_t i,
                           WalkMemory& memory) {
  load_probe(team, batch, i, memory);
  PartSums sums;
  FieldWalk<Team> walk(team, memory, sums);
  const bool sound =
      walk.run([&](const std::uint32_t* blocks, int have) { walk.add_spheres(blocks, have); });
  finish_probe(team, batch, i, memory.place, sums, sound);
}

template <class Team>
IST_HD void sum_field_pair(const Team& team, const FieldBatch& batch, std::uint32_t i,
                           FacetMemory& memory) {
  load_probe(team, batch, i, memory);
  PartSums sums;
  FieldWalk<Team> walk(team, memory, sums);
  FacetSums<Team> facets(team, memory, sums);
  walk.run([&](const std::uint32_t* blocks, int have) { facets.add(blocks, have); });
  finish_probe(team, batch, i, memory.place, sums, true);
}

template <class Team>
IST_HD void sum_field_pair(const Team& team, const FieldBatch& batch, std::uint32_t i,
                           SurfaceMemory& memory) {
  load_probe(team, batch, i, memory);
  PartSums sums;
  SurfaceWalk<Team>(team, memory, sums).run();
  finish_probe(team, batch, i, memory.place, sums, true);
}

}  // namespace ist::gpu
