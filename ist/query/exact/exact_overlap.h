#pragma once

#include <algorithm>
#include <cstdint>

#include <ist/query.h>

#include "base/bits.h"
#include "query/base/relative_pose.h"
#include "query/exact/box_integrals.h"
#include "query/exact/crossing_search.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/exact_sums.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// The overlap of two meshes, A's unit frame.
struct ExactOverlap {
  ExactSums sums;            ///< the gradients are those by a motion of B
  double error = 0;          ///< the true volume is within it of the sums'
  exact::Point origin = {};  ///< of the sums
  SurfaceContact contact;    ///< if the sums' volume is 0
  std::uint32_t visits = 0, crossings = 0;
  /// No limit was reached, memory sufficed, and the answer is consistent; else nothing above is
  /// valid.
  bool complete = true;
  bool consistent = true;  ///< signs agree with each other, as exact ones do
};

/// Volume and gradients of the overlap. Allocates, locks and throws nothing. The answer depends on
/// the meshes and the map alone.
class ExactQuery {
 public:
  /// `moved_a`, `moved_b`: bounds of how far points of the surfaces are from their true places
  /// relative to each other, A's unit frame.
  ExactQuery(const MeshTree& a, double moved_a, const MeshTree& b, double moved_b,
             const Similarity& a_from_b, const Similarity& b_from_a, ExactScratch& scratch) noexcept
      : sides_{{a, scratch.a, false, moved_a}, {b, scratch.b, true, moved_b}},
        a_from_b_(a_from_b),
        b_from_a_(b_from_a),
        scratch_(scratch) {
    move_aside();
  }

  /// `max_visits`: 0 for no limit. `pair_id`: the caller's pair, whose calls are steps of one
  /// motion; 0 for none.
  ExactOverlap run(std::uint32_t max_visits = 0, std::uint32_t pair_id = 0) noexcept;
  /// True if ExactScratch contains all crossings that were found, which parts of the overlap
  /// require.
  bool holds_crossings() const noexcept { return whole_; }

 protected:
  struct Side {
    const MeshTree& mesh;
    BlockMarks& marks;
    bool is_b;
    double moved;
  };

  Side& side(bool of_b) noexcept { return sides_[of_b ? 1 : 0]; }
  CrossedBlock& crossed_block(Side& side, std::uint32_t triangle) noexcept {
    return side.marks.blocks[side.marks.place[triangle / kWidth]];
  }
  static std::uint32_t opposite_edge(const CrossedBlock& crossed, std::uint32_t triangle) noexcept {
    return 9u >> 2 * crossed.apex[triangle] & 3;  // the next one, without a branch
  }
  /// 1 if the middle of a triangle's edge is inside, else 0. Only what is counted from its ends
  /// pierces the edge up to there.
  static int middle_of(const MeshBlock& mesh, const CrossedBlock& crossed, std::uint32_t edge) {
    return static_cast<int>(crossed.inside >> mesh.corner[edge % 3][edge / 3] & 1) +
           (crossed.middle[edge] & -static_cast<int>(crossed.pierced >> edge & 1));
  }

  /// Computes how often the cone over the edge opposite to each lane's apex counts.
  static void count_triangles(const MeshBlock& mesh, const CrossedBlock& crossed,
                              std::int8_t (&whole)[kWidth]) noexcept;
  exact::Point place(const Side& side, std::uint32_t vertex) const noexcept;
  LaneSums lane_sums(const Side& side, int level, std::uint32_t i, std::uint32_t lane,
                     const exact::Point& origin) const noexcept;
  void sum_lane(const Side& side, int level, std::uint32_t i, std::uint32_t lane,
                ExactSums& sums) noexcept;

  template <class Visit>
  static void for_each_block(const HookedArray<std::uint64_t>& bits, std::uint32_t blocks,
                             const Visit& visit) {
    for (std::uint32_t w = 0; w < (blocks + 63) / 64; ++w)
      for (const std::uint32_t i : set_bits(bits[w])) visit(64 * w + i);
  }

  /// Calls visit(level, box block, lane) for the blocks below box block i of a level that are
  /// inside as a whole, by as few lanes as contain them.
  template <class Visit>
  static void for_each_inside(const Side& own, int level, std::uint32_t i, const Visit& visit) {
    const std::uint32_t shift = 4 * (static_cast<std::uint32_t>(level) - 1);
    const std::uint32_t blocks = own.mesh.level[0].count;
    const std::uint32_t used = std::min(kWidth, own.mesh.level[level - 1].count - kWidth * i);
    const std::uint64_t* const words = own.marks.inside.get();
    for (std::uint32_t lane = 0; lane < used; ++lane) {
      const std::uint32_t first = (kWidth * i + lane) << shift;
      const std::uint32_t end = std::min(blocks, first + (1u << shift));
      bool all = true, none = true;
      for (std::uint32_t b = first; b < end; b += 64 - b % 64) {
        const std::uint32_t stop = std::min(end, b + (64 - b % 64));
        const std::uint64_t mask = (~std::uint64_t{0} >> (64 - (stop - b))) << b % 64;
        all = all && (words[b / 64] & mask) == mask;
        none = none && (words[b / 64] & mask) == 0;
      }
      if (none) continue;
      if (all)
        visit(level, i, lane);
      else
        for_each_inside(own, level - 1, kWidth * i + lane, visit);
    }
  }

  Side sides_[2];
  const Similarity& a_from_b_;
  const Similarity& b_from_a_;
  ExactScratch& scratch_;
  ExactOverlap out_;
  KeptPairs* kept_ = nullptr;  ///< of the caller's pair

 private:
  void move_aside() noexcept;
  void clear_marks() noexcept;
  bool begin_search(std::uint32_t max_visits, std::uint32_t pair_id) noexcept;
  CrossingsFound find_more(std::uint32_t first, std::uint32_t next) noexcept;
  void sort_pairs(std::uint32_t count) noexcept;
  CrossedBlock* make_crossed_block(Side& side, std::uint32_t block) noexcept;
  bool add_crossing(std::uint32_t i) noexcept;
  void note_piercing(Side& side, CrossedBlock& crossed, const CrossingEnd& end, double t,
                     double t_error) noexcept;
  void settle(Side& side, CrossedBlock& crossed) noexcept;
  bool is_inside(const Side& side, std::uint32_t vertex) const noexcept;
  void find_insides(Side& side) noexcept;
  void sum_crossed_block(const Side& side, const CrossedBlock& crossed) noexcept;
  double nearness() const noexcept;
  void bound_near(const Side& side) noexcept;
  void add_layer(const Side& side, double area, double width) noexcept;

  CrossingSearch search_ = {&sides_[0].mesh, &sides_[1].mesh, a_from_b_, b_from_a_};
  bool serves_ = false, whole_ = true;
  std::uint32_t block_pairs_ = 0;
  SlotSums slots_;
  double rounding_ = 0;  ///< six times the error bound of the volume's terms
  double layers_ = 0;    ///< the bound of volume from moved surfaces
};

}  // namespace ist
