#pragma once

#include <cstddef>
#include <cstdint>

#include "base/bits.h"
#include "cuda/query/exact_arrays.h"
#include "cuda/query/exact_insides.h"
#include "query/exact/exact_sums.h"
#include "query/exact/overlap_octants.h"

// An exact overlap with its crossings in the order of the meshes, as on the CPU: the data of
// OverlapParts (query/exact/overlap_parts.h) on a GPU.

namespace ist::gpu {

struct CrossingRef {
  exact::Point from[2], offset[2];  ///< of an end (exact::EdgeEnd)
  double share[2];            ///< the end's position on the edge, from its first corner: 0 to 1
  std::uint32_t triangle[2];  ///< A's, B's: 16 · block + lane
  std::uint32_t end[2];       ///< the edge; 4: B's; 8: `from` is its first corner
};
struct CrossingPlace {
  std::uint64_t key;  ///< orders crossings as the meshes do
  std::uint32_t crossing;
};

/// Stores crossings in memory for `most`.
template <class Team>
struct KeepCrossings {
  const Team& team;
  CrossingRef* to;
  std::uint32_t most;
  std::uint32_t count = 0;

  IST_HD bool operator()(bool crosses, const std::uint32_t (&pair)[2], const PiercingEdge (&end)[2],
                         const exact::EdgeEnd (&at)[2]) {
    int total = 0;
    const std::uint32_t place =
        count + static_cast<std::uint32_t>(team.exclusive_count(crosses, total));
    count += static_cast<std::uint32_t>(total);
    if (count > most) return false;
    if (!crosses) return true;
    CrossingRef& out = to[place];
    for (int e = 0; e < 2; ++e) {
      out.from[e] = at[e].from;
      out.offset[e] = at[e].offset;
      out.share[e] = at[e].from_second ? 1 - at[e].share : at[e].share;
      out.triangle[e] = pair[e];
      out.end[e] = end[e].edge | end[e].of_b << 2 | (at[e].from_second ? 0u : 8u);
    }
    return true;
  }
};

/// Sorts `count` places, a power of two, by a team.
template <class Team>
IST_HD void sort_places(const Team& team, CrossingPlace* places, std::uint32_t count) {
  team.sync();
  for (std::uint32_t size = 2; size <= count; size *= 2)
    for (std::uint32_t apart = size / 2; apart > 0; apart /= 2) {
      for (auto i = static_cast<std::uint32_t>(team.lane()); i < count / 2;
           i += static_cast<std::uint32_t>(Team::kWidth)) {
        const std::uint32_t low = (i & ~(apart - 1)) << 1 | (i & (apart - 1));
        const CrossingPlace x = places[low], y = places[low | apart];
        if ((x.key > y.key) != ((low & size) == 0)) continue;
        places[low] = y;
        places[low | apart] = x;
      }
      team.sync();
    }
}

/// The crossings and sums of a pair, and the memory in which a team divides it into parts.
template <class Team>
class OverlapRef {
 public:
  IST_HD OverlapRef(const Team& team, const ExactPair& pair, const ExactWorkspace& work,
                    std::uint32_t records, const CrossingRef* crossing, std::uint32_t crossings,
                    const exact::Point& inside, PieceMemory& pieces)
      : team_(team),
        pair_(pair),
        work_(work),
        records_(records),
        crossing_(crossing),
        crossings_(crossings),
        origin_(inside),
        pieces_(pieces) {}

