#pragma once

#include <cstdint>
#include <vector>

#include "packing/float3.h"

namespace ist::packing {

/// A converged prototype that wants to become a sphere.
struct Candidate {
  Float3 centre;
  float radius = 0;
  std::uint64_t key = 0;  ///< radius bits, then a hash of the cell: larger goes first
};

/// Order of candidates: by radius, ties by a hash of the cell's centre bits and the seed, which no
/// order of work can change.
std::uint64_t candidate_key(float radius, Float3 cell_centre, std::uint64_t seed);

/// Indices of the candidates that no candidate with a larger key overlaps, largest key first.
std::vector<std::uint32_t> select_independent(const std::vector<Candidate>& candidates);

}  // namespace ist::packing
