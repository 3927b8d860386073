#pragma once

#include <cstdint>

#include "query/exact/exact_overlap.h"

namespace ist {

/// An overlap and its connected parts. Surfaces hang together by the curves where they cross and by
/// vertices inside the other solid.
class ExactParts : public ExactQuery {
 public:
  using ExactQuery::ExactQuery;

  /// Divides what run() found. Returns how many parts there are, at most ExactScratch::kMostParts
  /// (all further ones are in the last): ExactScratch::parts, by their first crossings.
  std::uint32_t divide() noexcept;

  /// Of crossing i in the order of sums, [0, ExactOverlap::crossings).
  std::uint32_t part_of_crossing(std::uint32_t i) noexcept;
  /// Its ends, A's unit frame.
  void segment(std::uint32_t i, exact::Point& from, exact::Point& to) const noexcept;

 protected:
  std::uint32_t part_of(std::uint32_t element) noexcept;

  // Elements: crossings, vertices of crossed blocks, and blocks inside as a whole.
  std::uint32_t vertex_element(const Side& side, const CrossedBlock& crossed,
                               std::uint32_t vertex) const noexcept;
  std::uint32_t block_element(const Side& side, std::uint32_t block) const noexcept;
  /// What a triangle of a crossed block hangs together with, where it counts as a whole.
  std::uint32_t triangle_element(const Side& side, const CrossedBlock& crossed,
                                 std::uint32_t triangle) const noexcept;

 private:
  std::uint32_t root(std::uint32_t element) noexcept;
  void unite(std::uint32_t x, std::uint32_t y) noexcept;
  /// Of the edges of a crossed block, by its place.
  std::uint32_t first_middle(const Side& side, std::uint32_t place) const noexcept;

  void begin() noexcept;
  void join_curves() noexcept;
  void join_holes(Side& side) noexcept;
  void join_edges() noexcept;
  std::uint32_t join_edge(const Side& side, const CrossedBlock& crossed, std::uint32_t edge,
                          std::uint32_t first) noexcept;
  void join_vertices(Side& side) noexcept;
  void join_blocks(Side& side) noexcept;
  void join() noexcept;
  std::uint64_t hash_of_names() const noexcept;
  void name_parts() noexcept;
  /// Whether all that counts is in one part.
  bool are_one() noexcept;
  void sum_parts() noexcept;
  void join_cavities() noexcept;

  std::uint32_t parts_ = 0;
  bool one_ = false;      ///< all that counts is in one part
  bool by_names_ = true;  ///< what hangs together follows from what hash_of_names() is of
  std::uint32_t vertices_of_b_ = 0, blocks_of_a_ = 0, blocks_of_b_ = 0;  ///< first elements
};

}  // namespace ist