  /// Takes all memory but that for octants; false if the arena is too small.
  IST_HD bool place_parts(Arena& arena) {
    const std::uint32_t n = crossings_, places = power_from(n);
    places_ = arena.take<CrossingPlace>(places);
    opposite_ = arena.take<std::uint8_t>(kWidth * std::size_t{records_});
    slots_ = arena.take<SlotSums>(1);
    stack_ = arena.take<MeshNode>(kWidth * kMaxLevels);
    const std::uint32_t inside = inside_vertices();
    const std::uint32_t table = power_from(2 * (n > inside ? n : inside) + 1);
    const std::size_t elements = n + kWidth * std::size_t{records_} + mesh(0).level[0].count +
                                 std::size_t{mesh(1).level[0].count};
    memory_.ends = arena.take<PiercedEnd>(2 * std::size_t{n});
    memory_.curves = arena.take<CurveExtent>(n);
    memory_.keys = arena.take<std::uint64_t>(table);
    memory_.other_keys = arena.take<std::uint64_t>(2 * std::size_t{n});
    memory_.parent = arena.take<std::uint32_t>(elements);
    memory_.part = arena.take<std::uint32_t>(elements);
    memory_.middles = arena.take<std::uint32_t>(3 * kWidth * std::size_t{records_});
    // There are no more parts than crossings and shells that nothing crosses.
    const std::size_t shells = mesh(0).header->shell_count + mesh(1).header->shell_count;
    memory_.most_parts = n + shells + 1 < PartMemory::kMostParts
                             ? static_cast<std::uint32_t>(n + shells + 1)
                             : PartMemory::kMostParts;
    memory_.parts = arena.take<ExactPart>(memory_.most_parts);
    if (places_ == nullptr || opposite_ == nullptr || slots_ == nullptr || stack_ == nullptr ||
        memory_.ends == nullptr || memory_.curves == nullptr || memory_.keys == nullptr ||
        memory_.other_keys == nullptr || memory_.parent == nullptr || memory_.part == nullptr ||
        memory_.middles == nullptr || memory_.parts == nullptr)
      return false;
    sort(places);
    if (n > 0) origin_ = place_from(0, 0, {0, 0, 0});
    find_apexes();
    sum_whole();
    return true;
  }
  /// Takes the octants' memory for so many parts; false if the arena is too small.
  IST_HD bool place_octants(Arena& arena, std::uint32_t parts) {
    memory_.octants = arena.take<ExactPart>(8 * std::size_t{parts});
    memory_.octant_sums = arena.take<OctantSums>(8 * std::size_t{parts});
    return memory_.octants != nullptr && memory_.octant_sums != nullptr;
  }

  IST_HD ExactSums& whole() { return whole_; }
  IST_HD const exact::Point& origin() const { return origin_; }
  IST_HD ExactPart* parts() const { return memory_.parts; }
  IST_HD ExactPart* octants() const { return memory_.octants; }

 protected:
  IST_HD const PartMemory& memory() const { return memory_; }
  IST_HD bool leads() const { return team_.lane() == 0; }
  IST_HD std::uint32_t lane() const { return static_cast<std::uint32_t>(team_.lane()); }
  IST_HD static constexpr std::uint32_t width() { return static_cast<std::uint32_t>(Team::kWidth); }
  IST_HD void meet() const { team_.sync(); }
  IST_HD bool any(bool flag) const { return team_.any(flag); }
  IST_HD int exclusive_count(bool flag, int& total) const {
    return team_.exclusive_count(flag, total);
  }
  template <class T>
  IST_HD static T load(const T& at) {
    return atomic_load(&at);
  }
  IST_HD static void store(std::uint32_t& at, std::uint32_t to) { atomic_store(&at, to); }
  IST_HD static std::uint32_t add(std::uint32_t& at, std::uint32_t by) {
    return atomic_add(&at, by);
  }
  IST_HD static std::uint32_t exchange(std::uint32_t& at, std::uint32_t to) {
    return atomic_exchange(&at, to);
  }
  template <class T>
  IST_HD static T replace(T& at, T from, T to) {
    return atomic_replace(&at, from, to);
  }
  IST_HD static void least(double& at, double x) { atomic_lower(&at, x, 1); }
  IST_HD static void most(double& at, double x) { atomic_lower(&at, x, -1); }
  IST_HD const MeshTree& mesh(int side) const { return pair_.mesh[side]; }
  IST_HD PieceMemory& pieces() { return pieces_; }
  IST_HD const Similarity& map() const { return pair_.place.a_from_b; }

  IST_HD std::uint32_t crossings() const { return crossings_; }
  IST_HD const CrossingRef& crossing(std::uint32_t i) const {
    return crossing_[places_[i].crossing];
  }
  IST_HD std::uint32_t triangle(int side, std::uint32_t i) const {
    return crossing(i).triangle[side];
  }
  IST_HD CrossingEnd end_of(std::uint32_t i, int e) const {
    const CrossingRef& of = crossing(i);
    const std::uint32_t code = of.end[e], of_b = code >> 2 & 1;
    return {of.triangle[of_b], code & 3, of_b != 0, code >= 8,
            static_cast<std::uint32_t>(e) != of_b};
  }
  IST_HD double share_of_edge(std::uint32_t i, int e) const { return crossing(i).share[e]; }
  IST_HD exact::Point place_of(std::uint32_t i, int e) const { return place_from(i, e, origin_); }

