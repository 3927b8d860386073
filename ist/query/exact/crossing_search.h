#pragma once

#include <cstdint>

#include "query/base/relative_pose.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// Two placed meshes whose crossing triangles are wanted.
struct CrossingSearch {
  const MeshTree* a;
  const MeshTree* b;
  Similarity a_from_b;  ///< unit frames
  Similarity b_from_a;
  exact::Point aside = {0, 0, 0};  ///< A's unit frame: signs are those of B moved by this
  float tolerance = 0;             ///< A's unit frame: points may be off by this
  float near = 0;                  ///< pairs within this distance are found, ≥ tolerance
  float reach = 0;  ///< pairs within this distance are kept for later queries, ≥ near
  std::uint32_t max_visits = 0;  ///< pairs of nodes; 0: no limit
  double touch = 0;  ///< solids within this distance touch: the rounding of poses and vertices
};

/// Pairs of blocks of both meshes whose boxes come within `reach`.
struct BlockPairs {
  std::uint32_t count = 0;   ///< in ExactScratch::keys, in any order: A's block << 32 | B's block
  std::uint32_t visits = 0;  ///< pairs of nodes opened
  bool complete = true;      ///< no limit was reached, and memory sufficed
};

struct CrossingsFound {
  std::uint32_t crossings = 0;  ///< in ExactScratch::crossings
  std::uint32_t next = 0;       ///< the pair of blocks to continue from: `count` at the end
  bool complete = true;         ///< no limit was reached, and memory sufficed
  bool consistent = true;       ///< signs agree with each other
};

/// The contact of two solids without common volume.
struct SurfaceContact {
  bool touching = false;     ///< points of both are within CrossingSearch::touch of each other
  double area = 0;           ///< of the faces that lie on each other, back to back
  exact::Point normal = {};  ///< ∫ n dA over them, n out of A
  exact::Point moment = {};  ///< ∫ x dA over them
};

BlockPairs find_block_pairs(const CrossingSearch& search, ExactScratch& scratch) noexcept;

/// Finds all crossing triangles of `count` pairs of blocks (ExactScratch::keys), in the order of
/// the pairs, by exact signs where necessary. The crossings are the same on every instruction set.
/// Continues from crossing `first` and pair `next`, and stops when memory is full. Marks the blocks
/// (BlockMarks::near) whose signs might differ if points moved within the tolerance. `keep`, unless
/// null, gets the pairs of triangles that may cross before B has moved by its margin.
CrossingsFound find_crossings(const CrossingSearch& search, std::uint32_t first, std::uint32_t next,
                              std::uint32_t count, KeptPairs* keep, ExactScratch& scratch) noexcept;

/// Finds the same crossings among pairs of triangles that are kept.
CrossingsFound find_kept_crossings(const CrossingSearch& search, const KeptPairs& kept,
                                   ExactScratch& scratch) noexcept;

/// Finds how the pairs of blocks (ExactScratch::keys), or the kept pairs of triangles, that are
/// marked as near touch, with B not translated.
SurfaceContact find_contact(const CrossingSearch& search, std::uint32_t count,
                            const KeptPairs* kept, ExactScratch& scratch) noexcept;

/// True if one of the first `count` crossings exists wherever points move within the tolerance.
bool any_settled(const CrossingSearch& search, std::uint32_t count, ExactScratch& scratch) noexcept;

/// The vertices of a block in A's unit frame, those of B rounded once after the motion. They are
/// valid until others are placed.
const PlacedVertices& place_block(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                  ExactScratch& scratch) noexcept;

}  // namespace ist
