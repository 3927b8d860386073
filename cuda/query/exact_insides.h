#pragma once

#include <cstdint>
#include <new>

#include "base/bits.h"
#include "cuda/base/atomics.h"
#include "cuda/query/exact_memory.h"
#include "cuda/query/exact_pair.h"
#include "query/exact/inside_search.h"

namespace ist::gpu {

/// Tests whether all or none of the blocks below a lane of a level are inside. `inside` has a bit
/// for each block.
IST_HD inline void look_below(const std::uint32_t* inside, const MeshTree& mesh, int level,
                              std::uint32_t number, bool& all, bool& none) {
  const std::uint32_t shift = 4 * static_cast<std::uint32_t>(level - 1);
  const std::uint32_t count = mesh.level[0].count;
  const std::uint32_t first = number << shift;
  const std::uint32_t end = count - first < 1u << shift ? count : first + (1u << shift);
  all = none = true;
  for (std::uint32_t b = first; b < end; b += 32 - b % 32) {
    const std::uint32_t left = end - b < 32 - b % 32 ? end - b : 32 - b % 32;
    const std::uint32_t mask = (left == 32 ? ~0u : (1u << left) - 1) << b % 32;
    const std::uint32_t word = inside[b / 32] & mask;
    all = all && word == mask;
    none = none && word == 0;
  }
}

/// Finds the parts of each mesh that are inside the other once all crossings are known, and adds
/// their terms to the sums.
template <class Team, bool kExactly>
class ExactInsides {
 public:
  IST_HD ExactInsides(const Team& team, const ExactPair& pair, ExactSumMemory& memory,
                      const ExactWorkspace& work, std::uint32_t records, bool crossed)
      : team_(team),
        pair_(pair),
        memory_(memory),
        work_(work),
        records_(records),
        crossed_(crossed) {}

  /// False if doubles do not decide what is inside.
  IST_HD bool run() {
    settle();
    for (int side = 0; side < 2; ++side) {
      flood(side);
      sum_inside(side);
    }
    sum_records();
    bound_near();
    return !unsure_;
  }

 private:
  IST_HD bool has(const std::uint32_t* bits, std::uint32_t b) const {
    return (bits[b / 32] >> b % 32 & 1) != 0;
  }
  /// Called by the whole team.
  IST_HD bool is_inside_other(int side, std::uint32_t vertex) {
    const MeshTree& other = pair_.mesh[1 - side];
    const MeshOfPair solid = side == 1
                                 ? MeshOfPair{other}
                                 : MeshOfPair{other, &pair_.place.a_from_b, &pair_.place.b_from_a};
    return is_inside<kExactly>(team_, solid, pair_.vertex(side, vertex), pair_.aside, memory_.stack,
                               unsure_);
  }

  /// Decides which vertices of the records are inside.
  IST_HD void settle() {
    const auto lane = static_cast<std::uint32_t>(team_.lane());
    for (std::uint32_t first = 0; first < records_;
         first += static_cast<std::uint32_t>(Team::kWidth)) {
      const std::uint32_t r = first + lane;
      std::uint32_t unknown = kWidth;
      BlockInsides& found = *new (memory_.insides[lane]) BlockInsides;
      int side = 0;
      std::uint32_t block = 0;
      if (r < records_) {
        const CrossedRef& record = work_.records[r];
        side = record.of_b;
        block = record.block;
        if (record.all_pierced() != 0) {
          const MeshBlock& mesh = pair_.mesh[side].blocks[block];
          new (&found) BlockInsides(
              mesh, record.all_pierced(), [&](std::uint32_t e) { return record.sum(e); },
              [](std::uint32_t) { return 0; });
          unknown = found.unknown(mesh);
          atomic_or(&work_.pierced[side][block / 32], 1u << block % 32);
        }
      }
      for (;;) {
        int waiting = 0;
        const int next = team_.first(unknown < kWidth, waiting);
        if (next < 0) break;
        const int of_side = team_.broadcast(side, next);
        const MeshBlock& mesh = pair_.mesh[of_side].blocks[team_.broadcast(block, next)];
        const bool is = is_inside_other(of_side, mesh.vertex[team_.broadcast(unknown, next)]);
        if (team_.lane() == next) {
          found.tell(unknown, is);
          unknown = found.unknown(mesh);
        }
      }
      if (r < records_) work_.records[r].inside = static_cast<std::uint16_t>(found.inside);
    }
    team_.sync();
  }