  // Records of both sides share one numbering.
  IST_HD std::uint32_t first_record(int) const { return 0; }
  IST_HD std::uint32_t end_record(int) const { return records_; }
  IST_HD int side_of(std::uint32_t r) const { return work_.records[r].of_b; }
  IST_HD std::uint32_t record_of(int side, std::uint32_t block) const {
    return work_.record[side][block] - 1;
  }
  IST_HD std::uint32_t number_of(std::uint32_t r) const { return work_.records[r].block; }
  IST_HD std::uint32_t inside_of(std::uint32_t r) const { return work_.records[r].inside; }
  IST_HD std::uint64_t pierced_of(std::uint32_t r) const { return work_.records[r].all_pierced(); }
  IST_HD std::uint32_t opposite_edge(std::uint32_t r, std::uint32_t t) const {
    return opposite_[kWidth * r + t];
  }
  IST_HD exact::Point at(std::uint32_t r, std::uint32_t v) const {
    return vertex(side_of(r), mesh(side_of(r)).blocks[number_of(r)].vertex[v]);
  }
  IST_HD int whole_of(std::uint32_t r, std::uint32_t t) const {
    const std::uint32_t edge = 3 * t + opposite_edge(r, t);
    const MeshBlock& block = mesh(side_of(r)).blocks[number_of(r)];
    return static_cast<int>(inside_of(r) >> block.corner[edge % 3][t] & 1) +
           work_.records[r].near_first(edge);
  }

  IST_HD bool is_inside(int side, std::uint32_t b) const {
    return (work_.inside[side][b / 32] >> b % 32 & 1) != 0;
  }
  IST_HD bool is_pierced(int side, std::uint32_t b) const {
    return (work_.pierced[side][b / 32] >> b % 32 & 1) != 0;
  }
  template <class Visit>
  IST_HD void for_each_inside(int side, const Visit& visit) const {
    for_each_block(side, work_.inside[side], visit);
  }
  template <class Visit>
  IST_HD void for_each_pierced(int side, const Visit& visit) const {
    for_each_block(side, work_.pierced[side], visit);
  }

  IST_HD exact::Point vertex(int side, std::uint32_t number) const {
    return pair_.vertex(side, number) - origin_;
  }
  IST_HD LaneSums lane_sums(int side, std::uint32_t b, const exact::Point& from) const {
    return lane_sums_at(side, 1, b, origin_ + from);
  }

  IST_HD void find_crossing_terms(std::uint32_t first, std::uint32_t count = 8) {
    for_each_lane(count, [&](std::uint32_t l) {
      exact::PieceTerms terms = {};
      if (const std::uint32_t i = first + l; i < crossings_) {
        const CrossingRef& of = crossing(i);
        exact::Point apex[2];
        const bool by_b[2] = {(of.end[0] & 4) != 0, (of.end[1] & 4) != 0};
        double times[2];
        find_apexes_of(i, apex, times);
        exact::segment_terms({of.from[0] - origin_, of.from[1] - origin_},
                             {of.offset[0], of.offset[1]}, apex, by_b, times, {0, 0}, terms);
      }
      put(terms, 3, l);
    });
  }
  IST_HD void count_triangles(std::uint32_t r) {
    const MeshBlock& block = mesh(side_of(r)).blocks[number_of(r)];
    for (std::uint32_t t = lane(); t < kWidth; t += width())
      pieces_.whole[t] = static_cast<std::int8_t>(t < block.triangles ? whole_of(r, t) : 0);
    meet();
  }
  IST_HD void find_triangle_terms(std::uint32_t r, std::uint32_t h, std::uint32_t count = 8) {
    const MeshBlock& block = mesh(side_of(r)).blocks[number_of(r)];
    for_each_lane(count, [&](std::uint32_t l) {
      exact::PieceTerms terms = {};
      if (const std::uint32_t t = 8 * h + l; t < block.triangles) {
        const std::uint32_t apex = (opposite_edge(r, t) + 2) % 3;
        exact::cone_terms(pieces_.whole[t], at(r, block.corner[apex][t]),
                          at(r, block.corner[(apex + 1) % 3][t]),
                          at(r, block.corner[(apex + 2) % 3][t]), terms);
      }
      put(terms, 1, l);
    });
  }
  IST_HD void find_octant_pieces(std::uint32_t first) {
    for_each_lane(8, [&](std::uint32_t l) {
      if (first + l < crossings_) see_octants(first + l, l);
    });
  }

