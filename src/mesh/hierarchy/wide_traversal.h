#pragma once

#include "mesh/hierarchy/wide_tree.h"

namespace ist {

/// Which of a node's children are still to be visited: a key for each, spread over the team's
/// lanes, with the child's number in its low five bits.
template <class Team>
struct WideKeys {
  static constexpr int kEach = kWideWidth / Team::kWidth;
  static constexpr std::uint32_t kVisited = 0xFFFFFFFFu;
  static constexpr std::uint32_t kChild = kWideWidth - 1;  ///< the bits of a child's number
  std::uint32_t key[kEach];

  IST_HD void set(const Team& team, int i, std::uint32_t urgency) {
    key[i] = (urgency & ~kChild) | static_cast<std::uint32_t>(team.lane() + i * Team::kWidth);
  }

  /// The least key, now visited; kVisited if none is below the limit.
  IST_HD std::uint32_t take_first(const Team& team, std::uint32_t limit) {
    std::uint32_t first = kVisited;
    for (int i = 0; i < kEach; ++i) first = key[i] < first ? key[i] : first;
    first = team.min(first);
    if ((first & ~kChild) >= limit) return kVisited;
    for (int i = 0; i < kEach; ++i)
      if (key[i] == first) key[i] = kVisited;
    return first;
  }
};

/// Walks down the tree, all lanes of the team together, nearest children first. The query says
///   key(node, child)  the child's place in line; its low five bits are ignored
///   limit()           keys that are not below it are left out; the same in all lanes
///   visit(block)      called with the index of a block of triangles; may lower the limit, 0 ends
/// The path down is kept in registers: a visit costs one dependent load a level. (Blocks in pairs,
/// so that their loads overlap, make one query alone 15 % faster and many at once 20 % slower.)
template <class Team, class Query>
IST_HD void traverse(const Team& team, const WideTree& tree, Query&& query) {
  using Keys = WideKeys<Team>;
  if (tree.block_count == 0) return;
  Keys here{}, above[kWideDepth - 1] = {};
  std::uint32_t node = 0;
  for (int i = 0; i < Keys::kEach; ++i)
    here.set(team, i, query.key(0, team.lane() + i * Team::kWidth));
  for (;;) {
    const std::uint32_t first = here.take_first(team, query.limit());
    if (first == Keys::kVisited) {  // nothing left here
      if (node == 0) return;
      node = (node - 1) / kWideWidth;
      here = above[0];
      for (int d = 0; d + 2 < kWideDepth; ++d) above[d] = above[d + 1];
      continue;
    }
    const std::uint32_t children = kWideWidth * node + 1;
    if (children >= tree.first_leaf) {
      query.visit(children + (first & Keys::kChild) - tree.first_leaf);
      continue;
    }
    for (int d = kWideDepth - 2; d > 0; --d) above[d] = above[d - 1];
    above[0] = here;
    node = children + (first & Keys::kChild);
    for (int i = 0; i < Keys::kEach; ++i)
      here.set(team, i, query.key(node, team.lane() + i * Team::kWidth));
  }
}

}  // namespace ist
