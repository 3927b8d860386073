// Distances of triangles: included once a target.

#if defined(IST_QUERY_TRIANGLE_GAPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_TRIANGLE_GAPS_INL_H_
#undef IST_QUERY_TRIANGLE_GAPS_INL_H_
#else
#define IST_QUERY_TRIANGLE_GAPS_INL_H_
#endif

#include "query/exact/box_gaps-inl.h"
#include "query/exact/exact_scratch.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Which triangles of two blocks are within a limit, or may be: in floats, which are off by `blur`.
class TriangleCulls {
 public:
  TriangleCulls(const PlacedTriangles& a, const PlacedTriangles& b, const WayAxes& axes, float blur)
      : a_(a), b_(b), blur_(blur) {
    for (std::size_t k = 0; k < 3; ++k) {
      of_a_[k] = along(axes.way[k], a);
      of_b_[k] = along(axes.way[k], b);
      low_b_[k] = lowest(of_b_[k].low) - blur;
      high_b_[k] = highest(of_b_[k].high) + blur;
    }
  }

  /// Of A's triangles those that may be within of one of B's.
  std::uint32_t rows(double limit) const {
    float least = 0;
    return near(of_a_, low_b_, high_b_, limit, 0, kWidth, least);
  }

  /// Of B's triangles those that may be within of A's triangle i: by their extents along three
  /// axes, then by the planes of both. `least`, squared: no triangle is nearer by the axes.
  std::uint32_t lanes(std::uint32_t i, double limit, float& least) const {
    const F d;
    const float far = rounded_up(limit) + blur_, size = a_.size + b_.size + far;
    // Heights are off by what the normal is, and coordinates are.
    const auto over_a = hn::Set(d, far * length(i) + a_.slack[i] * size);
    float low[3], high[3];
    for (int k = 0; k < 3; ++k)
      low[k] = of_a_[k].low[i] - blur_, high[k] = of_a_[k].high[i] + blur_;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const std::uint32_t near_here = near(of_b_, low, high, limit, l, l + hn::Lanes(d), least);
      if (near_here == 0) continue;
      const hn::Vec<F> n[3] = {hn::Load(d, b_.normal[0] + l), hn::Load(d, b_.normal[1] + l),
                               hn::Load(d, b_.normal[2] + l)};
      hn::Vec<F> of_a[3], of_b[3];
      for (int c = 0; c < 3; ++c) {
        of_a[c] = ((hn::Set(d, a_.normal[0][i]) * hn::Load(d, b_.corner[c][0] + l) +
                    hn::Set(d, a_.normal[1][i]) * hn::Load(d, b_.corner[c][1] + l)) +
                   hn::Set(d, a_.normal[2][i]) * hn::Load(d, b_.corner[c][2] + l)) -
                  hn::Set(d, a_.offset[i]);
        of_b[c] = ((n[0] * hn::Set(d, a_.corner[c][0][i]) + n[1] * hn::Set(d, a_.corner[c][1][i])) +
                   n[2] * hn::Set(d, a_.corner[c][2][i])) -
                  hn::Load(d, b_.offset + l);
      }
      const auto length_b = hn::Sqrt((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
      const auto over_b =
          hn::Set(d, far * kLonger) * length_b + hn::Load(d, b_.slack + l) * hn::Set(d, size);
      bits |= near_here & mask_bits(d, hn::And(reaches(of_a, over_a), reaches(of_b, over_b))) << l;
    }
    return bits;
  }

 private:
  static constexpr float kLonger = 1 + 2e-6f;  ///< than a length in floats
  /// Whether three heights are not all beyond.
  static hn::Mask<F> reaches(const hn::Vec<F> (&height)[3], hn::Vec<F> over) {
    return hn::And(hn::Min(height[0], hn::Min(height[1], height[2])) <= over,
                   hn::Max(height[0], hn::Max(height[1], height[2])) >= hn::Neg(over));
  }
  struct alignas(64) Extents {
    float low[kWidth], high[kWidth];
  };
  static Extents along(const exact::Point& axis, const PlacedTriangles& t) {
    const F d;
    const auto x = hn::Set(d, static_cast<float>(axis.x)),
               y = hn::Set(d, static_cast<float>(axis.y)),
               z = hn::Set(d, static_cast<float>(axis.z));
    Extents out;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      hn::Vec<F> at[3];
      for (int c = 0; c < 3; ++c)
        at[c] = (x * hn::Load(d, t.corner[c][0] + l) + y * hn::Load(d, t.corner[c][1] + l)) +
                z * hn::Load(d, t.corner[c][2] + l);
      hn::Store(hn::Min(at[0], hn::Min(at[1], at[2])), d, out.low + l);
      hn::Store(hn::Max(at[0], hn::Max(at[1], at[2])), d, out.high + l);
    }
    return out;
  }
  /// Of lanes [from, to) those that may be within of one box.
  static std::uint32_t near(const Extents (&of)[3], const float (&low)[3], const float (&high)[3],
                            double limit, std::size_t from, std::size_t to, float& least) {
    const F d;
    const auto most = hn::Set(d, rounded_up(limit)), zero = hn::Zero(d);
    std::uint32_t bits = 0;
    for (std::size_t l = from; l < to; l += hn::Lanes(d)) {
      hn::Vec<F> squared = zero;
      for (int k = 0; k < 3; ++k) {
        const auto gap = hn::Max(hn::Max(zero, hn::Load(d, of[k].low + l) - hn::Set(d, high[k])),
                                 hn::Set(d, low[k]) - hn::Load(d, of[k].high + l));
        squared = squared + gap * gap;
      }
      bits |= mask_bits(d, squared <= most * most) << l;
      least = std::min(least, hn::GetLane(hn::MinOfLanes(d, squared)));
    }
    return bits;
  }
  static float rounded_up(double limit) {
    return static_cast<float>(std::min(limit, 1e15) * (1 + 2e-6));
  }
  /// Of A's normal, or more.
  float length(std::uint32_t i) const {
    const float x = a_.normal[0][i], y = a_.normal[1][i], z = a_.normal[2][i];
    return std::sqrt((x * x + y * y) + z * z) * kLonger;
  }

