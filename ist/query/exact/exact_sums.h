#pragma once

#include <ist/asset_layout.h>
#include <cstddef>
#include <cstdint>

#include "base/bits.h"
#include "query/base/pair_place.h"
#include "query/exact/orientation.h"

// The sums of an overlap, its connected parts and their octants, on the host and on a GPU.

namespace ist {

/// The sums of an overlap or a part of it, relative to the origin, A's unit frame.
struct ExactSums {
  exact::CarefulSum six_volumes;
  exact::Point moment = {};  ///< 24 ∫ x
  exact::Point force = {};  ///< ∫ n dA over B's surface in A: the volume's gradient by translation
  exact::Point torque = {};  ///< ∫ x × n dA, likewise

  IST_HD double volume() const noexcept { return six_volumes.value() / 6; }

  IST_HD void add(const ExactSums& other) noexcept {
    six_volumes.add(other.six_volumes.value());
    moment = moment + other.moment;
    force = force + other.force;
    torque = torque + other.torque;
  }
};

/// A connected part of an overlap, or an octant of one.
struct ExactPart {
  ExactSums sums;          ///< from the whole's origin
  std::uint64_t id = 0;    ///< lowest pair of triangles on its outline, from 1; 0: it has none
  std::uint32_t kept = 0;  ///< the part that it was added to, or itself
  std::uint32_t slot = kNoIndex;  ///< of its octants; kNoIndex if it is not divided
  exact::Point centre = {};       ///< centroid from the whole's origin, if computed
  // For keep_largest():
  double cost = 0;            ///< of adding it to another
  std::uint32_t nearest = 0;  ///< that other
  std::uint32_t listed = 0;   ///< in part k: the k-th part that is kept
  bool unlike = false;        ///< the other pushes against it
};

/// The sums of an octant of a part, relative to the part's centroid and along the axes of the
/// octants.
struct OctantSums {
  double six_volumes = 0;
  exact::Point moment = {};   ///< 24 ∫ x
  exact::Point area[2] = {};  ///< ∫ n dA over A's and over B's surface
  exact::Point torque = {};   ///< ½ ∫ x × n dA over B's surface less that over A's
  static constexpr std::uint32_t kNumbers = 13;  ///< the volume, moment, areas of A and B, torque
  IST_HD double& number(std::uint32_t k) noexcept { return (&six_volumes)[k]; }
  // In the first octant of a part:
  exact::Point centre = {};          ///< the part's centroid from the whole's origin, A's axes
  exact::Point low = {}, high = {};  ///< its box in the axes, from the centre
  int planes = 0;                    ///< a bit an axis: the part is cut across it
};

/// An end of the common segment of two triangles: an edge of one pierces the other.
struct CrossingEnd {
  std::uint32_t triangle;  ///< whose edge it is
  std::uint32_t edge;      ///< edge k goes from corner k to the next
  bool of_b, from_first, enters;
};

/// A point where an edge is pierced.
struct PiercedEnd {
  std::uint64_t edge;
  double t;
  std::uint32_t crossing, other;
  bool of_b;
};

/// A curve where surfaces cross, if it is in one triangle of a solid.
struct CurveExtent {
  std::uint32_t triangle;  ///< kNoIndex: of several
  exact::Point low, high;  ///< its box
  exact::Point area;       ///< twice the vector area that it encloses
};

struct PartMemory {
  static constexpr std::uint32_t kMostParts = 1024;
  static constexpr std::uint32_t kMostSplit = 64;  ///< parts that are divided into octants

  PiercedEnd* ends;                  ///< two a crossing
  CurveExtent* curves;               ///< one a crossing
  std::uint64_t *keys, *other_keys;  ///< a table; two a crossing
  std::uint32_t *parent, *part;      ///< of an element
  std::uint32_t* middles;            ///< of an edge of a crossed block
  ExactPart *parts, *octants;
  OctantSums* octant_sums;
  std::uint32_t most_parts;
};

/// The terms that eight pieces of the boundary add to the sums of an overlap, one per lane.
struct alignas(64) ExactTerms {
  /// The tetrahedra of a segment, and of an edge at each of its ends. Summing them here would lose
  /// digits where all are large and the overlap is small.
  double six_volumes[3][8];
  double moment[3][8], force[3][8], torque[3][8];
  double rounding[8];  ///< six times the error bound of the volume
};

/// The terms that eight crossings add to octants, one per lane: triangles of A and of B between the
/// segment and the apex, and those between the apex and a pierced edge opposite to it, at each end.
struct alignas(64) OctantPieces {
  static constexpr int kTriangles = 4, kEnd = 2, kNear = 4, kTerms = 10;
  /// Relative to the centre, along the octants' axes: the apexes of A and B, from kEnd on the ends,
  /// and from kNear on the nearer ends of their edges.
  double at[6][3][8];
  double times[4][8];                   ///< how often a triangle counts
  double term[4][kTerms][8];            ///< numbers of exact::OctantTerms
  double sum[OctantSums::kNumbers][8];  ///< all four in one octant
  std::uint8_t octant[6][8];  ///< a bit an axis: the corner's coordinate is not less than 0
  std::uint8_t of_b[4][8];    ///< the triangle is of B's surface

