#pragma once

#include <cstdint>

#include "base/elementary.h"
#include "query/exact/exact_sums.h"
#include "query/exact/overlap_formulas.h"

// Cuts triangles by the planes between the octants of a part, and joins octants that belong
// together, on the host and on a GPU.

namespace ist::octants {

/// A point relative to a part's centroid, along the axes of the octants.
struct Corner {
  double at[3];
  int octant;

  IST_HD exact::Point point() const noexcept { return {at[0], at[1], at[2]}; }
};

/// The point where an edge crosses a plane, taken on the side of `from`.
IST_HD inline Corner between(const Corner& from, const Corner& to, int plane) noexcept {
  const double t = from.at[plane] / (from.at[plane] - to.at[plane]);
  Corner out = {{0, 0, 0}, from.octant};
  for (int k = 0; k < 3; ++k) {
    if (k != plane) out.at[k] = from.at[k] + t * (to.at[k] - from.at[k]);
    // If both ends are on one side of a plane, so is the point: rounding must not change that.
    const int bit = 1 << k;
    if (k > plane && ((from.octant ^ to.octant) & bit) != 0)
      out.octant = (out.octant & ~bit) | (out.at[k] >= 0 ? bit : 0);
  }
  return out;
}

/// A triangle that a plane cuts into three pieces.
struct Cut {
  int bit, alone;  ///< the corner that is alone on its side
  const Corner &lone, &next, &other;
  Corner to_next[2], to_other[2];  ///< where the plane cuts, on the side of `lone` and beyond

