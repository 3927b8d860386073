#pragma once

#include <cstring>

#include "mesh/wide_tree.h"

namespace ist {

/// Which of a node's children are still to be visited: a key for each, spread over the team's
/// lanes, with the child's number in its low five bits.
template <class Team>
struct WideKeys {
  static constexpr int kEach = kWideWidth / Team::kWidth;
  static constexpr std::uint32_t kVisited = 0xFFFFFFFFu;
  std::uint32_t key[kEach];
};

/// Walks down the tree, all lanes of the team together, nearest children first. The query says
///   key(node, child)  the child's place in line; its low five bits are ignored
///   limit()           keys that are not below it are left out; the same in all lanes
///   visit(block)      called with the index of a block of triangles; may lower the limit, 0 ends
/// The path down is kept in registers: a visit costs one dependent load a level.
template <class Team, class Query>
IST_HD void traverse(const Team& team, const WideTree& tree, Query&& query) {
  constexpr std::uint32_t kChildBits = kWideWidth - 1;
  using Keys = WideKeys<Team>;
  if (tree.block_count == 0) return;
  Keys here{}, above[kWideDepth - 1] = {};
  std::uint32_t node = 0;
  bool arrived = true;
  for (;;) {
    std::uint32_t first = Keys::kVisited;
    for (int i = 0; i < Keys::kEach; ++i) {
      const int child = team.lane() + i * Team::kWidth;
      if (arrived)
        here.key[i] =
            (query.key(tree.nodes[node], child) & ~kChildBits) | static_cast<std::uint32_t>(child);
      first = here.key[i] < first ? here.key[i] : first;
    }
    first = team.min(first);
    arrived = false;
    if ((first & ~kChildBits) >= query.limit()) {  // nothing left here
      if (node == 0) return;
      node = (node - 1) / kWideWidth;
      here = above[0];
      for (int d = 0; d + 2 < kWideDepth; ++d) above[d] = above[d + 1];
      continue;
    }
    for (int i = 0; i < Keys::kEach; ++i)
      if (here.key[i] == first) here.key[i] = Keys::kVisited;
    const std::uint32_t next = kWideWidth * node + 1 + (first & kChildBits);
    if (next >= tree.first_leaf) {
      query.visit(next - tree.first_leaf);
    } else {
      for (int d = kWideDepth - 2; d > 0; --d) above[d] = above[d - 1];
      above[0] = here;
      node = next;
      arrived = true;
    }
  }
}

}  // namespace ist
