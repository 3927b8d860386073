#pragma once

#include <ist/types.h>

#include "mesh/geometry/triangle_frame.h"
#include "packing/grids/grid_layout.h"

namespace ist::packing {

/// A primitive of the surface ∪ spheres: a sphere's index, or kTriangleTag | a triangle's index.
/// Among primitives at the same distance the smallest tag counts as the nearest.
constexpr std::uint32_t kTriangleTag = 0x80000000u;
constexpr std::uint32_t kNoTag = 0xFFFFFFFFu;

/// The record of an *active* cell of the distance grid: the primitives that overlap it.
struct CellRecord {
  std::uint32_t cell = 0;  ///< its id in the layout
  std::uint32_t triangles = 0, triangle_count = 0;
  std::uint32_t spheres = 0, sphere_count = 0;
  std::int32_t winding = 0;  ///< with triangles: of the next cell without any towards −x
};

/// A triangle for the float distance formula, made in double and rounded once.
struct alignas(64) GridTriangle {
  TriangleFrame<float> frame;
};

IST_HD inline GridTriangle make_grid_triangle(const double* a, const double* b, const double* c) {
  const TriangleFrame<double> exact = make_triangle_frame(a, b, c);
  GridTriangle t;
  for (int k = 0; k < 3; ++k) {
    t.frame.origin[k] = static_cast<float>(exact.origin[k]);
    t.frame.u[k] = static_cast<float>(exact.u[k]);
    t.frame.v[k] = static_cast<float>(exact.v[k]);
    t.frame.n[k] = static_cast<float>(exact.n[k]);
  }
  t.frame.length = static_cast<float>(exact.length);
  t.frame.apex = static_cast<float>(exact.apex);
  t.frame.height = static_cast<float>(exact.height);
  return t;
}

/// The paper's adaptive storage (§4.3), to be read by anyone: words for all cells of the grid lead
/// to the records of the active ones, those that are neither outside nor covered by one sphere. A
/// word contains the place of the record and the *discrete distance* (§3): how many cells away, in
/// Manhattan distance, the closest cell with a primitive is, or less; 255 where it is more. Once
/// few cells are active, the words stand in a hash table.
struct DistanceGrid {
  static constexpr std::uint32_t kInactive = 0xFFFFFFFFu;
  static constexpr std::uint32_t kSlotMask = 0x00FFFFFFu;
  static constexpr std::uint32_t kMostActive = kSlotMask - 1;
  static constexpr std::uint32_t kEmptyKey = 0xFFFFFFFFu;

  GridLayout layout;
  const std::uint32_t* words = nullptr;  ///< by cell; or, hashed, by place in `keys`
  const std::uint32_t* keys = nullptr;   ///< nullptr: not hashed
  std::uint32_t key_mask = 0;
  const CellRecord* records = nullptr;
  const std::uint32_t* triangle_lists = nullptr;
  const std::uint32_t* sphere_lists = nullptr;

  IST_HD static std::uint32_t slot(std::uint32_t word) { return word & kSlotMask; }
  IST_HD static int distance(std::uint32_t word) { return static_cast<int>(word >> 24); }

  IST_HD static std::uint32_t hashed(std::uint32_t cell) {
    cell ^= cell >> 16;
    cell *= 0x85EBCA6Bu;
    cell ^= cell >> 13;
    return cell;
  }

  IST_HD std::uint32_t word(std::uint32_t cell) const {
    if (keys == nullptr) return words[cell];
    for (std::uint32_t at = hashed(cell) & key_mask;; at = (at + 1) & key_mask) {
      if (keys[at] == cell) return words[at];
      if (keys[at] == kEmptyKey) return kInactive;
    }
  }
  IST_HD std::uint32_t word(int i, int j, int k) const { return word(layout.id(i, j, k)); }
};

/// Everything that the numerics of a round read. Plain pointers: host or device.
struct GridScene {
  DistanceGrid grid;
  const GridTriangle* triangles = nullptr;
  const std::uint32_t* corners = nullptr;  ///< three vertices a triangle
  const double* vertices = nullptr;        ///< exact, unit frame, three coordinates each
  const Sphere* spheres = nullptr;
};

}  // namespace ist::packing
