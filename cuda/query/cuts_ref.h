#pragma once

#include <cstdint>

namespace ist::gpu {

/// A region of a tree, which TreeCuts (query/contact/tree_cuts.h) divides into the next node and
/// the rest.
struct CutNode {
  std::uint64_t id;          ///< of its patch
  std::uint32_t begin, end;  ///< bins, by rank
  std::uint32_t rest;        ///< node of the other side; 0: one bin, which is not divided
};

/// All regions of a tree, the root first.
struct CutsRef {
  const CutNode* node;
  const std::uint16_t* rank;  ///< of a bin; those of a region are consecutive
  std::uint32_t bins;
  int shift;  ///< a sphere's number >> shift is its bin
};

}  // namespace ist::gpu