  IST_HD Cut(const Corner& p, const Corner& q, const Corner& r, int plane) noexcept
      : bit(1 << plane),
        alone(((q.octant ^ r.octant) & bit) == 0   ? 0
              : ((p.octant ^ r.octant) & bit) == 0 ? 1
                                                   : 2),
        lone(alone == 0   ? p
             : alone == 1 ? q
                          : r),
        next(alone == 0   ? q
             : alone == 1 ? r
                          : p),
        other(alone == 0   ? r
              : alone == 1 ? p
                           : q) {
    to_next[0] = to_next[1] = between(lone, next, plane);
    to_other[0] = to_other[1] = between(lone, other, plane);
    to_next[1].octant ^= bit;
    to_other[1].octant ^= bit;
  }
  IST_HD const Corner& corner(int piece, int k) const noexcept {
    if (k == 0) return piece == 0 ? lone : to_next[1];
    if (k == 1) return piece == 0 ? to_next[0] : piece == 1 ? next : other;
    return piece == 0 ? to_other[0] : piece == 1 ? other : to_other[1];
  }
};
IST_HD inline bool are_alike(const Corner& p, const Corner& q, const Corner& r, int bits) noexcept {
  return (((p.octant ^ q.octant) | (p.octant ^ r.octant)) & bits) == 0;
}
IST_HD inline exact::OctantTerms terms_of(bool of_b, double times, const Corner& p, const Corner& q,
                                          const Corner& r) noexcept {
  return exact::octant_terms(0.5 * times, (of_b ? 0.5 : -0.5) / 3, p.point(), q.point(), r.point());
}

/// Finds a piece of the triangle by its number, which has a digit from 0 to 2 for each plane, the
/// first plane's in front. False if there is no such piece.
IST_HD_COLD bool find_piece(std::uint32_t number, Corner (&at)[3]) noexcept {
  std::uint32_t digits = number, unit = CutPieces::kMost / 3;
  for (int plane = 0; plane < 3; ++plane, digits %= unit, unit /= 3) {
    const auto piece = static_cast<int>(digits / unit);
    if (are_alike(at[0], at[1], at[2], 1 << plane)) {
      if (piece != 0) return false;  // the first is all of it
      continue;
    }
    const Cut cut(at[0], at[1], at[2], plane);
    const Corner kept[3] = {cut.corner(piece, 0), cut.corner(piece, 1), cut.corner(piece, 2)};
    for (int k = 0; k < 3; ++k) at[k] = kept[k];
  }
  return true;
}

/// An octant with a smaller share of the part's sums is left to the others.
inline constexpr double kRounding = 1e-9;

/// From 1 at `low` to 0 at twice that, or the reverse.
IST_HD inline double falls(double x, double low) { return 1 - smooth_step(x / low - 1); }
IST_HD inline double rises(double x, double low) { return smooth_step(x / low - 1); }

template <class T>
IST_HD void give(double share, T& out, T& in) {
  const T part = share * out;
  in = in + part;
  out = share == 1 ? part - part : out - part;
}

/// Moves a share of one octant's sums to another.
IST_HD inline void move(OctantSums& from, double share, OctantSums& to) {
  give(share, from.six_volumes, to.six_volumes);
  give(share, from.moment, to.moment);
  give(share, from.torque, to.torque);
  for (int s = 0; s < 2; ++s) give(share, from.area[s], to.area[s]);
}

/// A triangle's term n: its volume, moment, area, torque.
IST_HD inline double term(const exact::OctantTerms& terms, int n) {
  return n == 0  ? terms.six_volumes
         : n < 4 ? terms.moment[n - 1]
         : n < 7 ? terms.area[n - 4]
                 : terms.torque[n - 7];
}

/// Adds a triangle's term to number n of sums, unless that is an area of the other surface.
template <class TermOf>
IST_HD void add_number(OctantSums& sums, std::uint32_t n, bool of_b, const TermOf& term_of) {
  if (n >= 4 && n < 10 && (n >= 7) != of_b) return;
  sums.number(n) += term_of(n < 7 ? n : n - 3);
}
IST_HD inline void add(OctantSums& sums, bool of_b, const exact::OctantTerms& terms) {
  for (std::uint32_t n = 0; n < OctantSums::kNumbers; ++n)
    add_number(sums, n, of_b, [&](std::uint32_t k) { return term(terms, static_cast<int>(k)); });
}

IST_HD inline double both_areas(const OctantSums& sums) {
  return norm(sums.area[0]) + norm(sums.area[1]);
}

/// The degree to which two octants are one: if one is a sliver of the other, or if they are near
/// each other, like those above and below the middle of a contact that is thin and aslant.
IST_HD inline double oneness(const OctantSums& x, const OctantSums& y, double near) {
  const double less = exact::lesser(x.six_volumes, y.six_volumes),
               more = exact::greater(x.six_volumes, y.six_volumes);
  if (!(less > 0)) return 1;
  const double apart =
      norm((1 / (4 * x.six_volumes)) * x.moment - (1 / (4 * y.six_volumes)) * y.moment);
  return exact::greater(falls(less / more, 1.0 / 64), falls(apart, near));
}

/// A part that is no thicker than this along an axis, relative to `near`, is not cut across it.
inline constexpr double kThin = 1.0 / 8;

/// The degree to which a part is no longer than `length` along an axis.
IST_HD inline double shortness(const OctantSums& box, int axis, double length) {
  return falls(box.high[axis] - box.low[axis], length);
}
/// The same for all axes.
IST_HD inline double smallness(const OctantSums& box, double length) {
  return exact::lesser(exact::lesser(shortness(box, 0, length), shortness(box, 1, length)),
                       shortness(box, 2, length));
}

/// True if the box is longer than that along all axes.
IST_HD inline bool is_large(const OctantSums& box, double near) {
  return shortness(box, 0, near) == 0 && shortness(box, 1, near) == 0 &&
         shortness(box, 2, near) == 0;
}

/// The planes across which octants are not joined anyway, a bit for each axis.
IST_HD inline int planes_of(const OctantSums& box, double near) {
  int planes = 0;
  for (int k = 0; k < 3 && smallness(box, near) < 1; ++k)
    planes |= (shortness(box, k, kThin * near) < 1 ? 1 : 0) << k;
  return planes;
}

/// Joins octants. A contact that is not thin is one, since its two surfaces differ there. `small`:
/// the degree to which it is one because it is small or because few patches are wanted.
IST_HD inline void join(OctantSums* octants, double near, double small) {
  for (const bool by_axis : {true, false})
    for (int k = 0; k < 3; ++k) {
      const double thin = by_axis ? shortness(octants[0], k, kThin * near) : 0;
      for (int i = 0; i < 8; ++i) {
        if ((i >> k & 1) != 0) continue;
        OctantSums &to = octants[i], &from = octants[i | 1 << k];
        move(from, by_axis ? thin : oneness(to, from, near), to);
      }
    }
  double different = 0, areas = 0;
  for (int i = 0; i < 8; ++i) {
    different += norm(octants[i].area[0] + octants[i].area[1]);
    areas += both_areas(octants[i]);
  }
  const double apart = areas > 0 ? rises(different / areas, 0.2) : 0;
  const double share = areas > 0 ? (small < apart ? apart : small) : 1;
  for (int i = 1; i < 8; ++i) move(octants[i], share, octants[0]);
}

}  // namespace ist::octants
