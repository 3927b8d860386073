// Distances of triangles. Included once per target.

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

/// Finds the triangles of two blocks that may be within a limit, in float with an error of `blur`.
class TriangleCulls {
 public:
  TriangleCulls(const PlacedTriangles& a, const PlacedTriangles& b, const GapAxes& axes, float blur)
      : a_(a), b_(b), blur_(blur) {
    for (std::size_t k = 0; k < 3; ++k) {
      of_a_[k] = along(axes.axis[k], a);
      of_b_[k] = along(axes.axis[k], b);
      low_b_[k] = lowest(of_b_[k].low) - blur;
      high_b_[k] = highest(of_b_[k].high) + blur;
    }
  }

  /// The triangles of A that may be within the limit of one of B's.
  std::uint32_t rows(double limit) {
    const F d;
    const auto most = hn::Set(d, rounded_up(limit) * rounded_up(limit));
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d))
      bits |= mask_bits(d, apart(of_a_, low_b_, high_b_, l) <= most) << l;
    if (bits == 0) return 0;
    invert(a_, inverse_a_);
    invert(b_, inverse_b_);
    return bits;
  }

  /// The triangles of B that may be within `limit` of A's triangle i: by their extents along three
  /// axes, by the planes of both, and by those through A's sides. `least`: a squared lower bound of
  /// the distances of those within `wide`, which is no less than the limit.
  std::uint32_t lanes(std::uint32_t i, double limit, double wide, float& least) {
    const F d;
    using V = hn::Vec<F>;
    const float far = rounded_up(wide) + blur_, size = a_.size + b_.size + far;
    const float over = a_.slack[i] * size;
    const auto zero = hn::Zero(d), blur = hn::Set(d, blur_), sizes = hn::Set(d, size),
               most = hn::Set(d, rounded_up(limit) * rounded_up(limit)),
               far_squared = hn::Set(d, far * far), inverse = hn::Set(d, inverse_a_[i]),
               less = hn::Set(d, 1 - 1e-5f);
    float low[3], high[3];
    for (int k = 0; k < 3; ++k)
      low[k] = of_a_[k].low[i] - blur_, high[k] = of_a_[k].high[i] + blur_;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      // A lane's result must not depend on the lanes beside it, since their number depends on the
      // processor.
      V squared = less * apart(of_b_, low, high, l);
      const auto is_far = squared > far_squared;
      if (hn::AllTrue(d, is_far)) {
        least = std::min(least, hn::GetLane(hn::MinOfLanes(d, squared)));
        continue;
      }
      const V n[3] = {hn::Load(d, b_.normal[0] + l), hn::Load(d, b_.normal[1] + l),
                      hn::Load(d, b_.normal[2] + l)};
      V corner[3][3], of_a[3], of_b[3];
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) corner[c][k] = hn::Load(d, b_.corner[c][k] + l);
        of_a[c] = ((hn::Set(d, a_.normal[0][i]) * corner[c][0] +
                    hn::Set(d, a_.normal[1][i]) * corner[c][1]) +
                   hn::Set(d, a_.normal[2][i]) * corner[c][2]) -
                  hn::Set(d, a_.offset[i]);
        of_b[c] = ((n[0] * hn::Set(d, a_.corner[c][0][i]) + n[1] * hn::Set(d, a_.corner[c][1][i])) +
                   n[2] * hn::Set(d, a_.corner[c][2][i])) -
                  hn::Load(d, b_.offset + l);
      }
      // Heights have the errors of the normal and of coordinates.
      const V over_a = hn::Max(zero, (beyond(of_a) - hn::Set(d, over)) * inverse - blur),
              over_b = hn::Max(zero, (beyond(of_b) - hn::Load(d, b_.slack + l) * sizes) *
                                             hn::Load(d, inverse_b_ + l) -
                                         blur);
      squared = hn::IfThenElse(is_far, squared,
                               hn::Max(squared, less * hn::Max(over_a * over_a, over_b * over_b)));
      const auto is_out = squared > most;
      if (!hn::AllTrue(d, is_out)) {
        if (!has_sides_) find_sides();
        V aside = zero;
        for (const auto& side : sides_) {
          V out[3];
          for (int c = 0; c < 3; ++c)
            out[c] =
                (hn::Set(d, side[0][i]) * corner[c][0] + hn::Set(d, side[1][i]) * corner[c][1]) +
                hn::Set(d, side[2][i]) * corner[c][2];
          aside = hn::Max(aside, hn::Min(out[0], hn::Min(out[1], out[2])) - hn::Set(d, side[3][i]));
        }
        squared = hn::IfThenElse(is_out, squared,
                                 hn::Max(squared, less * (over_a * over_a + aside * aside)));
      }
      bits |= mask_bits(d, squared <= most) << l;
      least = std::min(least, hn::GetLane(hn::MinOfLanes(d, squared)));
    }
    return bits;
  }

 private:
  static constexpr float kLonger = 1 + 2e-6f;  ///< than a length in floats
  /// The distance of three heights that are all on one side; else negative.
  static hn::Vec<F> beyond(const hn::Vec<F> (&height)[3]) {
    return hn::Max(hn::Min(height[0], hn::Min(height[1], height[2])),
                   hn::Neg(hn::Max(height[0], hn::Max(height[1], height[2]))));
  }
  /// Lower bounds of the inverse lengths of normals; 0 if there is none.
  static void invert(const PlacedTriangles& t, float (&inverse)[kWidth]) {
    const F d;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const auto x = hn::Load(d, t.normal[0] + l), y = hn::Load(d, t.normal[1] + l),
                 z = hn::Load(d, t.normal[2] + l);
      const auto length = hn::Sqrt((x * x + y * y) + z * z) * hn::Set(d, kLonger);
      hn::Store(inverse_of_length(length), d, inverse + l);
    }
  }
  static hn::Vec<F> inverse_of_length(hn::Vec<F> length) {
    const F d;
    const auto one = hn::Set(d, 1.0f);
    const auto some = length > hn::Set(d, 1e-15f);
    return hn::IfThenElseZero(some, one / hn::IfThenElse(some, length, one));
  }
  /// For A's triangles: unit vectors in their planes, perpendicular to their sides and outward, and
  /// upper bounds of the sides' positions along them.
  void find_sides() {
    has_sides_ = true;
    const F d;
    using V = hn::Vec<F>;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d))
      for (int e = 0; e < 3; ++e) {
        V side[3], n[3], out[3];
        for (int k = 0; k < 3; ++k) {
          side[k] = hn::Load(d, a_.corner[(e + 1) % 3][k] + l) - hn::Load(d, a_.corner[e][k] + l);
          n[k] = hn::Load(d, a_.normal[k] + l) * hn::Load(d, inverse_a_ + l);
        }
        for (int k = 0; k < 3; ++k) {
          const int x = (k + 1) % 3, y = (k + 2) % 3;
          out[k] = side[x] * n[y] - side[y] * n[x];
        }
        const V squared = (out[0] * out[0] + out[1] * out[1]) + out[2] * out[2],
                side_squared = (side[0] * side[0] + side[1] * side[1]) + side[2] * side[2];
        // Slivers, whose normals have no valid digits, decide nothing.
        const V inverse =
            hn::IfThenElseZero(squared > hn::Set(d, 0.9f) * side_squared,
                               inverse_of_length(hn::Sqrt(squared) * hn::Set(d, kLonger)));
        V last;
        for (int c = 0; c < 3; ++c) {
          V at = hn::Zero(d);
          for (int k = 0; k < 3; ++k) at = at + inverse * out[k] * hn::Load(d, a_.corner[c][k] + l);
          last = c == 0 ? at : hn::Max(last, at);
        }
        for (int k = 0; k < 3; ++k) hn::Store(inverse * out[k], d, sides_[e][k] + l);
        hn::Store(last + hn::Set(d, 2 * blur_), d, sides_[e][3] + l);
      }
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
  /// The squared distances of the lanes from `from` on to one box.
  static hn::Vec<F> apart(const Extents (&of)[3], const float (&low)[3], const float (&high)[3],
                          std::size_t from) {
    const F d;
    const auto zero = hn::Zero(d);
    auto squared = zero;
    for (int k = 0; k < 3; ++k) {
      const auto gap = hn::Max(hn::Max(zero, hn::Load(d, of[k].low + from) - hn::Set(d, high[k])),
                               hn::Set(d, low[k]) - hn::Load(d, of[k].high + from));
      squared = squared + gap * gap;
    }
    return squared;
  }
  static float rounded_up(double limit) {
    return static_cast<float>(std::min(limit, 1e15) * (1 + 2e-6));
  }
  const PlacedTriangles& a_;
  const PlacedTriangles& b_;
  const float blur_;
  Extents of_a_[3], of_b_[3];
  float low_b_[3], high_b_[3];  ///< around all
  alignas(64) float inverse_a_[kWidth], inverse_b_[kWidth], sides_[3][4][kWidth];
  bool has_sides_ = false;
};

