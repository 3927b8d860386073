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
      of_a_[k] = along(axes[k], a);
      of_b_[k] = along(axes[k], b);
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

namespace gaps {

/// a b − c d, rounded about once: products are split.
struct Halves {
  V whole, high, low;
  explicit Halves(V x) : whole(x) {
    const D d;
    const V big = hn::Set(d, 134217729.0) * x;  // 2^27 + 1
    high = big - (big - x);
    low = x - high;
  }
};
HWY_INLINE V difference_of_products(const Halves& a, const Halves& b, const Halves& c,
                                    const Halves& e) {
  const auto error = [](const Halves& x, const Halves& y, V product) {
    return ((x.high * y.high - product) + (x.high * y.low + x.low * y.high)) + x.low * y.low;
  };
  const V ab = a.whole * b.whole, ce = c.whole * e.whole;
  return (ab - ce) + (error(a, b, ab) - error(c, e, ce));
}

/// A triangle with what its points are found by. Its normal keeps its digits however thin it is: it
/// is that of a triangle whose corners are off by roundings.
struct Flat {
  Vec3 corner[3], side[3];
  V inverse[3];  ///< of squared sides; of no length: 0
  Vec3 other;    ///< from the first corner to the last
  Vec3 normal;
  V squared_normal, inverse_normal;
};

HWY_INLINE V inverse_of(V x) {
  const D d;
  const V one = hn::Set(d, 1.0);
  const auto long_enough = x > hn::Set(d, 1e-290);
  return hn::IfThenElseZero(long_enough, one / hn::IfThenElse(long_enough, x, one));
}

HWY_INLINE Flat flat(const TrianglePairs& pairs, int side, std::size_t l) {
  const D d;
  Flat t;
  for (int c = 0; c < 3; ++c)
    t.corner[c] = {hn::Load(d, pairs.corner[side][c][0] + l),
                   hn::Load(d, pairs.corner[side][c][1] + l),
                   hn::Load(d, pairs.corner[side][c][2] + l)};
  for (int c = 0; c < 3; ++c) {
    t.side[c] = t.corner[(c + 1) % 3] - t.corner[c];
    t.inverse[c] = inverse_of(dot(t.side[c], t.side[c]));
  }
  t.other = t.corner[2] - t.corner[0];
  const Halves ux(t.side[0].x), uy(t.side[0].y), uz(t.side[0].z), vx(t.other.x), vy(t.other.y),
      vz(t.other.z);
  t.normal = {difference_of_products(uy, vz, uz, vy), difference_of_products(uz, vx, ux, vz),
              difference_of_products(ux, vy, uy, vx)};
  t.squared_normal = dot(t.normal, t.normal);
  t.inverse_normal = inverse_of(t.squared_normal);
  return t;
}

/// The least so far.
struct Least {
  V squared;
  Vec3 on_a, between;

  HWY_INLINE void take(V other, hn::Mask<D> valid, const Vec3& a, const Vec3& way) {
    const auto nearer = hn::And(valid, other < squared);
    squared = hn::IfThenElse(nearer, other, squared);
    on_a = {hn::IfThenElse(nearer, a.x, on_a.x), hn::IfThenElse(nearer, a.y, on_a.y),
            hn::IfThenElse(nearer, a.z, on_a.z)};
    between = {hn::IfThenElse(nearer, way.x, between.x), hn::IfThenElse(nearer, way.y, between.y),
               hn::IfThenElse(nearer, way.z, between.z)};
  }
};

/// A corner over a triangle. Its height comes back, times the normal's length.
template <bool kCornerOfA>
HWY_INLINE V over_face(const Vec3& p, const Flat& t, Least& least) {
  const D d;
  const Vec3 r = p - t.corner[0];
  const V height = dot(r, t.normal);
  const V v = dot(cross(r, t.other), t.normal), w = dot(cross(t.side[0], r), t.normal);
  const auto inside = hn::And(hn::And(v >= hn::Zero(d), w >= hn::Zero(d)),
                              hn::And(v + w <= t.squared_normal, t.inverse_normal > hn::Zero(d)));
  const V share = height * t.inverse_normal;
  const Vec3 up = share * t.normal;  // from the foot to the corner
  if constexpr (kCornerOfA)
    least.take(height * share, inside, p, {hn::Neg(up.x), hn::Neg(up.y), hn::Neg(up.z)});
  else
    least.take(height * share, inside, p - up, up);
  return height;
}

HWY_INLINE V clamped(V x) {
  const D d;
  return hn::Min(hn::Max(x, hn::Zero(d)), hn::Set(d, 1.0));
}

/// Edge i of A and edge j of B: where the lines are nearest, by products of vectors, which keep the
/// digits of nearly parallel ones; then each is brought to the other's point in turn.
HWY_INLINE void along_edges(const Flat& a, int i, const Flat& b, int j, Least& least) {
  const Vec3 &u = a.side[i], &v = b.side[j];
  const Vec3 w = b.corner[j] - a.corner[i];
  const Vec3 n = cross(u, v);
  V s = clamped(dot(cross(w, v), n) * inverse_of(dot(n, n)));
  const V t = clamped(dot(s * u - w, v) * b.inverse[j]);
  const Vec3 way = w + t * v;
  s = clamped(dot(way, u) * a.inverse[i]);
  const Vec3 su = s * u;
  const Vec3 between = way - su;
  const D d;
  least.take(dot(between, between), hn::Set(d, 0.0) == hn::Set(d, 0.0), a.corner[i] + su, between);
}

}  // namespace gaps

/// Measures pairs [0, count). Bit n of what comes back: pair n may cross, as each triangle reaches
/// to both sides of the other's plane, where coordinates may be off by `slack`.
HWY_INLINE std::uint32_t measure_pairs(const TrianglePairs& pairs, std::uint32_t count,
                                       double slack, PairGaps& out) {
  const D d;
  std::uint32_t unclear = 0;
  for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
    const gaps::Flat a = gaps::flat(pairs, 0, l), b = gaps::flat(pairs, 1, l);
    gaps::Least least{hn::Set(d, HUGE_VAL), a.corner[0], a.corner[0]};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) gaps::along_edges(a, i, b, j, least);
    V of_a[3], of_b[3];
    for (int k = 0; k < 3; ++k) {
      of_a[k] = gaps::over_face<true>(a.corner[k], b, least);
      of_b[k] = gaps::over_face<false>(b.corner[k], a, least);
    }
    const auto straddle = [&](const V(&h)[3], const Vec3& normal) {
      const V over = hn::Set(d, slack) * length_bound(normal);
      return hn::And(min3(h[0], h[1], h[2]) <= over, max3(h[0], h[1], h[2]) >= hn::Neg(over));
    };
    unclear |= mask_bits(d, hn::And(straddle(of_a, b.normal), straddle(of_b, a.normal))) << l;
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
