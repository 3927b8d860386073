// The points where edges of crossing triangles pierce each other. Included once per target.

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

/// The piercing edges of crossings, gathered until there are eight. Then all are written together,
/// without a branch on which edge of which triangle pierces.
class PiercingEdges {
 public:
  /// Adds the crossing of pair n. `pierced`: its piercing edges [A's, B's], two if signs agree with
  /// each other.
  HWY_INLINE void add(const TrianglePairs& pairs, const PairHeights& heights,
                      const std::uint32_t (&pierced)[2][3], std::uint32_t n) {
    // The piercing edges, and those at the crossing's end. An edge that goes down enters the other
    // solid: A's at the end, B's at the start.
    const std::uint32_t edges = bits_of(pierced[0], n) | bits_of(pierced[1], n) << 3,
                        ends = bits_of(heights.positive[0], n) |
                               (bits_of(heights.positive[1], n) ^ 7) << 3;
    const std::uint32_t of_end[2] = {edges & ~ends, edges & ends};
    for (int e = 0; e < 2; ++e) {
      const auto number = static_cast<std::uint32_t>(std::countr_zero(of_end[e] | 32u));
      const std::uint32_t s = number >= 3 ? 1 : 0, k = number - 3 * s, next = k == 2 ? 0 : k + 1;
      const auto put = [&](Number to, double value) { of_[e][to][count_] = value; };
      for (int x = 0; x < 3; ++x) {
        of_[e][kP + x][count_] = pairs.corner[s][k][x][n];
        of_[e][kQ + x][count_] = pairs.corner[s][next][x][n];
      }
      put(kHeightP, heights.value[s][k][n]);
      put(kHeightQ, heights.value[s][next][n]);
      put(kError, heights.error[s][k][n] + heights.error[s][next][n]);
      put(kShift, heights.shift[s][n]);
      put(kEdge, number);
    }
    for (int s = 0; s < 2; ++s) triangle_[s][count_] = pairs.triangle[s][n];
    ++count_;
  }
  bool full() const { return count_ == 8; }

  /// Writes what waits, as the last of `end` crossings.
  void write(std::uint32_t end, Crossings& out) {
    const std::uint32_t at = end - count_;
    for (std::uint32_t i = 0; i < count_; ++i)
      for (int s = 0; s < 2; ++s) out.triangle(s, at + i) = triangle_[s][i];
    for (int e = 0; e < 2; ++e)
      for (std::uint32_t l = 0; l < count_; l += static_cast<std::uint32_t>(hn::Lanes(D())))
        write_end(e, l, at + l, out);
    count_ = 0;
  }

 private:
  enum Number {
    kP = 0,  ///< an edge from p to q
    kQ = 3,
    kHeightP = 6,
    kHeightQ,
    kError,
    kShift,
    kEdge,  ///< A's 0 … 2, B's 3 … 5
    kNumbers
  };

  static std::uint32_t bits_of(const std::uint32_t (&pairs)[3], std::uint32_t n) {
    return (pairs[0] >> n & 1) | (pairs[1] >> n & 1) << 1 | (pairs[2] >> n & 1) << 2;
  }
  HWY_INLINE void write_end(int e, std::uint32_t l, std::uint32_t at, Crossings& out) const {
    const D d;
    const auto load = [&](int number) { return hn::Load(d, of_[e][number] + l); };
    const auto point = [&](int number) -> Vec3 {
      return {load(number), load(number + 1), load(number + 2)};
    };
    const EdgeEnd end = edge_end(point(kP), point(kQ), load(kHeightP), load(kHeightQ));
    const auto put = [&](int number, V value) { hn::StoreU(value, d, out.end(e, number) + at); };
    const auto put_point = [&](int number, const Vec3& x) {
      put(number, x.x), put(number + 1, x.y), put(number + 2, x.z);
    };
    put_point(Crossings::kFrom, end.from);
    put_point(Crossings::kOffset, end.offset);
    const V one = hn::Set(d, 1.0), two = hn::Set(d, 2.0);
    put(Crossings::kT, hn::IfThenElse(end.from_second, one - end.share, end.share));
    // The order of two points on an edge is that with B translated symbolically.
    put(Crossings::kTError,
        hn::IfThenElse(
            end.flat, one,
            (two * (load(kError) + two * load(kShift))) / end.heights + hn::Set(d, 1e-15)));
    put(Crossings::kHeightError, load(kError));
    put(Crossings::kEdge,
        hn::IfThenElse(end.from_second, load(kEdge), load(kEdge) + hn::Set(d, 8.0)));
  }

  alignas(64) double of_[2][kNumbers][8] = {};  // finite where none waits, computed too
  std::uint32_t triangle_[2][8];
  std::uint32_t count_ = 0;
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
