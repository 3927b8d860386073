#pragma once

#include <cstdint>

#include "base/host_device.h"
#include "base/team.h"
#include "cuda/query/field_batch.h"

// The steps of a batch's pairs of a tree and a field; batch_steps.h has those of trees. Fields with
// triangles are in triangle_steps.h.

namespace ist::gpu {

/// The group of pair i; −1 if it is answered or not a pair of a tree and a field. One thread per
/// pair.
IST_HD inline int sift_field_pair(const FieldBatch& batch, std::uint32_t i) {
  if (kind_of(batch, i) != PairKind::tree_and_field) return -1;
  const FieldSides sides(batch, i);
  const FieldRef& field = solid_of(batch, sides.field, i).field;
  const SolidRef& asset = solid_of(batch, sides.tree, i);
  if (!asset.has_spheres()) {
    write_nothing(batch.answers, i, QueryStatus::missing_data);
    return -1;
  }
  PairPlace place;
  if (field.kind == FieldKind::unusable || !place_pair(batch, sides.field, sides.tree, i, place)) {
    write_nothing(batch.answers, i, QueryStatus::invalid_input);
    return -1;
  }
  const TreeRef& tree = asset.tree[static_cast<int>(batch.measure)];
  const double centre[3] = {tree.root[0], tree.root[1], tree.root[2]};
  double x[3];
  place.a_from_b.apply_fused(centre, x);
  const double r = tree.root[3] * place.a_from_b.scale;
  bool sound = true;
  const double d = distance_in(field, x, sound), reach = sure_reach(r, distance_error(field));
  if (sound && d > -reach && d < reach) return group_of(field.kind);
  if (!sound || d >= reach) {
    write_nothing(batch.answers, i, sound ? QueryStatus::ok : QueryStatus::invalid_input);
    return -1;
  }
  const SumsRef& sums = asset.sums[static_cast<int>(batch.measure)];
  PartSums whole;
  whole.add_whole(sums.level[tree.top][0], sums.sphere_count, place.a_from_b);
  write_field_answer(batch, i, place, whole.total(SerialTeam()));
  return -1;
}

/// Sums pair i of a smooth field.
template <class Team>
IST_HD void sum_field_pair(const Team& team, const FieldBatch& batch, std::uint32_t i,
                           WalkMemory& memory) {
  if (team.lane() == 0) place_field_pair(batch, i, memory.place);
  load_solids(team, batch, i, memory);
  PartSums sums;
  FieldWalk<Team> walk(team, memory, sums);
  const bool sound =
      walk.run([&](const std::uint32_t* blocks, int have) { walk.add_spheres(blocks, have); });
  const LensTotals totals = sums.total(team);
  if (team.lane() == 0) {
    if (sound)
      write_field_answer(batch, i, memory.place, totals);
    else
      write_nothing(batch.answers, i, QueryStatus::invalid_input);
  }
  team.sync();
}

}  // namespace ist::gpu
