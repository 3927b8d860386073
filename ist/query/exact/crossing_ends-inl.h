// Where the edges of triangles that cross go through each other: included once a target.

#if defined(IST_QUERY_CROSSING_ENDS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_CROSSING_ENDS_INL_H_
#undef IST_QUERY_CROSSING_ENDS_INL_H_
#else
#define IST_QUERY_CROSSING_ENDS_INL_H_
#endif

#include <bit>

#include "query/exact/pair_signs-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// An edge of a lane each, from p to q, that goes through the other triangle.
struct PiercingEdges {
  Vec3 p, q;
  V height_p, height_q, error, shift;
  V number;  ///< A's 0 … 2, B's 3 … 5

  /// Another edge in some lanes.
  HWY_INLINE void take(hn::Mask<D> lanes, const PiercingEdges& from) {
    const auto put = [&](V& to, V value) { to = hn::IfThenElse(lanes, value, to); };
    for (Vec3 PiercingEdges::*of : {&PiercingEdges::p, &PiercingEdges::q}) {
      put((this->*of).x, (from.*of).x);
      put((this->*of).y, (from.*of).y);
      put((this->*of).z, (from.*of).z);
    }
    for (V PiercingEdges::*of :
         {&PiercingEdges::height_p, &PiercingEdges::height_q, &PiercingEdges::error,
          &PiercingEdges::shift, &PiercingEdges::number})
      put(this->*of, from.*of);
  }
};

/// End `e` of crossings `at` …, of some lanes.
HWY_INLINE void write_ends(const PiercingEdges& from, const Compressor<D>& chosen, int e,
                           std::uint32_t at, Crossings& out) {
  const D d;
  const EdgeEnd end = edge_end(from.p, from.q, from.height_p, from.height_q);
  const auto put = [&](int number, V value) {
    hn::StoreU(chosen(value), d, out.end(e, number) + at);
  };
  const auto put_point = [&](int number, const Vec3& x) {
    put(number, x.x), put(number + 1, x.y), put(number + 2, x.z);
  };
  put_point(Crossings::kFrom, end.from);
  put_point(Crossings::kOffset, end.offset);
  const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
  put(Crossings::kT, hn::IfThenElse(end.from_second, one - end.share, end.share));
  // Which of two places comes first is asked with B moved aside.
  put(Crossings::kTError,
      hn::IfThenElse(end.flat, one,
                     (two * (from.error + two * from.shift)) / end.heights + hn::Set(d, 1e-15)));
  put(Crossings::kHeightError, from.error);
  put(Crossings::kEdge,
      hn::IfThenElse(end.from_second, from.number, from.number + hn::Set(d, 8.0)));
}

/// Writes crossings `at` …: of pairs that are `crossing`, a bit each, whose edges [A's, B's] are
/// `pierced`.
inline void write_crossings(const TrianglePairs& pairs, const PairHeights& heights,
                            const std::uint32_t (&pierced)[2][3], std::uint32_t crossing,
                            std::uint32_t at, Crossings& out) {
  for (std::uint32_t left = crossing, i = at; left != 0; left &= left - 1, ++i)
    for (int s = 0; s < 2; ++s) out.triangle(s, i) = pairs.triangle[s][std::countr_zero(left)];
  const D d;
  const std::uint32_t lanes = (1u << hn::Lanes(d)) - 1;
  for (std::size_t l = 0; l < 8; l += hn::Lanes(d)) {
    const std::uint32_t here = crossing >> l & lanes;
    if (here == 0) continue;
    const V zero = hn::Zero(d);
    const PiercingEdges none = {
        {zero, zero, zero}, {zero, zero, zero}, zero, zero, zero, zero, zero};
    PiercingEdges end[2] = {none, none};
    for (int s = 0; s < 2; ++s)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t through = pierced[s][k] >> l & here;
        if (through == 0) continue;
        const int next = (k + 1) % 3;
        const PiercingEdges edge = {
            corner_of(pairs, s, k, l),
            corner_of(pairs, s, next, l),
            hn::Load(d, heights.value[s][k] + l),
            hn::Load(d, heights.value[s][next] + l),
            hn::Load(d, heights.error[s][k] + l) + hn::Load(d, heights.error[s][next] + l),
            hn::Load(d, heights.shift[s] + l),
            hn::Set(d, 3.0 * s + k)};
        // An edge that goes down enters the other solid: A's at the end, B's at the start.
        const std::uint32_t down = heights.positive[s][k] >> l, ends = s == 0 ? down : ~down;
        end[0].take(mask_of_bits(d, through & ~ends), edge);
        end[1].take(mask_of_bits(d, through & ends), edge);
      }
    const Compressor<D> chosen(d, mask_of_bits(d, here));
    for (int e = 0; e < 2; ++e) write_ends(end[e], chosen, e, at, out);
    at += static_cast<std::uint32_t>(chosen.count());
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