/// The gap between the vertices of a block of A and those of one of B, along a direction.
inline double gap_along(const exact::Point& direction, const PlacedVertices& of_a,
                        const PlacedVertices& of_b) {
  const D d;
  const V x = hn::Set(d, direction.x), y = hn::Set(d, direction.y), z = hn::Set(d, direction.z);
  const auto along = [&](const PlacedVertices& of, std::size_t l) {
    return (x * hn::Load(d, of.at[0] + l) + y * hn::Load(d, of.at[1] + l)) +
           z * hn::Load(d, of.at[2] + l);
  };
  V last = along(of_a, 0), next = along(of_b, 0);
  for (std::size_t l = hn::Lanes(d); l < kWidth; l += hn::Lanes(d)) {
    last = hn::Max(last, along(of_a, l));
    next = hn::Min(next, along(of_b, l));
  }
  return hn::GetLane(hn::MinOfLanes(d, next)) - hn::GetLane(hn::MaxOfLanes(d, last));
}

/// A box, and its extents along three axes.
struct PlacedBox {
  double low[3], high[3];
  exact::Point middle, side[3];  ///< half of each side, from the middle
};

/// A node's box in A's unit frame; `map` is null for A's own.
inline PlacedBox placed_box(const MeshTree& mesh, int level, std::uint32_t number,
                            const Similarity* map, const GapAxes& axes) {
  const MiddleBox<double> box = box_of<double>(mesh, level, number);
  PlacedBox out;
  out.middle = {box.middle[0], box.middle[1], box.middle[2]};
  if (map != nullptr) out.middle = map_point(*map, out.middle);
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i)
      out.side[k][i] = box.half[k] * (map == nullptr ? i == k : map->m[3 * i + k]);
  for (std::size_t j = 0; j < 3; ++j) {
    const exact::Point& axis = axes.axis[j];
    double reach = 0;
    for (const exact::Point& side : out.side) reach += std::abs(dot(axis, side));
    out.low[j] = dot(axis, out.middle) - reach;
    out.high[j] = dot(axis, out.middle) + reach;
  }
  return out;
}

