#pragma once

#include <cstdint>

#include "query/base/relative_pose.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/mesh_tree.h"

namespace ist {

/// Two placed meshes whose crossing triangles are looked for.
struct CrossingSearch {
  const MeshTree* a;
  const MeshTree* b;
  Similarity a_from_b;  ///< unit frames
  Similarity b_from_a;
  exact::Point aside = {0, 0, 0};  ///< A's unit frame: signs are those of B moved by this
  float room = 0;                  ///< A's unit frame: points may be off by this
  float near = 0;                  ///< pairs that come as near are found, ≥ room
  float reach = 0;                 ///< and those that may, for what is kept: ≥ near
  std::uint32_t max_visits = 0;    ///< pairs of nodes; 0: no limit
  double touch = 0;                ///< what comes as near touches: poses and vertices round by this
};

/// Pairs of blocks of both meshes whose boxes come within `reach`.
struct BlockPairs {
  std::uint32_t count = 0;   ///< in ExactScratch::keys, in any order: A's block << 32 | B's block
  std::uint32_t visits = 0;  ///< pairs of nodes opened
  bool complete = true;      ///< no limit or room was short
};

struct CrossingsFound {
  std::uint32_t crossings = 0;  ///< in ExactScratch::crossings
  std::uint32_t next = 0;       ///< the pair of blocks to go on from: `count` at the end
  bool complete = true;         ///< no limit or room was short
  bool consistent = true;       ///< signs agree with each other
};

/// How the surfaces of two solids touch that have no volume in common.
struct SurfaceContact {
  bool touching = false;     ///< points of both are within CrossingSearch::touch of each other
  double area = 0;           ///< of the faces that lie on each other, back to back
  exact::Point normal = {};  ///< ∫ n dA over them, n out of A
  exact::Point moment = {};  ///< ∫ x dA over them
};

/// Finds the pairs of blocks.
BlockPairs find_block_pairs(const CrossingSearch& search, ExactScratch& scratch) noexcept;

/// Of `count` pairs of blocks (ExactScratch::keys) all triangles that cross, in the order of the
/// pairs, by exact signs where need be. The same crossings on every instruction set. It goes on
/// from crossing `first` and pair `next`, and stops where there is no room for more. Marks the
/// blocks (BlockMarks::near) whose signs might be others if points moved by `room`. `keep`, unless
/// null, gets the pairs of triangles that may cross before B has moved by its margin.
CrossingsFound find_crossings(const CrossingSearch& search, std::uint32_t first, std::uint32_t next,
                              std::uint32_t count, KeptPairs* keep, ExactScratch& scratch) noexcept;

/// The same crossings, of pairs of triangles that are kept.
CrossingsFound find_kept_crossings(const CrossingSearch& search, const KeptPairs& kept,
                                   ExactScratch& scratch) noexcept;

/// Of the pairs of blocks (ExactScratch::keys), or those of triangles that are kept, that are
/// marked as near: how they touch, B where it is.
SurfaceContact find_contact(const CrossingSearch& search, std::uint32_t count,
                            const KeptPairs* kept, ExactScratch& scratch) noexcept;

/// Whether one of the first `count` crossings is there wherever points move by the room.
bool any_settled(const CrossingSearch& search, std::uint32_t count, ExactScratch& scratch) noexcept;

/// The vertices of a block in A's unit frame, B's rounded once after the motion. They stay until
/// others are placed.
const PlacedVertices& place_block(const CrossingSearch& search, bool of_b, std::uint32_t number,
                                  ExactScratch& scratch) noexcept;

}  // namespace ist
