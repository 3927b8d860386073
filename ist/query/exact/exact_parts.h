#pragma once

#include <cstdint>
#include <utility>

#include "query/exact/exact_overlap.h"
#include "query/exact/overlap_octants.h"
#include "query/exact/overlap_terms.h"

namespace ist {

/// The result of ExactQuery::run() in the form that OverlapParts uses.
class MeshOverlap : public ExactQuery {
 public:
  using ExactQuery::ExactQuery;

 protected:
  static constexpr bool leads() noexcept { return true; }
  static constexpr std::uint32_t lane() noexcept { return 0; }
  static constexpr std::uint32_t width() noexcept { return 1; }
  static void meet() noexcept {}
  static bool any(bool flag) noexcept { return flag; }
  static int exclusive_count(bool flag, int& total) noexcept {
    total = flag ? 1 : 0;
    return 0;
  }
  template <class T>
  static T load(const T& at) noexcept {
    return at;
  }
  static void store(std::uint32_t& at, std::uint32_t to) noexcept { at = to; }
  static std::uint32_t add(std::uint32_t& at, std::uint32_t by) noexcept {
    return std::exchange(at, at + by);
  }
  static std::uint32_t exchange(std::uint32_t& at, std::uint32_t to) noexcept {
    return std::exchange(at, to);
  }
  static void least(double& at, double x) noexcept { at = x < at ? x : at; }
  static void most(double& at, double x) noexcept { at = x > at ? x : at; }
  template <class T>
  static T replace(T& at, T from, T to) noexcept {
    const T before = at;
    if (before == from) at = to;
    return before;
  }

  const MeshTree& mesh(int side) const noexcept { return sides_[side].mesh; }
  const PartMemory& memory() const noexcept { return memory_; }
  PieceMemory& pieces() noexcept { return scratch_.pieces; }
  const ExactSums& whole() const noexcept { return out_.sums; }
  const exact::Point& origin() const noexcept { return out_.origin; }
  const Similarity& map() const noexcept { return a_from_b_; }

  std::uint32_t crossings() const noexcept { return out_.crossings; }
  std::uint32_t triangle(int side, std::uint32_t i) const noexcept {
    return scratch_.crossings.triangle(side, i);
  }
  CrossingEnd end_of(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.end_of(i, e);
  }
  double way_of(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.end(e, Crossings::kT)[i];
  }
  exact::Point place_of(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.place_of(i, e, out_.origin);
  }

  std::uint32_t first_record(int side) const noexcept {
    return side == 0 ? 0 : sides_[0].marks.count;
  }
  std::uint32_t end_record(int side) const noexcept {
    return first_record(side) + sides_[side].marks.count;
  }
  int side_of(std::uint32_t r) const noexcept { return r < sides_[0].marks.count ? 0 : 1; }
  std::uint32_t record_of(int side, std::uint32_t block) const noexcept {
    return first_record(side) + sides_[side].marks.place[block];
  }
  const CrossedBlock& crossed(std::uint32_t r) const noexcept {
    const int side = side_of(r);
    return sides_[side].marks.blocks[r - first_record(side)];
  }
  std::uint32_t number_of(std::uint32_t r) const noexcept { return crossed(r).block; }
  std::uint32_t inside_of(std::uint32_t r) const noexcept { return crossed(r).inside; }
  std::uint64_t pierced_of(std::uint32_t r) const noexcept { return crossed(r).pierced; }
  std::uint32_t opposite_edge(std::uint32_t r, std::uint32_t t) const noexcept {
    return ExactQuery::opposite_edge(crossed(r), t);
  }
  exact::Point at(std::uint32_t r, std::uint32_t v) const noexcept { return crossed(r).at(v); }
  int whole_of(std::uint32_t r, std::uint32_t t) const noexcept {
    return middle_of(mesh(side_of(r)).blocks[number_of(r)], crossed(r),
                     3 * t + opposite_edge(r, t));
  }

  bool is_inside(int side, std::uint32_t b) const noexcept {
    return has(sides_[side].marks.inside, b);
  }
  bool is_pierced(int side, std::uint32_t b) const noexcept {
    return has(sides_[side].marks.pierced, b);
  }
  template <class Visit>
  void for_each_inside(int side, const Visit& visit) const {
    for_each_block(sides_[side].marks.inside, mesh(side).level[0].count, visit);
  }
  template <class Visit>
  void for_each_pierced(int side, const Visit& visit) const {
    for_each_block(sides_[side].marks.pierced, mesh(side).level[0].count, visit);
  }

  exact::Point vertex(int side, std::uint32_t number) const noexcept {
    return place(sides_[side], number) - out_.origin;
  }
  LaneSums lane_sums(int side, std::uint32_t b, const exact::Point& from) const noexcept {
    return ExactQuery::lane_sums(sides_[side], 1, b / kWidth, b % kWidth, out_.origin + from);
  }

  void find_crossing_terms(std::uint32_t first) noexcept {
    crossing_terms(scratch_.crossings, first, out_.origin, pieces().terms);
  }
  void count_triangles(std::uint32_t r) noexcept {
    ExactQuery::count_triangles(mesh(side_of(r)).blocks[number_of(r)], crossed(r), pieces().whole);
  }
  void find_triangle_terms(std::uint32_t r, std::uint32_t h) noexcept {
    triangle_terms(crossed(r), pieces().whole, static_cast<int>(h), pieces().terms);
  }
  void find_octant_pieces(std::uint32_t first) noexcept {
    octant_pieces(scratch_.crossings, first, pieces().view, pieces().octants);
  }

 private:
  PartMemory memory_ = scratch_.part_memory();
};

/// An overlap, its connected parts and their octants.
class ExactParts : public OverlapOctants<MeshOverlap> {
 public:
  using OverlapOctants::OverlapOctants;

  /// Divides the result of run(): OverlapParts::divide(). For a kept pair it knows if all is one
  /// part.
  std::uint32_t divide() noexcept;

  /// The ends of crossing i relative to the origin, A's unit frame.
  void segment(std::uint32_t i, exact::Point& from, exact::Point& to) const noexcept {
    from = place_of(i, 0);
    to = place_of(i, 1);
  }

 private:
  std::uint64_t hash_of_names() const noexcept;
};

}  // namespace ist
