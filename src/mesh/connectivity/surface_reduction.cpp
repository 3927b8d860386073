#include "mesh/connectivity/surface_reduction.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <cstdlib>
#include <unordered_map>

#include "base/thread_arena.h"
#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {

bool is_on_a_line(const double* a, const double* b, const double* c) {
  for (const int skip : {0, 1, 2}) {  // projected along each axis
    const int i = (skip + 1) % 3, j = (skip + 2) % 3;
    const double of_a[2] = {a[i], a[j]}, of_b[2] = {b[i], b[j]}, of_c[2] = {c[i], c[j]};
    if (orient2d_sign(of_a, of_b, of_c) != 0) return false;
  }
  return true;
}

bool is_degenerate(const std::vector<Eigen::Vector3d>& vertices, const Triangle& t) {
  return has_repeated_corner(t) ||
         is_on_a_line(vertices[t[0]].data(), vertices[t[1]].data(), vertices[t[2]].data());
}

std::size_t count_odd_edges(const EdgeTable& edges) {
  return count_where(edges.size(), [&](std::size_t e) { return edges.sides(e).size() % 2 == 1; });
}

namespace {

void keep_only(std::vector<Triangle>& triangles, const std::vector<bool>& keep) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (keep[t]) triangles[kept++] = triangles[t];
  triangles.resize(kept);
}

/// `dropped` must be ascending.
void remove(const std::vector<std::uint32_t>& dropped, std::vector<Triangle>& triangles) {
  if (dropped.empty()) return;
  auto kept = triangles.begin() + dropped[0];
  for (std::size_t i = 0; i < dropped.size(); ++i) {
    const std::size_t end = i + 1 < dropped.size() ? dropped[i + 1] : triangles.size();
    kept = std::copy(triangles.begin() + dropped[i] + 1,
                     triangles.begin() + static_cast<std::ptrdiff_t>(end), kept);
  }
  triangles.erase(kept, triangles.end());
}

struct Stack {
  std::vector<std::uint32_t> members;
  int sum = 0;  ///< of the members' directions, relative to the first
};

/// True if two triangles list the same corners in the same cyclic order.
bool same_direction(const Triangle& a, const Triangle& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a[0] == b[k]) return a[1] == b[(k + 1) % 3];
  return false;
}

std::uint32_t corner_opposite(const std::vector<Triangle>& triangles, std::uint32_t side) {
  return triangles[side / 3][(side + 2) % 3];
}

/// False if no triangles have the same three corners.
bool may_have_stacks(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, edges.size()), false,
      [&](const tbb::blocked_range<std::size_t>& range, bool any) {
        for (std::size_t e = range.begin(); e < range.end() && !any; ++e) {
          const auto sides = edges.sides(e);
          // A manifold edge has two sides; at others a stack is likely.
          any = sides.size() > 2 || (sides.size() == 2 && corner_opposite(triangles, sides[0]) ==
                                                              corner_opposite(triangles, sides[1]));
        }
        return any;
      },
      std::logical_or<>());
}

std::vector<Stack> find_stacks(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  std::vector<Stack> stacks;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> at_edge;  // opposite corner, triangle
  for (std::size_t e = 0; e < edges.size(); ++e) {
    at_edge.clear();
    for (const std::uint32_t side : edges.sides(e)) {
      // A stack appears at its three edges; it is handled at the edge of its two smallest corners.
      const std::uint32_t opposite = corner_opposite(triangles, side);
      if (opposite > edges.high(e)) at_edge.emplace_back(opposite, side / 3);
    }
    std::sort(at_edge.begin(), at_edge.end());
    for (std::size_t begin = 0, end; begin < at_edge.size(); begin = end) {
      end = begin + 1;
      while (end < at_edge.size() && at_edge[end].first == at_edge[begin].first) ++end;
      if (end == begin + 1) continue;
      Stack stack;
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t t = at_edge[i].second;
        stack.members.push_back(t);
        stack.sum += same_direction(triangles[stack.members[0]], triangles[t]) ? 1 : -1;
      }
      stacks.push_back(std::move(stack));
    }
  }
  return stacks;
}

}  // namespace