  IST_HD int corner(int triangle, int k, std::uint32_t lane) const noexcept {
    if (k == 0) return of_b[triangle][lane];
    return triangle < 2 ? kEnd + (k == 1 ? triangle : 1 - triangle)
                        : (k == 1 ? kEnd : kNear) + triangle - 2;
  }
};

/// The frame of octants: the axes, and for each lane the centre of its part relative to the origin
/// of the sums.
struct alignas(64) OctantView {
  double centre[3][8];
  exact::Point origin, axis[3];
  std::uint32_t slot[8];  ///< of the octants of a lane's part; kNoIndex if it is not divided
  int planes[8];          ///< of a lane's part
};

/// The pieces into which up to three planes cut a triangle.
struct CutPieces {
  static constexpr std::uint32_t kMost = 27;
  double term[kMost][OctantPieces::kTerms];
  std::uint8_t octant[kMost];
};

/// The working memory for pieces of the boundary.
struct PieceMemory {
  union {
    ExactTerms terms;
    ExactTerms more_terms[4];  ///< of 32 pieces
    OctantPieces octants;
  };
  OctantView view;
  CutPieces cut;
  std::int8_t whole[kWidth];  ///< how often the cone over a triangle's edge counts
  bool says;                  ///< a flag from the leading lane to the others
  std::uint32_t taken;        ///< entries of PartMemory::ends used by lists of edges
  std::uint32_t part[8];      ///< of a lane's piece; kNoIndex if the piece does not count
  std::uint32_t block[8];     ///< a lane's block that is inside as a whole
};

static_assert(offsetof(OctantSums, torque.z) == 8 * (OctantSums::kNumbers - 1));
static_assert(offsetof(ExactSums, torque.z) == offsetof(ExactSums, moment.x) + 8 * 8);

/// Sums of terms in eight slots: a term's slot is its place in the order of its kind. On the host
/// and on a GPU.
class SlotSums {
 public:
  IST_HD void add_triangles(const ExactTerms& terms) noexcept {
    add_volumes(terms.six_volumes[0]);
    for (int k = 0; k < 3; ++k) add_to(moment_[k], terms.moment[k]);
    add_to(rounding_, terms.rounding);
  }

  IST_HD void add_crossings(const ExactTerms& terms) noexcept {
    add_triangles(terms);
    add_volumes(terms.six_volumes[1]);
    add_volumes(terms.six_volumes[2]);
    for (int k = 0; k < 3; ++k) {
      add_to(force_[k], terms.force[k]);
      add_to(torque_[k], terms.torque[k]);
    }
  }

  // The same for lane l alone.
  IST_HD void add_triangle(const ExactTerms& terms, std::uint32_t l) noexcept {
    add_volume(terms.six_volumes[0], l);
    for (int k = 0; k < 3; ++k) moment_[k][l] += terms.moment[k][l];
    rounding_[l] += terms.rounding[l];
  }
  IST_HD void add_crossing(const ExactTerms& terms, std::uint32_t l) noexcept {
    add_triangle(terms, l);
    add_volume(terms.six_volumes[1], l);
    add_volume(terms.six_volumes[2], l);
    for (int k = 0; k < 3; ++k) {
      force_[k][l] += terms.force[k][l];
      torque_[k][l] += terms.torque[k][l];
    }
  }

  IST_HD ExactSums total() const noexcept {
    ExactSums out;
    for (int l = 0; l < 8; ++l) {
      out.six_volumes.add(high_[l]);
      out.six_volumes.add(low_[l]);
      out.moment = out.moment + exact::Point{moment_[0][l], moment_[1][l], moment_[2][l]};
      out.force = out.force + exact::Point{force_[0][l], force_[1][l], force_[2][l]};
      out.torque = out.torque + exact::Point{torque_[0][l], torque_[1][l], torque_[2][l]};
    }
    return out;
  }

  IST_HD double rounding() const noexcept {
    double sum = 0;
    for (const double r : rounding_) sum += r;
    return sum;
  }

 private:
  IST_HD static void add_to(double (&sums)[8], const double (&from)[8]) {
    for (int l = 0; l < 8; ++l) sums[l] += from[l];
  }
  IST_HD void add_volume(const double (&six_volumes)[8], std::uint32_t l) noexcept {
    double rest;
    exact::two_sum(high_[l], six_volumes[l], high_[l], rest);
    low_[l] += rest;
  }
  IST_HD void add_volumes(const double (&six_volumes)[8]) noexcept {
    for (std::uint32_t l = 0; l < 8; ++l) add_volume(six_volumes, l);
  }

  double high_[8] = {}, low_[8] = {};
  double moment_[3][8] = {}, force_[3][8] = {}, torque_[3][8] = {}, rounding_[8] = {};
};

/// Sums of an overlap or a part of it in world units, on the host and on a GPU.
struct ExactInWorld {
  double volume;
  Vec3 centroid;       ///< zero if there is no volume
  Vec3 force, torque;  ///< the volume's gradients by a motion of B, about B's origin

  /// Converts sums in A's unit frame about `origin`. `moment`: 24 ∫ x.
  IST_HD ExactInWorld(double found, const Vec3& moment, const Vec3& push, const Vec3& turn,
                      const Vec3& origin, const PairPlace& place) {
    const double u = place.unit_a, unit3 = u * u * u;
    volume = found * unit3;
    force = (u * u) * turned(place.rotation_a, push);
    centroid = {0, 0, 0};
    if (found != 0) centroid = place.to_world(origin + moment / (24 * found));
    // The sums' origin relative to B's.
    const Vec3 arm =
        turned(place.rotation_a, u * (origin - vec3(place.a_from_b.t))) + place.offset_b;
    torque = unit3 * turned(place.rotation_a, turn) + cross(arm, force);
  }
};

}  // namespace ist