/// The extents of a block's triangles along three axes, in double.
class BlockExtents {
 public:
  BlockExtents(const PlacedVertices& vertices, const MeshBlock& block, const GapAxes& axes) {
    for (std::size_t k = 0; k < 3; ++k) {
      double along[kWidth];
      for (std::size_t v = 0; v < kWidth; ++v)
        along[v] = (axes.axis[k].x * vertices.at[0][v] + axes.axis[k].y * vertices.at[1][v]) +
                   axes.axis[k].z * vertices.at[2][v];
      for (std::size_t t = 0; t < kWidth; ++t) {
        const double p = along[block.corner[0][t]], q = along[block.corner[1][t]],
                     r = along[block.corner[2][t]];
        low_[k][t] = std::min({p, q, r});
        high_[k][t] = std::max({p, q, r});
      }
    }
  }

  /// The triangles that are within a squared limit of triangle `t` of another block, or of the
  /// whole block.
  std::uint32_t near(const BlockExtents& other, std::uint32_t t, double squared_limit) const {
    double low[3], high[3];
    for (int k = 0; k < 3; ++k) low[k] = other.low_[k][t], high[k] = other.high_[k][t];
    return near(low, high, squared_limit);
  }
  std::uint32_t near(const BlockExtents& other, double squared_limit) const {
    double low[3], high[3];
    for (int k = 0; k < 3; ++k) {
      low[k] = *std::min_element(other.low_[k], other.low_[k] + kWidth);
      high[k] = *std::max_element(other.high_[k], other.high_[k] + kWidth);
    }
    return near(low, high, squared_limit);
  }

 protected:
  HWY_INLINE V squared_gap(const double (&low)[3], const double (&high)[3],
                           std::size_t from) const {
    const D d;
    V squared = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      const V gap = hn::Max(hn::Max(hn::Zero(d), hn::Load(d, low_[k] + from) - hn::Set(d, high[k])),
                            hn::Set(d, low[k]) - hn::Load(d, high_[k] + from));
      squared = squared + gap * gap;
    }
    return squared;
  }

 private:
  std::uint32_t near(const double (&low)[3], const double (&high)[3], double squared_limit) const {
    const D d;
    std::uint32_t bits = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d))
      bits |= mask_bits(d, squared_gap(low, high, l) <= hn::Set(d, squared_limit)) << l;
    return bits;
  }

  alignas(64) double low_[3][kWidth], high_[3][kWidth];
};

