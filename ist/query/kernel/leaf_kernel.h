#pragma once

#include <cstddef>
#include <cstdint>

#include "query/kernel/node_kernel.h"
#include "query/kernel/placed_blocks.h"

namespace ist {

/// Sums of lenses are folded to half of the virtual lanes before they are added up.
inline constexpr std::size_t kSumLanes = 8;

/// Sums over lenses without factors of π, in A's axes, relative to B's unit-frame origin.
template <class Sum>
struct LensSums {
  Sum caps;       ///< 3/π · volume
  Sum force[3];   ///< −1/2π · dV/d(translation of B)
  Sum torque[3];  ///< likewise about B's unit-frame origin
  Sum moment[3];  ///< 3/π · ∫ x dV
  Sum error;      ///< 1/2π · bound on the error of V by rounded distances
};

/// Running sums over leaf pairs, in lanes for the same bits with every vector width.
struct alignas(64) LeafSums : LensSums<double[kSumLanes]> {
  LeafSums() noexcept : LensSums{} {}

  std::uint32_t lenses = 0;  ///< that are not empty
};

/// Bins of pairs: pair i is added to sums[node[i] >> shift] too.
struct LeafBinning {
  LeafSums* sums = nullptr;
  const std::uint32_t* node = nullptr;  ///< one per pair
  int shift = 0;
};

/// One stage of leaf pairs. At least one side of each pair is a leaf block (level 0); the other is
/// one too, or a single sphere (kSphereLevel).
struct LeafStage {
  const SphereTree* a;
  const SphereTree* b;
  int level_a;
  int level_b;
  const Similarity* a_from_b;
  Precision precision;
  LeafBinning bins = {};
};

/// Adds the lenses of every sphere of a[i] with every sphere of b[i]. The scratch caches blocks.
void add_leaf_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
                    const std::uint32_t* b, std::size_t n, LeafSums& sums) noexcept;

}  // namespace ist
