#pragma once

#include <cstdint>
#include <span>

#include "query/exact/exact_parts.h"
#include "query/exact/overlap_terms.h"

namespace ist {

/// Connected parts of an overlap, divided into the octants around their centroids.
///
/// Every piece of both surfaces is cut by three planes through the centroid, which add nothing to
/// cones from there: volumes are exact. Pieces change over where they have no area, so the sums are
/// continuous in the pose. An octant's gradient is half of what each of the two surfaces has in it.
/// They agree where a contact is thin. Octants join where they do not. Where a part is thin along
/// an axis, its octants on both sides of the middle are one, and it is not cut there.
class ExactOctants : public ExactParts {
 public:
  using ExactParts::ExactParts;

  /// Divides parts of divide() that are kept, in the frame of A or B: all those for which there is
  /// room if each patch is to have its share of the volume. Returns how many octants are in
  /// ExactScratch::octants: their names are 8 times the part's, and the octant's number. `near`:
  /// octants that are not further apart are one.
  std::uint32_t split(std::span<ExactPart> parts, bool by_b, double near,
                      std::size_t room) noexcept;

 private:
  /// A point seen from a part's centroid, in the axes of the octants.
  struct Corner {
    double at[3];
    int octant;

    exact::Point point() const noexcept { return {at[0], at[1], at[2]}; }
  };

  bool find_planes(std::span<ExactPart> parts, double near) noexcept;
  void sum_octants() noexcept;
  static void add_pieces(const OctantPieces& pieces, std::uint32_t lane,
                         OctantSums* octants) noexcept;
  void sum_block(const Side& side, std::uint32_t block, OctantSums* octants) noexcept;
  std::uint32_t write_octants(const ExactPart& part, double small, double near,
                              std::uint32_t first) noexcept;
  OctantSums* octants_of(std::uint32_t element) noexcept;
  exact::Point in_axes(const exact::Point& x) const noexcept;
  Corner corner(const OctantSums* octants, const exact::Point& x) const noexcept;
  static Corner between(const Corner& from, const Corner& to, int plane) noexcept;
  static void add_triangle(OctantSums* octants, bool of_b, double times, const Corner& p,
                           const Corner& q, const Corner& r) noexcept;

  exact::Point axis_[3];
};

}  // namespace ist
