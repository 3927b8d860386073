#pragma once

#include <ist/asset_layout.h>
#include <cstdint>

#include "base/bits.h"
#include "base/host_device.h"
#include "query/exact/box_integrals.h"
#include "query/exact/orientation.h"

namespace ist {

/// The vertices of a crossed block that are inside the other solid, a bit for each local vertex.
/// Those of pierced edges follow from what pierces them, the others from edges that nothing
/// pierces.
struct BlockInsides {
  std::uint32_t known = 0, inside = 0;
  std::uint32_t joined[kWidth] =
      {};  ///< of a vertex: those joined to it by edges that nothing pierces

  BlockInsides() = default;

  /// `pierced`: bit 3 · lane + edge. `sum(edge)`: its entries less its exits. `first(edge)`: 1 if
  /// it enters first, −1 if it leaves first, 0 if unclear.
  template <class Sum, class First>
  IST_HD BlockInsides(const MeshBlock& mesh, std::uint64_t pierced, const Sum& sum,
                      const First& first) {
    std::uint32_t found = 0;
    for (const std::uint32_t edge : set_bits(pierced)) {
      const std::uint32_t p = mesh.corner[edge % 3][edge / 3],
                          q = mesh.corner[(edge + 1) % 3][edge / 3];
      const int net = sum(edge), comes_first = first(edge);
      const bool leaves = (net == 0) & (comes_first < 0);  // and enters again
      const auto clear = static_cast<std::uint32_t>((net != 0) | (comes_first != 0));
      found |= clear << p | clear << q;
      inside |= static_cast<std::uint32_t>((net < 0) | leaves) << p |
                static_cast<std::uint32_t>((net > 0) | leaves) << q;
    }
    known = found;
    if (found == (1u << mesh.vertices) - 1) return;
    for (std::uint32_t t = 0; t < mesh.triangles; ++t) {
      const std::uint32_t v[3] = {mesh.corner[0][t], mesh.corner[1][t], mesh.corner[2][t]};
      const auto other_end = [&](std::uint32_t edge, std::uint32_t end) {
        return static_cast<std::uint32_t>(~pierced >> (3 * t + edge) & 1) << v[end];
      };
      joined[v[0]] |= other_end(0, 1) | other_end(2, 2);
      joined[v[1]] |= other_end(0, 0) | other_end(1, 2);
      joined[v[2]] |= other_end(1, 1) | other_end(2, 0);
    }
    spread(found);
  }

  /// Spreads the state of known vertices along edges that nothing pierces.
  IST_HD void spread(std::uint32_t from) {
    known |= from;
    while (from != 0) {
      const auto v = static_cast<std::uint32_t>(lowest_bit(from));
      from &= from - 1;
      const std::uint32_t reached = joined[v] & ~known;
      known |= reached;
      from |= reached;
      if (inside >> v & 1) inside |= reached;
    }
  }

  /// A vertex whose state is unknown, because it is unclear what pierces an edge first; 16 if there
  /// is none.
  IST_HD std::uint32_t unknown(const MeshBlock& mesh) const {
    const std::uint32_t left = ((1u << mesh.vertices) - 1) & ~known;
    return left == 0 ? kWidth : static_cast<std::uint32_t>(lowest_bit(left));
  }
  IST_HD void tell(std::uint32_t vertex, bool is_inside) {
    inside |= static_cast<std::uint32_t>(is_inside) << vertex;
    spread(1u << vertex);
  }
};

/// One mesh of a pair. A's vertices stay, B's are mapped to A's unit frame.
struct MeshOfPair {
  const MeshTree& mesh;
  const Similarity* to_a = nullptr;  ///< null: it is A's
  const Similarity* from_a = nullptr;

