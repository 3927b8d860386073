#include <bit>

#include "query/exact/exact_overlap.h"
#include "query/exact/mesh_queries.h"

namespace ist {

/// Which vertices are inside: those of pierced edges by what pierces them, the others by edges that
/// nothing pierces.
void ExactQuery::settle(Side& side, CrossedBlock& crossed) noexcept {
  const MeshBlock& mesh = side.mesh.blocks[crossed.block];
  std::uint32_t known = 0, inside = 0;
  for (std::uint64_t left = crossed.pierced; left != 0; left &= left - 1) {
    const auto edge = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::uint32_t p = mesh.corner[edge % 3][edge / 3],
                        q = mesh.corner[(edge + 1) % 3][edge / 3];
    const int sum = crossed.sum[edge], first = crossed.first[edge];
    const bool leaves = (sum == 0) & (first < 0);  // and enters again
    const auto clear = static_cast<std::uint32_t>((sum != 0) | (first != 0));
    known |= clear << p | clear << q;
    inside |= static_cast<std::uint32_t>((sum < 0) | leaves) << p |
              static_cast<std::uint32_t>((sum > 0) | leaves) << q;
  }
  std::uint32_t joined[kWidth] = {};
  for (std::uint32_t t = 0; t < mesh.triangles; ++t) {
    const std::uint32_t v[3] = {mesh.corner[0][t], mesh.corner[1][t], mesh.corner[2][t]};
    const auto other_end = [&](std::uint32_t edge, std::uint32_t end) {
      return static_cast<std::uint32_t>(~crossed.pierced >> (3 * t + edge) & 1) << v[end];
    };
    joined[v[0]] |= other_end(0, 1) | other_end(2, 2);
    joined[v[1]] |= other_end(0, 0) | other_end(1, 2);
    joined[v[2]] |= other_end(1, 1) | other_end(2, 0);
  }
  const std::uint32_t all = (1u << mesh.vertices) - 1;
  const auto spread = [&](std::uint32_t from) {
    while (from != 0) {
      const auto v = static_cast<std::uint32_t>(std::countr_zero(from));
      from &= from - 1;
      const std::uint32_t reached = joined[v] & ~known;
      known |= reached;
      from |= reached;
      if (inside >> v & 1) inside |= reached;
    }
  };
  spread(known);
  while (known != all) {  // where it is not clear what pierces an edge first
    const auto v = static_cast<std::uint32_t>(std::countr_zero(all & ~known));
    if (is_inside(side, mesh.vertex[v])) inside |= 1u << v;
    known |= 1u << v;
    spread(1u << v);
  }
  crossed.inside = static_cast<std::uint16_t>(inside);
}

bool ExactQuery::is_inside(const Side& own, std::uint32_t vertex) const noexcept {
  const MeshTree& other = sides_[own.is_b ? 0 : 1].mesh;
  const MeshOfPair solid = own.is_b ? MeshOfPair{other} : MeshOfPair{other, &a_from_b_, &b_from_a_};
  return ist::is_inside(solid, place(own, vertex), search_.aside);
}

/// Marks the blocks that lie inside as a whole: from those whose edges are pierced on, and whole
/// shells.
void ExactQuery::find_insides(Side& own) noexcept {
  BlockMarks& marks = own.marks;
  const MeshTree& mesh = own.mesh;
  std::uint32_t waiting = 0;
  const auto wait = [&](std::uint32_t block) {
    if (has(marks.pierced, block) || has(marks.inside, block)) return;
    set(marks.inside, block);
    scratch_.flood[waiting++] = block;
  };
  for (std::uint32_t c = 0; c < marks.count; ++c) {
    CrossedBlock& crossed = marks.blocks[c];
    if (crossed.pierced == 0) continue;
    settle(own, crossed);
    const MeshBlock& block = mesh.blocks[crossed.block];
    for (std::uint32_t k = 0; k < block.neighbours; ++k) {
      const std::uint32_t entry = mesh.neighbours[block.first_neighbour + k];
      if (crossed.inside >> entry % kWidth & 1) wait(entry / kWidth);
    }
  }
  for (std::uint32_t s = 0; s < mesh.header->shell_count; ++s)
    if (!has(marks.shells, s) && is_inside(own, mesh.blocks[mesh.shells[s].block].vertex[0])) {
      if (out_.crossings == 0 && waiting == 0)
        out_.origin = place(own, mesh.blocks[mesh.shells[s].block].vertex[0]);
      wait(mesh.shells[s].block);
    }
  while (waiting > 0) {
    const MeshBlock& block = mesh.blocks[scratch_.flood[--waiting]];
    for (std::uint32_t k = 0; k < block.neighbours; ++k)
      wait(mesh.neighbours[block.first_neighbour + k] / kWidth);
  }
}

}  // namespace ist
