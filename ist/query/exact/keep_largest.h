#pragma once

#include <cstdint>

#include "query/exact/exact_sums.h"

// Selects the parts of a contact that become patches, on the host and on a GPU.

namespace ist {

/// Finds the nearest kept part to which p may be joined, preferably one that pushes like p, and the
/// cost.
IST_HD inline void weigh_part(ExactPart* parts, std::uint32_t count, std::uint32_t p) {
  ExactPart& part = parts[p];
  double square = 0;
  part.unlike = false;
  part.nearest = p;
  for (std::uint32_t k = 0; k < count; ++k) {
    const std::uint32_t q = parts[k].listed;
    if (q == p) continue;
    const exact::Point between = parts[q].centre - part.centre;
    const bool against = dot(parts[q].sums.force, part.sums.force) < 0;
    const double apart = dot(between, between);
    if (part.nearest != p && (against != part.unlike ? against : !(apart < square))) continue;
    part.nearest = q;
    part.unlike = against;
    square = apart;
  }
  part.cost = part.sums.volume() * (square * square);
}

/// Keeps at most `wanted` parts. The least part is merged into the nearest of those that push like
/// it, or of all if there are none. It is the least by volume or, for octants, by volume times the
/// fourth power of the distance to its partner: small parts near a large one are merged first.
IST_HD inline std::uint32_t keep_largest(ExactPart* parts, std::uint32_t size, std::uint32_t wanted,
                                         bool octants) {
  std::uint32_t count = 0;
  for (std::uint32_t p = 0; p < size; ++p)
    if (parts[p].kept == p) parts[count++].listed = p;
  if (count <= wanted) return count;
  for (std::uint32_t p = 0; p < size; ++p)
    parts[p].centre = (1 / (24 * parts[p].sums.volume())) * parts[p].sums.moment;
  for (std::uint32_t k = 0; k < count; ++k) {
    ExactPart& part = parts[parts[k].listed];
    part.nearest = parts[k].listed;
    part.unlike = false;
    part.cost = part.sums.volume();
    if (octants) weigh_part(parts, count, parts[k].listed);
  }
  while (count > wanted) {
    std::uint32_t least = 0;
    for (std::uint32_t k = 1; k < count; ++k) {
      const ExactPart &x = parts[parts[k].listed], &y = parts[parts[least].listed];
      if (x.unlike != y.unlike ? y.unlike : x.cost < y.cost) least = k;
    }
    const std::uint32_t joins = parts[least].listed;
    for (std::uint32_t k = least + 1; k < count; ++k) parts[k - 1].listed = parts[k].listed;
    --count;
    weigh_part(parts, count, joins);
    parts[joins].kept = parts[joins].nearest;
    for (std::uint32_t k = 0; k < count; ++k)
      if (parts[parts[k].listed].nearest == joins) weigh_part(parts, count, parts[k].listed);
  }
  for (std::uint32_t p = 0; p < size; ++p)
    while (parts[parts[p].kept].kept != parts[p].kept) parts[p].kept = parts[parts[p].kept].kept;
  return count;
}

/// Adds the parts that were joined to the kept ones.
IST_HD inline void join_parts(ExactPart* parts, std::uint32_t size) {
  for (std::uint32_t p = 0; p < size; ++p)
    if (parts[p].kept != p) parts[parts[p].kept].sums.add(parts[p].sums);
}

/// [u] An upper bound of the depth of patches of a contact of that volume [u³].
IST_HD inline double exact_deepest(double volume) noexcept {
  // The cube root by square roots alone, since the C library's differs between processors. Each
  // step leaves a quarter of the error of the logarithm.
  double y = std::sqrt(volume);
  for (int k = 0; k < 30; ++k) y = std::sqrt(std::sqrt(volume * y));
  return y;
}

/// Octants of a contact that are closer than this, relative to a solid's radius, are merged.
inline constexpr double kNearOctants = 0.15;

}  // namespace ist