  IST_HD bool is_b() const noexcept { return to_a != nullptr; }
  IST_HD exact::Point place(std::uint32_t vertex) const noexcept {
    const exact::Point x = mesh.vertex(vertex);
    return is_b() ? map_point(*to_a, x) : x;
  }
};

/// The pending nodes of a depth-first search.
struct InsideStack {
  MeshNode node[kWidth * kMaxLevels];
};

/// True if a point is inside, A's unit frame, by the triangles that a ray along an axis of the
/// mesh's frame crosses. Signs are exact, with B translated by `aside`, so points on the surface
/// are decided too. Called by the whole team, whose lanes share `stack`. `unsure`: doubles do not
/// decide, without `kExactly`.
template <bool kExactly, class Team>
IST_HD_COLD bool is_inside(const Team& team, const MeshOfPair& solid, const exact::Point& p,
                           const exact::Point& aside, InsideStack& stack, bool& unsure) noexcept {
  using exact::Point;
  const MeshTree& mesh = solid.mesh;
  const Point start = solid.is_b() ? map_point(*solid.from_a, p) : p;
  const double at[3] = {start.x, start.y, start.z};
  // The rounding of the maps there and back, and the symbolic translation of B.
  double pad = 0;
  for (int k = 0; k < 3; ++k)
    pad += std::abs(at[k]) + (solid.is_b() ? std::abs(solid.from_a->t[k]) : 0) + 1e-300;
  pad = 1e-12 * pad + 2 * (solid.is_b() ? solid.from_a->scale : 1.0) *
                          (std::abs(aside.x) + std::abs(aside.y) + std::abs(aside.z));
  float low[3], high[3];
  int axis = 0;
  double shortest = HUGE_VAL, end = 0;
  for (int k = 0; k < 3; ++k) {
    const double lowest = mesh.low[k], highest = mesh.high[k];
    if (at[k] < lowest - pad || at[k] > highest + pad) return false;
    const double beyond = 0.25 * (highest - lowest) + 8 * pad;
    for (const double to : {lowest - beyond, highest + beyond})
      if (std::abs(to - at[k]) < shortest) {
        shortest = std::abs(to - at[k]);
        axis = k;
        end = to;
      }
    low[k] = static_cast<float>(at[k] - pad);
    low[k] -= std::abs(low[k]) * 2e-7f;
    high[k] = static_cast<float>(at[k] + pad);
    high[k] += std::abs(high[k]) * 2e-7f;
  }
  double to[3] = {at[0], at[1], at[2]};
  to[axis] = end;
  (end < at[axis] ? low : high)[axis] = static_cast<float>(end);
  const Point beyond = {to[0], to[1], to[2]};
  const Point q = solid.is_b() ? map_point(*solid.to_a, beyond) : beyond;

  bool doubtful = false;
  int entered = 0, waiting = 1;
  team.sync();  // all have read what is overwritten now
  if (team.lane() == 0) stack.node[0] = MeshNode::at(mesh.top, 0);
  team.sync();
  while (waiting > 0) {
    const MeshNode node = stack.node[--waiting];
    const int level = node.level();
    const std::uint32_t number = node.number();
    if (level == 0) {
      const MeshBlock& block = mesh.blocks[number];
      for (int t = team.lane(); t < block.triangles; t += Team::kWidth) {
        const Point corners[3] = {solid.place(block.vertex[block.corner[0][t]]),
                                  solid.place(block.vertex[block.corner[1][t]]),
                                  solid.place(block.vertex[block.corner[2][t]])};
        entered += exact::enters<kExactly>(p, q, corners, !solid.is_b(), aside, doubtful);
      }
      continue;
    }
    const BoxBlock& boxes = mesh.level[level].boxes[number];
    const std::uint32_t used = mesh.level[level - 1].count - kWidth * number;
    team.sync();  // all have read what is overwritten now
    for (int first = 0; first < static_cast<int>(kWidth); first += Team::kWidth) {
      const auto l = static_cast<std::uint32_t>(first + team.lane());
      bool meets = l < kWidth && l < used;
      for (int k = 0; k < 3; ++k)
        meets = meets && boxes.low[k][l] <= high[k] && boxes.high[k][l] >= low[k];
      int total = 0;
      const int place = waiting + team.exclusive_count(meets, total);
      if (meets) stack.node[place] = MeshNode::at(level - 1, kWidth * number + l);
      waiting += total;
    }
    team.sync();
  }
  if constexpr (!kExactly) unsure = team.any(doubtful) || unsure;
  return team.sum(entered) < 0;
}

}  // namespace ist