  /// Marks a block that is inside as a whole, and queues it.
  IST_HD void wait(int side, std::uint32_t block) {
    if (has(work_.pierced[side], block)) return;
    const std::uint32_t bit = 1u << block % 32;
    if ((atomic_or(&work_.inside[side][block / 32], bit) & bit) != 0) return;
    work_.flood[atomic_add(&memory_.flooded, 1)] = block;
  }

  // Several lanes visit a block's neighbours together, since each waits for memory twice.
  static constexpr std::uint32_t kOfGroup = Team::kWidth < 8 ? 1 : 8;
  static constexpr std::uint32_t kGroups = static_cast<std::uint32_t>(Team::kWidth) / kOfGroup;
  IST_HD std::uint32_t group() const { return static_cast<std::uint32_t>(team_.lane()) / kOfGroup; }
  IST_HD std::uint32_t place_in_group() const {
    return static_cast<std::uint32_t>(team_.lane()) % kOfGroup;
  }

  /// Floods the inside from blocks with pierced edges, and from whole shells.
  IST_HD void flood(int side) {
    const MeshTree& mesh = pair_.mesh[side];
    const std::uint32_t shells = mesh.header->shell_count;
    team_.sync();  // all have read the other side's list
    if (team_.lane() == 0) memory_.flooded = 0;
    team_.sync();
    bool any = false;
    for (std::uint32_t r = group(); r < records_; r += kGroups) {
      const CrossedRef& record = work_.records[r];
      if (record.of_b != side || record.all_pierced() == 0) continue;
      any = true;
      const MeshBlock& block = mesh.blocks[record.block];
      for (std::uint32_t k = place_in_group(); k < block.neighbours; k += kOfGroup) {
        const std::uint32_t entry = mesh.neighbours[block.first_neighbour + k];
        if ((record.inside >> entry % kWidth & 1) != 0) wait(side, entry / kWidth);
      }
    }
    // A solid whose only shell is pierced has no whole shell inside.
    any = team_.any(any);
    for (std::uint32_t s = 0; s < shells && !(any && shells == 1); ++s) {
      const std::uint32_t block = mesh.shells[s].block;
      if (is_pierced(side, s)) continue;
      if (!is_inside_other(side, mesh.blocks[block].vertex[0])) continue;
      if (!crossed_) {
        crossed_ = true;
        const exact::Point here = pair_.vertex(side, mesh.blocks[block].vertex[0]);
        team_.sync();
        if (team_.lane() == 0) memory_.origin = here;
      }
      if (team_.lane() == 0) wait(side, block);
    }
    team_.sync();
    std::uint32_t done = 0;
    for (;;) {
      const std::uint32_t flooded = memory_.flooded;
      if (done == flooded) break;
      team_.sync();
      for (std::uint32_t i = done + group(); i < flooded; i += kGroups) {
        const MeshBlock& block = mesh.blocks[work_.flood[i]];
        for (std::uint32_t k = place_in_group(); k < block.neighbours; k += kOfGroup)
          wait(side, mesh.neighbours[block.first_neighbour + k] / kWidth);
      }
      done = flooded;
      team_.sync();
    }
  }

  /// True if an edge of the shell is pierced.
  IST_HD bool is_pierced(int side, std::uint32_t shell) const {
    bool pierced = false;
    for (std::uint32_t r = static_cast<std::uint32_t>(team_.lane()); r < records_;
         r += static_cast<std::uint32_t>(Team::kWidth)) {
      const CrossedRef& record = work_.records[r];
      pierced = pierced || (record.of_b == side && record.all_pierced() != 0 &&
                            pair_.mesh[side].blocks[record.block].shell == shell);
    }
    return team_.any(pierced);
  }

  /// Adds the blocks that are inside as a whole, by as few nodes as contain them.
  IST_HD void sum_inside(int side) {
    const MeshTree& mesh = pair_.mesh[side];
    if (memory_.flooded == 0) return;
    MeshNode* const stack = memory_.stack.node;
    std::uint32_t waiting = 1;
    team_.sync();
    if (team_.lane() == 0) stack[0] = MeshNode::at(mesh.top, 0);
    team_.sync();
    while (waiting > 0) {
      const MeshNode node = stack[--waiting];
      const int level = node.level();
      const std::uint32_t number = node.number();
      const std::uint32_t used = mesh.level[level - 1].count - kWidth * number;
      team_.sync();
      for (int first = 0; first < static_cast<int>(kWidth); first += Team::kWidth) {
        const auto l = static_cast<std::uint32_t>(first + team_.lane());
        bool all = false, none = true;
        if (l < kWidth && l < used)
          look_below(work_.inside[side], mesh, level, kWidth * number + l, all, none);
        if (all) add_lane(side, level, number, l);
        int total = 0;
        const int before = team_.exclusive_count(!all && !none, total);
        if (!all && !none)
          stack[waiting + static_cast<std::uint32_t>(before)] =
              MeshNode::at(level - 1, kWidth * number + l);
        waiting += static_cast<std::uint32_t>(total);
      }
      team_.sync();
    }
  }