/// The triangles of a block that is much larger than the other node.
class BlockFaces : public BlockExtents {
 public:
  BlockFaces(const PlacedVertices& vertices, const MeshBlock& block, const GapAxes& axes)
      : BlockExtents(vertices, block, axes) {
    const D d;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      Flat& t = faces_[l / hn::Lanes(d)];
      for (int c = 0; c < 3; ++c) {
        alignas(64) double at[3][kWidth];
        for (std::size_t i = 0; i < hn::Lanes(d); ++i)
          for (int k = 0; k < 3; ++k) at[k][i] = vertices.at[k][block.corner[c][l + i]];
        t.corner[c] = {hn::Load(d, at[0]), hn::Load(d, at[1]), hn::Load(d, at[2])};
      }
      flatten(t);
    }
  }

  /// A lower bound of the squared distance of the nearest triangle from a box. `slack`: the error
  /// of distances.
  double squared_gap(const PlacedBox& box, double slack) const {
    const D d;
    const V zero = hn::Zero(d), off = hn::Set(d, slack), tiny = hn::Set(d, 1e-300);
    V least = hn::Set(d, HUGE_VAL);
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      // A triangle is behind the plane through its point nearest to the middle.
      const NearestPoints nearest = nearest_to(box.middle, l);
      const V distance = hn::Sqrt(nearest.squared);
      V reach = zero;
      for (const exact::Point& side : box.side)
        reach = reach + hn::Abs(dot(nearest.between, in_lanes(side)));
      const V gap = hn::Max(zero, (distance - reach / hn::Max(distance, tiny)) - off);
      least = hn::Min(least, hn::Max(gap * gap, BlockExtents::squared_gap(box.low, box.high, l)));
    }
    return hn::GetLane(hn::MinOfLanes(d, least));
  }

  /// The vector from the nearest triangle to a point, of any length.
  exact::Point vector_to(const exact::Point& point) const {
    const D d;
    alignas(64) double squared[kWidth], between[3][kWidth];
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const NearestPoints nearest = nearest_to(point, l);
      hn::Store(nearest.squared, d, squared + l);
      hn::Store(nearest.between.x, d, between[0] + l);
      hn::Store(nearest.between.y, d, between[1] + l);
      hn::Store(nearest.between.z, d, between[2] + l);
    }
    const auto least = std::min_element(squared, squared + kWidth) - squared;
    return {between[0][least], between[1][least], between[2][least]};
  }

 private:
  static HWY_INLINE Vec3 in_lanes(const exact::Point& x) {
    const D d;
    return {hn::Set(d, x.x), hn::Set(d, x.y), hn::Set(d, x.z)};
  }
  HWY_INLINE NearestPoints nearest_to(const exact::Point& to, std::size_t from_lane) const {
    const D d;
    const Flat& t = faces_[from_lane / hn::Lanes(d)];
    const Vec3 point = in_lanes(to);
    NearestPoints nearest{hn::Set(d, HUGE_VAL), point, point};
    over_face<false>(point, t, nearest);
    for (int e = 0; e < 3; ++e) {
      const Vec3 from = point - t.corner[e];
      const Vec3 on_edge = part_of_edge(dot(from, t.side[e]) * t.inverse[e]) * t.side[e];
      const Vec3 between = from - on_edge;
      const V squared = dot(between, between);
      take_nearer(nearest, squared, squared <= squared, point - between, between);
    }
    return nearest;
  }

  Flat faces_[kWidth / hn::MaxLanes(D())];
};

/// The nearest points of eight pairs of triangles that do not cross.
struct alignas(64) PairGaps {
  double squared[8];
  double on_a[3][8];
  double between[3][8];  ///< from there to B's
};

/// Measures pairs [0, count). Bit n of the result: pair n may cross, since each triangle reaches to
/// both sides of the other's plane, for coordinates with errors up to `slack`.
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

struct Corners {
  exact::Point at[3];
};
inline Corners corners(const TrianglePairs& pairs, int side, std::uint32_t n) {
  Corners out;
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k) out.at[c][k] = pairs.corner[side][c][k][n];
  return out;
}

/// True if the triangles of pair n cross. They do not if a plane perpendicular to the direction
/// between the found points separates them, which it does for the nearest points, except for
/// rounding.
inline bool crosses(const TrianglePairs& pairs, const PairGaps& gaps, std::uint32_t n,
                    double slack) {
  const exact::Point between = {gaps.between[0][n], gaps.between[1][n], gaps.between[2][n]};
  const auto [a] = corners(pairs, 0, n);
  const auto [b] = corners(pairs, 1, n);
  const double last = std::max({dot(between, a[0]), dot(between, a[1]), dot(between, a[2])}),
               next = std::min({dot(between, b[0]), dot(between, b[1]), dot(between, b[2])});
  return !(next - last > 4 * slack * std::sqrt(gaps.squared[n])) && exact::cross_exactly(a, b);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