  const PlacedTriangles& a_;
  const PlacedTriangles& b_;
  const float blur_;
  Extents of_a_[3], of_b_[3];
  float low_b_[3], high_b_[3];  ///< around all
};

/// The nearest points of eight pairs of triangles that do not cross.
struct alignas(64) PairGaps {
  double squared[8];
  double on_a[3][8];
  double between[3][8];  ///< from there to B's
};

/// Measures pairs [0, count). Bit n of what comes back: pair n may cross, as each triangle reaches
/// to both sides of the other's plane, where coordinates may be off by `slack`.
HWY_INLINE std::uint32_t measure_pairs(const TrianglePairs& pairs, std::uint32_t count,
                                       double slack, PairGaps& out) {
  const D d;
  const auto loaded = [&](int side, std::size_t l) {
    Flat t;
    for (int c = 0; c < 3; ++c)
      t.corner[c] = {hn::Load(d, pairs.corner[side][c][0] + l),
                     hn::Load(d, pairs.corner[side][c][1] + l),
                     hn::Load(d, pairs.corner[side][c][2] + l)};
    flatten(t);
    return t;
  };
  std::uint32_t unclear = 0;
  for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
    const Flat a = loaded(0, l), b = loaded(1, l);
    Mask may_cross;
    const NearestPoints least = nearest_points(a, b, slack, may_cross);
    unclear |= mask_bits(d, may_cross) << l;
    hn::Store(least.squared, d, out.squared + l);
    const auto store = [&](const Vec3& x, double(&to)[3][8]) {
      hn::Store(x.x, d, to[0] + l);
      hn::Store(x.y, d, to[1] + l);
      hn::Store(x.z, d, to[2] + l);
    };
    store(least.on_a, out.on_a);
    store(least.between, out.between);
  }
  return unclear & ((1u << count) - 1);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
