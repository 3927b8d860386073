#include <bit>

#include "query/exact/block_insides.h"
#include "query/exact/exact_overlap.h"
#include "query/exact/mesh_queries.h"

namespace ist {

void ExactQuery::settle(Side& side, CrossedBlock& crossed) noexcept {
  const MeshBlock& mesh = side.mesh.blocks[crossed.block];
  BlockInsides found(
      mesh, crossed.pierced, [&](std::uint32_t edge) { return int{crossed.sum[edge]}; },
      [&](std::uint32_t edge) { return int{crossed.first[edge]}; });
  for (std::uint32_t v = found.unknown(mesh); v < kWidth; v = found.unknown(mesh))
    found.tell(v, is_inside(side, mesh.vertex[v]));
  crossed.inside = static_cast<std::uint16_t>(found.inside);
}

bool ExactQuery::is_inside(const Side& own, std::uint32_t vertex) const noexcept {
  const MeshTree& other = sides_[own.is_b ? 0 : 1].mesh;
  const MeshOfPair solid = own.is_b ? MeshOfPair{other} : MeshOfPair{other, &a_from_b_, &b_from_a_};
  return ist::is_inside(solid, place(own, vertex), search_.aside);
}

/// Marks the blocks that are inside as a whole, by flooding from blocks with pierced edges and from
/// whole shells.
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