  IST_HD void add_lane(int side, int level, std::uint32_t i, std::uint32_t lane) {
    const MeshTree::Level& of = pair_.mesh[side].level[level];
    const LaneSums found = lane_sums(of.boxes[i], of.sums[i], lane,
                                     side == 0 ? nullptr : &pair_.place.a_from_b, memory_.origin);
    memory_.add(team_.lane(), found.six_volumes);
    memory_.add(team_.lane(), ExactSum::kMoment, found.moment);
    memory_.sum[ExactSum::kRounding][team_.lane()] += found.six_volume_rounding;
    memory_.sum[ExactSum::kLayers][team_.lane()] +=
        moved_layer(pair_.moved[side], found.area, found.width);
  }

  /// Bounds the error of the volume from rounding and deviations of blocks near the other surface.
  IST_HD void bound_near() {
    for (int side = 0; side < 2; ++side)
      for (std::uint32_t w = static_cast<std::uint32_t>(team_.lane()); w < work_.words;
           w += static_cast<std::uint32_t>(Team::kWidth))
        for (const std::uint32_t i : set_bits(work_.near[side][w])) bound(side, 32 * w + i);
  }

  /// Adds, for triangles of crossed blocks, the cones over the edges opposite to their apexes.
  IST_HD void sum_records() {
    const std::uint32_t triangles = kWidth * records_;
    for (std::uint32_t n = static_cast<std::uint32_t>(team_.lane()); n < triangles;
         n += static_cast<std::uint32_t>(Team::kWidth)) {
      const CrossedRef& record = work_.records[n / kWidth];
      const std::uint32_t t = n % kWidth;
      const int side = record.of_b;
      const MeshBlock& block = pair_.mesh[side].blocks[record.block];
      if (t >= block.triangles || record.all_pierced() == 0) continue;
      const exact::Point corner[3] = {
          pair_.vertex(side, block.vertex[block.corner[0][t]]) - memory_.origin,
          pair_.vertex(side, block.vertex[block.corner[1][t]]) - memory_.origin,
          pair_.vertex(side, block.vertex[block.corner[2][t]]) - memory_.origin};
      const auto apex = static_cast<std::uint32_t>(exact::apex_of(exact::length_bound(corner[0]),
                                                                  exact::length_bound(corner[1]),
                                                                  exact::length_bound(corner[2])));
      // The count shows whether the middle of the edge opposite to the apex is inside.
      const std::uint32_t k = (apex + 1) % 3, edge = 3 * t + k;
      const int count =
          static_cast<int>(record.inside >> block.corner[k][t] & 1) + record.near_first(edge);
      if (count == 0) continue;
      exact::PieceTerms terms;
      exact::cone_terms(count, corner[apex], corner[(apex + 1) % 3], corner[(apex + 2) % 3], terms);
      memory_.add(team_.lane(), terms.six_volumes[0]);
      memory_.add(team_.lane(), ExactSum::kMoment, terms.moment);
      memory_.sum[ExactSum::kRounding][team_.lane()] += terms.rounding;
    }
  }

  IST_HD void bound(int side, std::uint32_t b) {
    const MeshTree::Level& of = pair_.mesh[side].level[1];
    const BoxBlock& box = of.boxes[b / kWidth];
    const std::uint32_t lane = b % kWidth;
    const double scale = side == 0 ? 1 : pair_.place.a_from_b.scale;
    double wide = 0;
    for (int k = 0; k < 3; ++k)
      wide += scale * (double{box.high[k][lane]} - double{box.low[k][lane]});
    memory_.sum[ExactSum::kLayers][team_.lane()] +=
        moved_layer(pair_.moved[side], scale * scale * of.sums[b / kWidth].area[lane], wide);
  }

  const Team& team_;
  const ExactPair& pair_;
  ExactSumMemory& memory_;
  const ExactWorkspace& work_;
  std::uint32_t records_;
  bool crossed_;  ///< the origin is set
  bool unsure_ = false;
};

}  // namespace ist::gpu
