#pragma once

#include <vector>

#include "base/hashing.h"

namespace ist::packing {

/// A converged prototype that may become a sphere.
struct Candidate {
  Float3 centre;
  float radius = 0;
  std::uint64_t key = 0;  ///< radius bits, then a hash of the cell: larger keys come first
  Float3 cell_centre;
};

/// Order of candidates: by radius, then by a hash of the cell's centre and the seed.
IST_HD inline std::uint64_t candidate_key(float radius, Float3 cell_centre, std::uint64_t seed) {
  // Positive floats are ordered like their bits.
  return std::uint64_t{bits_of(radius)} << 32 | point_hash(cell_centre, seed);
}

/// A strict order of candidates of different cells: larger keys first, then centres.
IST_HD inline bool goes_before(const Candidate& a, const Candidate& b) {
  if (a.key != b.key) return a.key > b.key;
  if (a.cell_centre.x != b.cell_centre.x) return a.cell_centre.x > b.cell_centre.x;
  if (a.cell_centre.y != b.cell_centre.y) return a.cell_centre.y > b.cell_centre.y;
  return a.cell_centre.z > b.cell_centre.z;
}

IST_HD inline bool overlap(const Candidate& a, const Candidate& b) {
  const double x = double{a.centre.x} - double{b.centre.x};
  const double y = double{a.centre.y} - double{b.centre.y};
  const double z = double{a.centre.z} - double{b.centre.z};
  const double r = double{a.radius} + double{b.radius};
  return x * x + y * y + z * z < r * r;
}

/// A hash table of cubes that are as wide as two candidates can overlap: overlapping candidates are
/// in the same bucket or in the 26 around it. Other candidates in a bucket do no harm.
struct CandidateBuckets {
  float inverse_width = 1;
  std::uint32_t mask = 63;  ///< count − 1, count a power of two

  /// Bucket of the cube at (dx, dy, dz), each −1 … 1, from the one that contains p; |p| ≤ 2.
  IST_HD std::uint32_t bucket_of(Float3 p, int dx, int dy, int dz) const {
    const std::uint64_t cube = index(p.x, dx) | index(p.y, dy) << 21 | index(p.z, dz) << 42;
    return static_cast<std::uint32_t>(mixed(cube)) & mask;
  }

  IST_HD std::uint64_t index(float x, int d) const {
    return static_cast<std::uint64_t>(static_cast<int>((x + 4) * inverse_width) + d) & 0x1FFFFF;
  }
};

/// For `count` candidates of at most `largest` radius.
IST_HD inline CandidateBuckets candidate_buckets(float largest, std::uint64_t count) {
  CandidateBuckets buckets;
  const float width = 2.0001f * largest;
  buckets.inverse_width = 1 / (width > 1.0f / 512 ? width : 1.0f / 512);
  while (buckets.mask < 0x7FFFFFFFu && std::uint64_t{buckets.mask} + 1 < 2 * count)
    buckets.mask = 2 * buckets.mask + 1;
  return buckets;
}

/// A candidate that no preceding candidate overlaps.
struct Winner {
  std::uint32_t index = 0;  ///< among the candidates
  double gap = 0;           ///< to the preceding winners, see gap_to_sphere()
};

/// The candidates that no preceding candidate overlaps, in order.
std::vector<Winner> select_independent(const std::vector<Candidate>& candidates);

}  // namespace ist::packing