 private:
  template <class Work>
  IST_HD void for_each_lane(std::uint32_t count, const Work& work) {
    for (std::uint32_t l = lane(); l < count; l += width()) work(l);
    meet();
  }
  IST_HD void put(const exact::PieceTerms& terms, int volumes, std::uint32_t of) {
    ExactTerms& out = pieces_.more_terms[of / 8];
    const std::uint32_t l = of % 8;
    for (int k = 0; k < volumes; ++k) out.six_volumes[k][l] = terms.six_volumes[k];
    out.rounding[l] = terms.rounding;
    for (int k = 0; k < 3; ++k) {
      out.moment[k][l] = terms.moment[k];
      if (volumes == 1) continue;
      out.force[k][l] = terms.force[k];
      out.torque[k][l] = terms.torque[k];
    }
  }

  /// Computes the terms that crossing i adds to octants, in the view of lane l.
  IST_HD void see_octants(std::uint32_t i, std::uint32_t l) {
    OctantPieces& out = pieces_.octants;
    const OctantView& view = pieces_.view;
    const CrossingRef& of = crossing(i);
    const exact::Point centre = {view.centre[0][l], view.centre[1][l], view.centre[2][l]};
    exact::Point corner[6], apex[2];
    double times[2];
    find_apexes_of(i, apex, times);
    for (int s = 0; s < 2; ++s) corner[s] = apex[s];
    for (int e = 0; e < 2; ++e) {
      corner[OctantPieces::kNear + e] = of.from[e] - origin_;
      corner[OctantPieces::kEnd + e] = corner[OctantPieces::kNear + e] + of.offset[e];
    }
    for (int c = 0; c < 6; ++c) {
      const exact::Point from = corner[c] - centre;
      std::uint32_t octant = 0;
      for (int k = 0; k < 3; ++k) {
        corner[c][k] = out.at[c][k][l] = dot(view.axis[k], from);
        octant |= (corner[c][k] >= 0 ? 1u : 0u) << k;
      }
      out.octant[c][l] = static_cast<std::uint8_t>(octant);
    }
    const bool by_b[2] = {(of.end[0] & 4) != 0, (of.end[1] & 4) != 0};
    exact::OctantTriangles found;
    exact::octant_triangles(corner, by_b, times, found);
    for (int t = 0; t < OctantPieces::kTriangles; ++t) {
      out.of_b[t][l] = t < 2 ? static_cast<std::uint8_t>(t) : (by_b[t - 2] ? 1 : 0);
      out.times[t][l] = t < 2 ? 1 : times[t - 2];
      for (int n = 0; n < OctantPieces::kTerms; ++n)
        out.term[t][n][l] = octants::term(found.of[t], n);
    }
    out.sum[0][l] = found.all.six_volumes;
    for (int k = 0; k < 3; ++k) {
      out.sum[1 + k][l] = found.all.moment[k];
      for (int s = 0; s < 2; ++s) out.sum[4 + 3 * s + k][l] = found.area[s][k];
      out.sum[10 + k][l] = found.all.torque[k];
    }
  }

  IST_HD exact::Point place_from(std::uint32_t i, int e, const exact::Point& origin) const {
    const CrossingRef& of = crossing(i);
    return (of.from[e] - origin) + of.offset[e];
  }
  IST_HD LaneSums lane_sums_at(int side, int level, std::uint32_t n,
                               const exact::Point& from) const {
    const MeshTree::Level& of = mesh(side).level[level];
    return ist::lane_sums(of.boxes[n / kWidth], of.sums[n / kWidth], n % kWidth,
                          side == 0 ? nullptr : &pair_.place.a_from_b, from);
  }
  /// The apexes of a crossing's triangles, and the counts of its ends that are on an edge opposite
  /// to one.
  IST_HD void find_apexes_of(std::uint32_t i, exact::Point (&apex)[2], double (&times)[2]) const {
    std::uint32_t opposite[2];
    for (int s = 0; s < 2; ++s) {
      const std::uint32_t name = triangle(s, i), t = name % kWidth;
      const std::uint32_t r = record_of(s, name / kWidth);
      opposite[s] = opposite_edge(r, t);
      apex[s] = at(r, mesh(s).blocks[name / kWidth].corner[(opposite[s] + 2) % 3][t]);
    }
    for (int e = 0; e < 2; ++e) {
      const CrossingEnd end = end_of(i, e);
      times[e] = opposite[end.of_b ? 1 : 0] != end.edge ? 0.0 : end.enters ? 1.0 : -1.0;
    }
  }

