// The signs of eight pairs of triangles. Included once per target.

#if defined(IST_QUERY_PAIR_SIGNS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PAIR_SIGNS_INL_H_
#undef IST_QUERY_PAIR_SIGNS_INL_H_
#else
#define IST_QUERY_PAIR_SIGNS_INL_H_
#endif

#include <cmath>

#include "query/exact/crossing_search.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

HWY_INLINE Vec3 corner_of(const TrianglePairs& pairs, int side, int c, std::size_t l) {
  const D d;
  return {hn::Load(d, pairs.corner[side][c][0] + l), hn::Load(d, pairs.corner[side][c][1] + l),
          hn::Load(d, pairs.corner[side][c][2] + l)};
}

/// Stores a triangle of a gathered pair.
HWY_INLINE void put_triangle(const MeshTree& mesh, std::uint32_t triangle,
                             const PlacedVertices& from, int side, TrianglePairs& pairs) {
  const MeshBlock& block = mesh.blocks[triangle / kWidth];
  for (int c = 0; c < 3; ++c) {
    const std::uint32_t v = block.corner[c][triangle % kWidth];
    for (int k = 0; k < 3; ++k) pairs.corner[side][c][k][pairs.count] = from.at[k][v];
  }
  pairs.triangle[side][pairs.count] = triangle;
}

inline std::uint32_t each(const std::uint32_t (&bits)[3]) { return bits[0] & bits[1] & bits[2]; }
inline std::uint32_t alike(const std::uint32_t (&bits)[3]) {
  return each(bits) | ~(bits[0] | bits[1] | bits[2]);
}

/// The heights of eight pairs, and their signs, a bit each.
struct alignas(64) PairHeights {
  double value[2][3][8], error[2][3][8];  ///< [of A's corners over B's plane, of B's over A's]
  double shift[2][8];                 ///< the part of the symbolic translation, its absolute value
  std::uint32_t positive[2][3] = {};  ///< with the symbolic translation of B
  std::uint32_t certain[2][3] = {};   ///< certain in double
  std::uint32_t settled[2][3] = {};   ///< certain wherever points move within the tolerance

  /// The pairs that a plane separates.
  std::uint32_t apart(const std::uint32_t (&known)[2][3]) const {
    return (each(known[0]) & alike(positive[0])) | (each(known[1]) & alike(positive[1]));
  }
  /// The edges that cross the other's plane.
  void find_parts(std::uint32_t (&out)[2][3]) const {
    for (int s = 0; s < 2; ++s)
      for (int k = 0; k < 3; ++k) out[s][k] = positive[s][k] ^ positive[s][(k + 1) % 3];
  }
};

/// The signs of gathered pairs, in double, and exactly where doubles do not decide.
class PairSigns {
 protected:
  explicit PairSigns(const CrossingSearch& search) : search_(search) {}

