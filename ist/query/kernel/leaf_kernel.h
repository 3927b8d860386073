#pragma once

#include <cstddef>
#include <cstdint>

#include "query/kernel/node_kernel.h"
#include "query/kernel/placed_blocks.h"

namespace ist {

/// Half of the virtual lanes: what the sums of a list of lenses are folded to before they are added
/// up.
inline constexpr std::size_t kSumLanes = 8;

/// Sums over lenses, in A's unit frame, positions relative to B's unit-frame origin. Factors of π
/// are applied at the end.
template <class Sum>
struct LensSums {
  Sum caps;       ///< 3/π · volume
  Sum force[3];   ///< −1/2π · dV/d(translation of B)
  Sum torque[3];  ///< likewise about B's unit-frame origin
  Sum moment[3];  ///< 3/π · ∫ x dV
  Sum error;      ///< 1/2π · bound on what rounded distances change in V
};

/// Running sums over leaf pairs. Lanes keep the order of additions the same for every vector width,
/// and thus the bits.
struct alignas(64) LeafSums : LensSums<double[kSumLanes]> {
  LeafSums() noexcept : LensSums{} {}

  std::uint32_t lenses = 0;  ///< that are not empty
};

/// Where the sums of single pairs go besides the whole's: pair i to sums[node[i] >> shift].
struct LeafBinning {
  LeafSums* sums = nullptr;
  const std::uint32_t* node = nullptr;  ///< one a pair
  int shift = 0;
};

/// One stage of leaf pairs: of each pair one side at least is a leaf block (level 0), the other one
/// too or a single sphere (kSphereLevel).
struct LeafStage {
  const SphereTree* a;
  const SphereTree* b;
  int level_a;
  int level_b;
  const Similarity* a_from_b;
  Precision precision;
  LeafBinning bins = {};
};

/// Adds the lenses of every sphere of a[i] with every sphere of b[i]. The scratch keeps blocks from
/// call to call.
void add_leaf_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
                    const std::uint32_t* b, std::size_t n, LeafSums& sums) noexcept;

}  // namespace ist