  template <class Visit>
  IST_HD void for_each_block(int side, const std::uint32_t* bits, const Visit& visit) const {
    const std::uint32_t words = (mesh(side).level[0].count + 31) / 32;
    for (std::uint32_t w = 0; w < words; ++w)
      for (const std::uint32_t i : set_bits(bits[w])) visit(32 * w + i);
  }

  /// An upper bound of the vertices inside of crossed blocks.
  IST_HD std::uint32_t inside_vertices() const {
    int mine = 0;
    for (std::uint32_t r = lane(); r < records_; r += width()) mine += count_bits(inside_of(r));
    return static_cast<std::uint32_t>(team_.sum(mine));
  }

  /// Sorts crossings as the CPU finds them: by blocks, then by triangles in them.
  IST_HD void sort(std::uint32_t places) {
    for (std::uint32_t i = lane(); i < places; i += width()) {
      std::uint64_t key = ~std::uint64_t{0};
      if (i < crossings_) {
        const std::uint32_t a = crossing_[i].triangle[0], b = crossing_[i].triangle[1];
        key = std::uint64_t{a / kWidth} << 32 | b / kWidth << 8 | a % kWidth << 4 | b % kWidth;
      }
      places_[i] = {key, i};
    }
    sort_places(team_, places_, places);
  }

  /// Finds, for each triangle of a crossed block, the edge opposite to its apex.
  IST_HD void find_apexes() {
    for (std::uint32_t n = lane(); n < kWidth * records_; n += width()) {
      const std::uint32_t r = n / kWidth, t = n % kWidth;
      const MeshBlock& block = mesh(side_of(r)).blocks[number_of(r)];
      const auto far = [&](int k) { return exact::length_bound(at(r, block.corner[k][t])); };
      const auto apex = static_cast<int>(exact::apex_of(far(0), far(1), far(2)));
      opposite_[n] = static_cast<std::uint8_t>((apex + 1) % 3);
    }
    meet();
  }

  /// Sums the whole overlap in the CPU's order.
  IST_HD void sum_whole() {
    if (leads()) *slots_ = SlotSums();
    meet();
    for (std::uint32_t first = 0; first < crossings_; first += 32) {
      find_crossing_terms(first, 32);
      for (std::uint32_t l = lane(); l < 8; l += width())
        for (std::uint32_t eight = 0; eight < 4 && first + 8 * eight < crossings_; ++eight)
          slots_->add_crossing(pieces_.more_terms[eight], l);
      meet();
    }
    for (int side = 0; side < 2; ++side) {
      for_each_pierced(side, [&](std::uint32_t b) {
        count_triangles(record_of(side, b));
        find_triangle_terms(record_of(side, b), 0, kWidth);
        for (std::uint32_t l = lane(); l < 8; l += width())
          for (int h = 0; h < 2; ++h) slots_->add_triangle(pieces_.more_terms[h], l);
        meet();
      });
      if (leads()) add_insides(side);
    }
    if (leads()) whole_.add(slots_->total());
  }
  /// Adds the blocks that are inside as a whole, by as few nodes as contain them.
  IST_HD void add_insides(int side) {
    const MeshTree& all = mesh(side);
    std::uint32_t waiting = 0;
    stack_[waiting++] = MeshNode::at(all.top, 0);
    while (waiting > 0) {
      const MeshNode node = stack_[--waiting];
      const int level = node.level();
      if (level < all.top) {
        bool whole = false, none = true;
        look_below(work_.inside[side], all, level + 1, node.number(), whole, none);
        if (whole) {
          const LaneSums found = lane_sums_at(side, level + 1, node.number(), origin_);
          whole_.six_volumes.add(found.six_volumes);
          whole_.moment = whole_.moment + found.moment;
        }
        if (whole || none) continue;
      }
      const std::uint32_t left = all.level[level - 1].count - kWidth * node.number();
      for (std::uint32_t l = left < kWidth ? left : kWidth; l > 0; --l)
        stack_[waiting++] = MeshNode::at(level - 1, kWidth * node.number() + l - 1);
    }
  }

  const Team& team_;
  const ExactPair& pair_;
  const ExactWorkspace& work_;
  const std::uint32_t records_;
  const CrossingRef* crossing_;
  const std::uint32_t crossings_;
  exact::Point origin_;
  PieceMemory& pieces_;
  PartMemory memory_ = {};
  CrossingPlace* places_ = nullptr;
  std::uint8_t* opposite_ = nullptr;
  SlotSums* slots_ = nullptr;
  MeshNode* stack_ = nullptr;
  ExactSums whole_;  ///< valid in the leading lane
};

}  // namespace ist::gpu