std::vector<std::uint32_t> drop_degenerate(const std::vector<Eigen::Vector3d>& vertices,
                                           std::vector<Triangle>& triangles,
                                           const EdgeTable& edges) {
  const std::vector<std::uint32_t> degenerate = indices_where(
      triangles.size(), [&](std::size_t t) { return is_degenerate(vertices, triangles[t]); });
  std::vector<std::uint32_t> dropped, open;
  for (const std::uint32_t t : degenerate)
    (has_repeated_corner(triangles[t]) ? dropped : open).push_back(t);
  std::unordered_map<std::uint32_t, std::size_t> sides;  // parity at the edges of open stacks
  const auto edge_of = [&](std::uint32_t t, std::size_t k) {
    return edges.edge_of(3 * std::size_t{t} + k);
  };
  for (const std::uint32_t t : open)
    for (std::size_t k = 0; k < 3; ++k)
      sides.emplace(edge_of(t, k), edges.sides(edge_of(t, k)).size());
  for (bool more = true; more;) {
    const std::size_t before = dropped.size();
    std::erase_if(open, [&](std::uint32_t t) {
      std::size_t odd = 0;
      for (std::size_t k = 0; k < 3; ++k) odd += sides[edge_of(t, k)] % 2;
      if (odd < 2) return false;
      for (std::size_t k = 0; k < 3; ++k) --sides[edge_of(t, k)];
      dropped.push_back(t);
      return true;
    });
    more = dropped.size() != before;
  }
  std::sort(dropped.begin(), dropped.end());
  remove(dropped, triangles);
  return dropped;
}

std::size_t reduce_coincident(std::vector<Triangle>& triangles, const EdgeTable& edges) {
  if (!may_have_stacks(triangles, edges)) return 0;
  const std::vector<Stack> stacks = find_stacks(triangles, edges);
  if (stacks.empty()) return 0;

  // Stacks that share an edge are decided together.
  DisjointSets groups(stacks.size());
  std::vector<std::uint32_t> stack_at(edges.size(), kNoIndex);
  const auto edge_of = [&](const Stack& stack, std::size_t k) {
    return edges.edge_of(3 * std::size_t{stack.members[0]} + k);
  };
  for (std::uint32_t s = 0; s < stacks.size(); ++s)
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& other = stack_at[edge_of(stacks[s], k)];
      if (other == kNoIndex) other = s;
      groups.unite(other, s);
    }

  // Two possible reductions of a group: the copies of a stack that remain, and the odd edges.
  const auto copies_left = [&](const Stack& stack, bool one_copy) {
    return one_copy ? 1u : static_cast<std::uint32_t>(std::abs(stack.sum));
  };
  std::vector<std::array<std::size_t, 2>> odd(stacks.size(), {0, 0});
  std::vector<bool> cancels(stacks.size(), false);
  std::vector<std::array<std::size_t, 2>> sides(edges.size());
  for (std::size_t e = 0; e < edges.size(); ++e) sides[e].fill(edges.sides(e).size());
  for (const Stack& stack : stacks)
    for (std::size_t k = 0; k < 3; ++k)
      for (const bool one_copy : {false, true})
        sides[edge_of(stack, k)][one_copy] -= stack.members.size() - copies_left(stack, one_copy);
  for (std::uint32_t s = 0; s < stacks.size(); ++s) {
    const std::uint32_t group = groups.find(s);
    for (std::size_t k = 0; k < 3; ++k)
      for (const bool one_copy : {false, true})
        odd[group][one_copy] += sides[edge_of(stacks[s], k)][one_copy] % 2;
    if (stacks[s].sum == 0) cancels[group] = true;
  }

  std::vector<bool> keep(triangles.size(), true);
  for (std::uint32_t s = 0; s < stacks.size(); ++s) {
    const Stack& stack = stacks[s];
    const std::uint32_t group = groups.find(s);
    // Copies of the same direction are redundant even if they cancel nothing.
    const bool one_copy =
        odd[group][1] < odd[group][0] || (odd[group][1] == odd[group][0] && !cancels[group]);
    const std::uint32_t copies = copies_left(stack, one_copy);
    // The remaining ones face in the direction of the sum.
    std::uint32_t kept = 0;
    for (const std::uint32_t t : stack.members) {
      const bool direction = same_direction(triangles[stack.members[0]], triangles[t]);
      const bool wanted = stack.sum == 0 || direction == (stack.sum > 0);
      keep[t] = wanted && kept < copies;
      kept += keep[t] ? 1 : 0;
    }
  }
  const std::size_t before = triangles.size();
  keep_only(triangles, keep);
  return before - triangles.size();
}

}  // namespace ist