  /// `kSettle`: settled signs are wanted.
  template <bool kSettle>
  HWY_INLINE void find_heights(const TrianglePairs& pairs, std::uint32_t count,
                               PairHeights& out) const {
    const D d;
    const V tolerance = hn::Set(d, double{search_.tolerance}), filter = hn::Set(d, exact::kFilter);
    const V two = hn::Set(d, 2.0), six_tolerances = hn::Set(d, 6.0) * tolerance;
    const Vec3 aside = {hn::Set(d, search_.aside.x), hn::Set(d, search_.aside.y),
                        hn::Set(d, search_.aside.z)};
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      HWY_UNROLL(2)
      for (int s = 0; s < 2; ++s) HWY_UNROLL(3)
      for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      for (int side = 0; side < 2; ++side) {
        const Vec3(&plane)[3] = corner[1 - side];
        const Vec3 u = plane[1] - plane[0], v = plane[2] - plane[0];
        const V ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
                bz = u.y * v.x;
        const Vec3 normal = {ax - bx, ay - by, az - bz};
        const Vec3 size = {hn::Abs(ax) + hn::Abs(bx), hn::Abs(ay) + hn::Abs(by),
                           hn::Abs(az) + hn::Abs(bz)};
        const V along = dot(aside, normal), shift = side == 1 ? along : hn::Neg(along);
        const V shift_error = filter * absolute_dot(aside, size);
        hn::Store(hn::Abs(along), d, out.shift[side] + l);
        const V longest = kSettle ? hn::Max(largest(u), largest(v)) + tolerance : tolerance;
        HWY_UNROLL(3)
        for (int c = 0; c < 3; ++c) {
          const Vec3 r = corner[side][c] - plane[0];
          const V value = dot(r, normal), error = filter * absolute_dot(r, size);
          const V moved = value + shift, away = hn::Abs(moved), sure = error + shift_error;
          hn::Store(value, d, out.value[side][c] + l);
          // If the symbolic translation decides, the plane may be on the other side of the corner.
          const V height = hn::Abs(value);
          hn::Store(error + hn::IfThenElseZero(height <= hn::Abs(shift), height), d,
                    out.error[side][c] + l);
          out.positive[side][c] |= mask_bits(d, moved > hn::Zero(d)) << l;
          out.certain[side][c] |= mask_bits(d, away > sure) << l;
          if constexpr (kSettle) {
            // The effect of the tolerance: six products of three numbers.
            const V unsettled = sure + six_tolerances * longest * (two * largest(r) + longest);
            out.settled[side][c] |= mask_bits(d, away > unsettled) << l;
          }
        }
      }
    }
  }

  struct ExactCorners {
    exact::Point of[2][3];

    ExactCorners(const TrianglePairs& pairs, std::uint32_t n) {
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c)
          of[s][c] = {pairs.corner[s][c][0][n], pairs.corner[s][c][1][n], pairs.corner[s][c][2][n]};
    }
  };

  static void put(std::uint32_t& bits, std::uint32_t n, bool bit) {
    bits = (bits & ~(1u << n)) | static_cast<std::uint32_t>(bit) << n;
  }

  /// Computes the heights of pair n whose sign is unclear in double.
  HWY_NOINLINE void find_heights_exactly(const TrianglePairs& pairs, std::uint32_t n,
                                         PairHeights& out) const {
    const ExactCorners corners(pairs, n);
    for (int s = 1; s >= 0; --s) {
      for (int c = 0; c < 3; ++c) {
        if (out.certain[s][c] >> n & 1) continue;
        const exact::Determinant height =
            s == 1 ? exact::height_over_a(corners.of[0], corners.of[1][c], search_.aside)
                   : exact::height_over_b(corners.of[1], corners.of[0][c], search_.aside);
        out.value[s][c][n] = height.value;
        out.error[s][c][n] =
            height.error + (height.value * height.sign < 0 ? std::abs(height.value) : 0);
        put(out.positive[s][c], n, height.sign > 0);
        put(out.certain[s][c], n, true);
      }
      if ((out.apart(out.certain) >> n & 1) != 0) return;
    }
  }

  /// The orientations of A's edges about B's, a bit for each pair.
  struct EdgeOrientations {
    std::uint32_t positive[3][3] = {};  ///< [A's edge][B's edge]
    std::uint32_t certain[3][3] = {}, settled[3][3] = {};

    /// The pairs with an edge that crosses the other's plane (`parts`: A's, B's) and may, by the
    /// `known` signs, cross the triangle.
    void may_pierce(const std::uint32_t (&parts)[2][3], const std::uint32_t (&known)[3][3],
                    std::uint32_t (&out)[2][3]) const {
      for (int k = 0; k < 3; ++k)
        for (int s = 0; s < 2; ++s) {
          std::uint32_t plus = 0, minus = 0;
          for (int j = 0; j < 3; ++j) {
            const int a = s == 0 ? k : j, b = s == 0 ? j : k;
            plus |= known[a][b] & positive[a][b];
            minus |= known[a][b] & ~positive[a][b];
          }
          out[s][k] = parts[s][k] & ~(plus & minus);
        }
    }
    /// The pairs of `which` with an unknown sign that matters.
    std::uint32_t undecided(std::uint32_t which, const std::uint32_t (&parts)[2][3],
                            const std::uint32_t (&known)[3][3]) const {
      which &= ~(each(known[0]) & each(known[1]) & each(known[2]));
      if (which == 0) return 0;
      std::uint32_t asked[2][3], decided = ~0u;
      may_pierce(parts, known, asked);
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) decided &= ~(asked[0][i] | asked[1][j]) | known[i][j];
      return which & ~decided;
    }
    /// The pairs with an edge that crosses the other's triangle, once all signs that matter are
    /// known.
    void pierced(const std::uint32_t (&parts)[2][3], std::uint32_t (&out)[2][3]) const {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t of_b[3] = {positive[0][k], positive[1][k], positive[2][k]};
        out[0][k] = parts[0][k] & alike(positive[k]);
        out[1][k] = parts[1][k] & alike(of_b);
      }
    }
  };

  template <bool kSettle>
  HWY_INLINE void find_orientations(const TrianglePairs& pairs, std::uint32_t count,
                                    EdgeOrientations& out) const {
    const D d;
    const V tolerance = hn::Set(d, double{search_.tolerance});
    const V filter = hn::Set(d, 6 * exact::kFilter), six_tolerances = hn::Set(d, 6.0) * tolerance;
    const Vec3 aside = {hn::Set(d, search_.aside.x), hn::Set(d, search_.aside.y),
                        hn::Set(d, search_.aside.z)};
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3], edge_b[3];
      HWY_UNROLL(2)
      for (int s = 0; s < 2; ++s) HWY_UNROLL(3)
      for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      V size_b[3];
      HWY_UNROLL(3)
      for (int j = 0; j < 3; ++j) {
        edge_b[j] = corner[1][(j + 1) % 3] - corner[1][j];
        size_b[j] = largest(edge_b[j]) + tolerance;
      }
      for (int i = 0; i < 3; ++i) {
        const Vec3 edge_a = corner[0][(i + 1) % 3] - corner[0][i];
        const V size_a = largest(edge_a) + tolerance, error_a = filter * size_a;
        HWY_UNROLL(3)
        for (int j = 0; j < 3; ++j) {
          // The symbolic translation is the ninth rounding.
          const Vec3 r = (corner[1][j] - corner[0][i]) + aside;
          const V value = dot(r, cross(edge_a, edge_b[j])), away = hn::Abs(value);
          const V size = largest(r), error = error_a * size_b[j] * size;
          out.positive[i][j] |= mask_bits(d, value > hn::Zero(d)) << l;
          out.certain[i][j] |= mask_bits(d, away > error) << l;
          if constexpr (kSettle) {
            const V moved = six_tolerances * (size_a * size_b[j] + size * (size_a + size_b[j]));
            out.settled[i][j] |= mask_bits(d, away > error + moved) << l;
          }
        }
      }
    }
  }

  /// Decides signs that are not certain by bounds as tight as those of exact::FilteredPlane, where
  /// products of zero coordinates have no rounding.
  HWY_NOINLINE void refine_orientations(const TrianglePairs& pairs,
                                        const std::uint32_t (&parts)[2][3], std::uint32_t which,
                                        EdgeOrientations& out) const {
    const D d;
    const V filter = hn::Set(d, exact::kFilter);
    const Vec3 aside = {hn::Set(d, search_.aside.x), hn::Set(d, search_.aside.y),
                        hn::Set(d, search_.aside.z)};
    for (std::size_t l = 0; which >> l != 0; l += hn::Lanes(d))
      for (int i = 0; i < 3; ++i) {
        const Vec3 p = corner_of(pairs, 0, i, l), u = corner_of(pairs, 0, (i + 1) % 3, l) - p;
        for (int j = 0; j < 3; ++j) {
          const std::uint32_t unsure = which & (parts[0][i] | parts[1][j]) & ~out.certain[i][j];
          if ((unsure >> l & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
          const Vec3 at = corner_of(pairs, 1, j, l), v = corner_of(pairs, 1, (j + 1) % 3, l) - at;
          const V ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
                  bz = u.y * v.x;
          const Vec3 normal = {ax - bx, ay - by, az - bz}, r = at - p;
          const Vec3 size = {hn::Abs(ax) + hn::Abs(bx), hn::Abs(ay) + hn::Abs(by),
                             hn::Abs(az) + hn::Abs(bz)};
          const V value = dot(r, normal) + dot(aside, normal);
          const V error = filter * absolute_dot(r, size) + filter * absolute_dot(aside, size);
          const std::uint32_t fresh =
              (mask_bits(d, hn::Abs(value) > error) << l) & ~out.certain[i][j];
          out.positive[i][j] =
              (out.positive[i][j] & ~fresh) | ((mask_bits(d, value > hn::Zero(d)) << l) & fresh);
          out.certain[i][j] |= fresh;
        }
      }
  }

  HWY_NOINLINE void find_round_exactly(const TrianglePairs& pairs,
                                       const std::uint32_t (&parts)[2][3], std::uint32_t n,
                                       EdgeOrientations& out) const {
    const ExactCorners corners(pairs, n);
    const exact::Point(&a)[3] = corners.of[0], (&b)[3] = corners.of[1];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        if (((parts[0][i] | parts[1][j]) >> n & 1) == 0 || (out.certain[i][j] >> n & 1) != 0)
          continue;
        const int sign =
            exact::edge_orientation(a[i], a[(i + 1) % 3], b[j], b[(j + 1) % 3], search_.aside).sign;
        put(out.positive[i][j], n, sign > 0);
        put(out.certain[i][j], n, true);
      }
  }

  /// The pairs that cross, or do not, wherever points move within the tolerance.
  HWY_NOINLINE std::uint32_t find_settled(const TrianglePairs& pairs, std::uint32_t count) const {
    PairHeights heights;
    find_heights<true>(pairs, count, heights);
    EdgeOrientations round;
    if ((each(heights.settled[0]) & each(heights.settled[1])) != 0)
      find_orientations<true>(pairs, count, round);
    return settled(heights, round);
  }
  static std::uint32_t settled(const PairHeights& heights, const EdgeOrientations& round) {
    const std::uint32_t apart = heights.apart(heights.settled);
    const std::uint32_t all = each(heights.settled[0]) & each(heights.settled[1]) & ~apart;
    std::uint32_t parts[2][3];
    heights.find_parts(parts);
    return apart | (all & ~round.undecided(all, parts, round.settled));
  }

  /// The pairs that are certainly farther apart than `reach` across or along the plane of one of
  /// them.
  HWY_NOINLINE std::uint32_t far_by_planes(const TrianglePairs& pairs, std::uint32_t count,
                                           double reach) const {
    const D d;
    std::uint32_t out = 0;
    const V least = hn::Set(d, reach * reach * (1 + 1e-6)), filter = hn::Set(d, exact::kFilter);
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3];
      for (int s = 0; s < 2; ++s)
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
      for (int s = 0; s < 2; ++s) {
        const Vec3(&other)[3] = corner[1 - s];
        const Vec3 u = corner[s][1] - corner[s][0], v = corner[s][2] - corner[s][0];
        const Vec3 normal = cross(u, v);
        const V wide = largest(u) + largest(v);
        // The error of a normal's coordinate, which matters for slivers.
        const V off = filter * (wide * wide);
        const auto beyond = [&](const Vec3& axis, V error, const auto& from, V gap) {
          const V reached = hn::Max(largest(other[0] - from),
                                    hn::Max(largest(other[1] - from), largest(other[2] - from)));
          const V sure = gap - error * reached;
          out |= mask_bits(d, sure * hn::Abs(sure) > least * dot(axis, axis)) << l;
        };
        const auto height = [&](int k) { return dot(normal, other[k] - corner[s][0]); };
        const V low = min3(height(0), height(1), height(2)),
                high = max3(height(0), height(1), height(2));
        beyond(normal, hn::Set(d, 4.0) * off, corner[s][0], hn::Max(low, hn::Neg(high)));
        for (int k = 0; k < 3; ++k) {
          const Vec3 &p = corner[s][k], edge = corner[s][(k + 1) % 3] - p;
          const Vec3 out_of = cross(edge, normal);
          beyond(out_of, hn::Set(d, 8.0) * (off * largest(edge)), p,
                 min3(dot(out_of, other[0] - p), dot(out_of, other[1] - p),
                      dot(out_of, other[2] - p)));
        }
      }
    }
    return out;
  }

  /// The pairs that a plane along a triangle, or along an edge of each, separates by more than
  /// `reach`.
  static HWY_NOINLINE std::uint32_t apart_by_axes(const TrianglePairs& pairs, std::uint32_t count,
                                                  double by) {
    const D d;
    std::uint32_t apart = 0;
    for (std::size_t l = 0; l < count; l += hn::Lanes(d)) {
      Vec3 corner[2][3], edge[2][3], normal[2];
      for (int s = 0; s < 2; ++s) {
        for (int c = 0; c < 3; ++c) corner[s][c] = corner_of(pairs, s, c, l);
        for (int c = 0; c < 3; ++c) edge[s][c] = corner[s][(c + 1) % 3] - corner[s][c];
        normal[s] = cross(edge[s][0], edge[s][1]);
      }
      const V zero = hn::Zero(d), reach = hn::Set(d, by), filter = hn::Set(d, 6 * exact::kFilter);
      V beyond = zero;
      // An axis and the extents of both triangles along it, B's relative to a corner of A's.
      const auto look = [&](const Vec3& axis, V low_a, V high_a, V low_b, V high_b, V off) {
        const V gap = hn::Max(low_b - high_a, low_a - high_b) - off;
        beyond = hn::Max(beyond, gap * hn::Abs(gap) - reach * reach * dot(axis, axis));
      };
      // Both ends of an edge coincide along its axis except for rounding. For parallel edges the
      // axis is rounding alone.
      const auto rounding = [&](const Vec3& u, const Vec3& v) {
        const V size_u = largest(u), size_v = largest(v);
        return filter * ((size_u * size_v) * (size_u + size_v));
      };
      for (int s = 0; s < 2; ++s) {
        V at[3];
        for (int c = 0; c < 3; ++c) at[c] = dot(normal[s], corner[1 - s][c] - corner[s][0]);
        look(normal[s], zero, zero, min3(at[0], at[1], at[2]), max3(at[0], at[1], at[2]),
             rounding(edge[s][0], edge[s][1]));
      }
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const Vec3 axis = cross(edge[0][i], edge[1][j]);
          const V other_a = dot(axis, corner[0][(i + 2) % 3] - corner[0][i]);
          const V at_b = dot(axis, corner[1][j] - corner[0][i]);
          const V other_b = at_b + dot(axis, corner[1][(j + 2) % 3] - corner[1][j]);
          look(axis, hn::Min(zero, other_a), hn::Max(zero, other_a), hn::Min(at_b, other_b),
               hn::Max(at_b, other_b), rounding(edge[0][i], edge[1][j]));
        }
      apart |= mask_bits(d, beyond > zero) << l;
    }
    return apart;
  }

  const CrossingSearch& search_;
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
