// Tests of two blocks' triangles against each other's planes. Included once per target.

#if defined(IST_QUERY_BLOCK_MEETING_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_BLOCK_MEETING_INL_H_
#undef IST_QUERY_BLOCK_MEETING_INL_H_
#else
#define IST_QUERY_BLOCK_MEETING_INL_H_
#endif

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/bits.h"
#include "query/exact/crossing_search.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// How far from a plane a vertex must be to count as above or below: more than rounding, or so far
/// that it stays there while points move within the tolerance, or B within the search's reach.
enum class Margin { rounding, tolerance, reach };

/// The triangles of a block whose corners are all among the given vertices, a bit each.
HWY_INLINE std::uint32_t triangles_of(std::uint32_t vertices, const PlacedVertices& block) {
  const hn::CappedTag<std::uint16_t, kWidth> d;
  const auto others = hn::Set(d, static_cast<std::uint16_t>(~vertices));
  std::uint32_t out = 0;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d))
    out |= mask_bits(d, hn::And(hn::Load(d, block.corners + l), others) == hn::Zero(d)) << l;
  return out;
}

HWY_INLINE Vec3 all_lanes(const exact::Point& x) {
  const D d;
  return {hn::Set(d, x.x), hn::Set(d, x.y), hn::Set(d, x.z)};
}

struct SeenPlane {
  Vec3 at, normal;

  SeenPlane(const PlacedPlanes& planes, std::uint32_t t)
      : at(all_lanes(planes.corner[t].point)), normal(all_lanes(planes.normal[t].point)) {}

  /// The heights of vertices l … of a block, times the length of the normal.
  HWY_INLINE V heights(const PlacedVertices& vertices, std::size_t l) const {
    const D d;
    return dot(Vec3{hn::Load(d, vertices.at[0] + l), hn::Load(d, vertices.at[1] + l),
                    hn::Load(d, vertices.at[2] + l)} -
                   at,
               normal);
  }
};

/// The vertices that are above or below, a bit each.
struct PlaneSides {
  std::uint32_t above = 0, below = 0;
};

/// Classifies vertices of the other solid by the plane of triangle t of a block: those above `high`
/// and below `low`. `aside`: their symbolic translation. `apart`: a bound of the differences of
/// coordinates of both blocks.
HWY_INLINE PlaneSides sides_of(const PlacedVertices& vertices, const PlacedPlanes& planes,
                               std::uint32_t t, double low, double high, const exact::Point& aside,
                               double apart, Margin margin, double by) {
  const D d;
  const exact::Point& n = planes.normal[t].point;
  const double shift = dot(aside, n), longest = planes.normal[t].number + by;
  double beyond = 1.1 * exact::kFilter * planes.corner[t].number * apart;
  if (margin == Margin::reach)
    beyond += by * ((std::abs(n.x) + std::abs(n.y)) + std::abs(n.z));
  else if (margin == Margin::tolerance)  // six products of three numbers
    beyond += 6 * by * longest * (2 * apart + longest);
  const SeenPlane plane(planes, t);
  const V top = hn::Set(d, (high - shift) + beyond), bottom = hn::Set(d, (low - shift) - beyond);
  PlaneSides out;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    const V height = plane.heights(vertices, l);
    out.above |= mask_bits(d, height > top) << l;
    out.below |= mask_bits(d, height < bottom) << l;
  }
  return out;
}

/// The triangles of the other block, translated by `aside`, whose corners are all farther than `by`
/// beyond an edge of triangle t, in its plane.
HWY_INLINE std::uint32_t beyond_edges_of(const PlacedPlanes& planes, std::uint32_t t,
                                         const PlacedVertices& other, const exact::Point& aside,
                                         double by) {
  const D d;
  std::uint32_t out = 0;
  for (int e = 0; e < 3; ++e) {
    const PlacedPlanes::PointAnd& edge = planes.edge[e][t];
    const V least = hn::Set(d, (edge.number - dot(aside, edge.point)) + by);
    const Vec3 away = all_lanes(edge.point);
    std::uint32_t beyond = 0;
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const Vec3 at = {hn::Load(d, other.at[0] + l), hn::Load(d, other.at[1] + l),
                       hn::Load(d, other.at[2] + l)};
      beyond |= mask_bits(d, dot(at, away) > least) << l;
    }
    out |= triangles_of(beyond, other);
  }
  return out;
}

inline const PlacedPlanes& placed_planes(const MeshTree& tree, std::uint32_t number,
                                         const Similarity* map, PlacedMesh& kept) {
  const auto [found, held] = kept.planes.find(number);
  auto& out = found;  // clang 14 captures no structured binding
  if (held) return out;
  const MeshBlock& block = tree.blocks[number];
  const PlacedVertices& vertices = placed_vertices(tree, number, map, kept);
  const D d;
  alignas(64) double corner[3][3][kWidth];
  for (int c = 0; c < 3; ++c)
    for (int k = 0; k < 3; ++k)
      for (std::uint32_t t = 0; t < kWidth; ++t)
        corner[c][k][t] = vertices.at[k][block.corner[c][t]];
  alignas(64) double length[kWidth];
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    Vec3 p[3];
    for (int c = 0; c < 3; ++c)
      p[c] = {hn::Load(d, corner[c][0] + l), hn::Load(d, corner[c][1] + l),
              hn::Load(d, corner[c][2] + l)};
    const Vec3 u = p[1] - p[0], v = p[2] - p[0];
    const V ax = u.y * v.z, bx = u.z * v.y, ay = u.z * v.x, by = u.x * v.z, az = u.x * v.y,
            bz = u.y * v.x;
    const Vec3 normal = {ax - bx, ay - by, az - bz};
    const Vec3 size = {hn::Abs(ax) + hn::Abs(bx), hn::Abs(ay) + hn::Abs(by),
                       hn::Abs(az) + hn::Abs(bz)};
    const auto store = [&](const Vec3& x, V number, PlacedPlanes::PointAnd* to) {
      hn::StoreInterleaved4(x.x, x.y, x.z, number, d, &to[l].point.x);
    };
    store(p[0], (size.x + size.y) + size.z, out.corner);
    store(normal, hn::Max(largest(u), largest(v)), out.normal);
    for (int e = 0; e < 3; ++e) {
      const Vec3 across = cross(p[(e + 1) % 3] - p[e], normal);
      const Vec3 out_of =
          (hn::Set(d, 1.0) / hn::Max(length_bound(across), hn::Set(d, 1e-300))) * across;
      store(out_of, max3(dot(out_of, p[0]), dot(out_of, p[1]), dot(out_of, p[2])), out.edge[e]);
    }
    hn::Store(length_bound(normal), d, length + l);
  }
  out.widest =
      static_cast<std::uint32_t>(std::max_element(length, length + block.triangles) - length);
  const SeenPlane plane(out, out.widest);
  V low = hn::Zero(d), high = hn::Zero(d);
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    const V height = plane.heights(vertices, l);
    low = hn::Min(low, height);
    high = hn::Max(high, height);
  }
  out.low = hn::GetLane(hn::MinOfLanes(d, low));
  out.high = hn::GetLane(hn::MaxOfLanes(d, high));
  return out;
}

/// The triangles of a block that reach into a slab, a bit each.
inline std::uint32_t in_slab(const PlacedTriangles& triangles, const float (&normal)[3], float low,
                             float high) {
  const F d;
  std::uint32_t bits = 0;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    hn::Vec<F> along[3];
    for (int c = 0; c < 3; ++c)
      along[c] = (hn::Set(d, normal[0]) * hn::Load(d, triangles.corner[c][0] + l) +
                  hn::Set(d, normal[1]) * hn::Load(d, triangles.corner[c][1] + l)) +
                 hn::Set(d, normal[2]) * hn::Load(d, triangles.corner[c][2] + l);
    bits |= mask_bits(d, hn::And(hn::Min(along[0], hn::Min(along[1], along[2])) <= hn::Set(d, high),
                                 hn::Max(along[0], hn::Max(along[1], along[2])) >= hn::Set(d, low)))
            << l;
  }
  return bits;
}

/// Triangles of B that reach through the plane of one of A's, which reaches through theirs.
struct Straddling {
  std::uint32_t clear = 0, doubtful = 0;
};

/// Tests in float, and allows for points that move by `reach`.
HWY_INLINE Straddling straddling(const PlacedTriangles& a, std::uint32_t i,
                                 const PlacedTriangles& b, std::uint32_t lanes, float reach) {
  const F d;
  // The rounding of coordinates in float, and `reach`. Points of both blocks that matter are within
  // `size`.
  const float blur = 1e-6f * (a.reach + b.reach) + reach, size = a.size + b.size;
  const auto over_a = hn::Set(d, blur * a.length[i] + a.slack[i] * size);
  Straddling out;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    if ((lanes >> l & ((1u << hn::Lanes(d)) - 1)) == 0) continue;
    const auto over_b =
        hn::Set(d, blur) * hn::Load(d, b.length + l) + hn::Load(d, b.slack + l) * hn::Set(d, size);
    // The extent of heights beyond the nearer side of a plane.
    const auto through = [](const hn::Vec<F>(&height)[3]) {
      return hn::Min(hn::Neg(hn::Min(height[0], hn::Min(height[1], height[2]))),
                     hn::Max(height[0], hn::Max(height[1], height[2])));
    };
    hn::Vec<F> of_b[3], of_a[3];
    for (int c = 0; c < 3; ++c)
      of_b[c] = ((hn::Set(d, a.normal[0][i]) * hn::Load(d, b.corner[c][0] + l) +
                  hn::Set(d, a.normal[1][i]) * hn::Load(d, b.corner[c][1] + l)) +
                 hn::Set(d, a.normal[2][i]) * hn::Load(d, b.corner[c][2] + l)) -
                hn::Set(d, a.offset[i]);
    const auto a_by = through(of_b);
    const auto a_may = a_by >= hn::Neg(over_a);
    if ((mask_bits(d, a_may) & lanes >> l) == 0) continue;
    for (int c = 0; c < 3; ++c)
      of_a[c] = ((hn::Load(d, b.normal[0] + l) * hn::Set(d, a.corner[c][0][i]) +
                  hn::Load(d, b.normal[1] + l) * hn::Set(d, a.corner[c][1][i])) +
                 hn::Load(d, b.normal[2] + l) * hn::Set(d, a.corner[c][2][i])) -
                hn::Load(d, b.offset + l);
    const auto b_by = through(of_a);
    const std::uint32_t may = mask_bits(d, hn::And(a_may, b_by >= hn::Neg(over_b)));
    const std::uint32_t clear = mask_bits(d, hn::And(a_by > over_a, b_by > over_b));
    out.clear |= clear << l;
    out.doubtful |= (may & ~clear) << l;
  }
  out.clear &= lanes;
  out.doubtful &= lanes;
  return out;
}

/// Counts how often a search tried an optional test, and how often the test helped.
struct Tally {
  std::uint32_t asked = 0, found = 0;
  bool pays() const { return asked <= 2 * found + 8; }
};
/// Statistics of planes through edges of A's and of B's triangles. A pair that they separate would
/// otherwise cost three times as much.
using EdgeTally = Tally[2];

/// Two blocks whose triangles are tested in double by the planes of both sides, and by planes
/// through their edges.
class Meeting {
 public:
  /// `margin`: a plane separates only if the signs are settled, or if both blocks are marked as
  /// near anyway. Planes through edges separate triangles that are farther apart than `reach` or,
  /// in marked blocks, that do not cross.
  Meeting(const CrossingSearch& search, ExactScratch& scratch, std::uint32_t a, std::uint32_t b,
          Margin margin, float reach)
      : search_(search), scratch_(scratch), margin_(margin), reach_(reach), number_{a, b} {
    PlacedMeshes placed(search, scratch);
    for (int s = 0; s < 2; ++s) vertices_[s] = &placed.vertices(s == 1, number_[s]);
    const PlacedTriangles &of_a = placed.triangles(false, a), &of_b = placed.triangles(true, b);
    for (int k = 0; k < 3; ++k)
      apart_ = std::max(apart_, std::max(of_a.all_high[k], of_b.all_high[k]) -
                                    std::min(of_a.all_low[k], of_b.all_low[k]));
    apart_ += search.tolerance;
    // Four roundings each of a height, and of the offset that it is compared with.
    beyond_ = exact::kFilter * (double{of_a.reach} + double{of_b.reach}) +
              (margin == Margin::rounding ? 0.0 : (1 + 1e-6) * double{reach});
  }

  const PlacedVertices& vertices(int side) const { return *vertices_[side]; }
  Margin margin() const { return margin_; }

  /// The triangles of the other block that may cross a plane of this side's block, if that is flat.
  /// If signs must be settled, triangles that are left out are out of reach.
  std::uint32_t straddling_block(int side) {
    // Its own heights have the same error as the other's.
    const PlacedPlanes& planes = planes_of(side);
    const double off = 1.1 * exact::kFilter * planes.corner[planes.widest].number * apart_;
    flat_[side] = true;
    return ~kept_apart(side, sides(side, planes.widest, planes.low - off, planes.high + off,
                                   margin_ == Margin::tolerance ? Margin::reach : margin_));
  }

  /// The triangles of B among `lanes` that no plane separates from A's triangle i.
  std::uint32_t straddling(std::uint32_t i, std::uint32_t lanes) {
    const bool told = margin_ != Margin::tolerance;  // flat blocks' planes have decided
    if (!told || !flat_[0]) lanes &= ~beside(0, i);
    if (!told || !flat_[1])
      lanes = columns_.without(i, lanes, [&](std::uint32_t j) { return beside(1, j); });
    return lanes;
  }
  /// The triangles of B among `lanes` that planes through edges do not separate from A's triangle
  /// i.
  std::uint32_t within_edges(std::uint32_t i, std::uint32_t lanes, EdgeTally& tally) {
    const auto ask = [&](int side, std::uint32_t t) {
      ++tally[side].asked;
      return beyond(side, t);
    };
    if (flat_[0] || ((lanes & (lanes - 1)) != 0 && tally[0].pays())) {
      const std::uint32_t apart = lanes & ask(0, i);
      tally[0].found += static_cast<std::uint32_t>(std::popcount(apart));
      lanes &= ~apart;
    }
    if (lanes != 0 && (flat_[1] || tally[1].pays())) {
      const std::uint32_t left =
          edges_.without(i, lanes, [&](std::uint32_t j) { return ask(1, j); });
      tally[1].found += static_cast<std::uint32_t>(std::popcount(lanes & ~left));
      lanes = left;
    }
    return lanes;
  }

  /// The triangles of B among `lanes` that are in one plane with A's triangle i, to
  /// flush_distance(). Either triangle's plane will do, since that of a sliver may be any.
  std::uint32_t flush(std::uint32_t i, std::uint32_t lanes) {
    const auto in_plane = [&](int side, std::uint32_t t) {
      const PlaneSides off = sides_by(side, t, flush_distance(search_.touch));
      return triangles_of(~(off.above | off.below), *vertices_[1 - side]);
    };
    const std::uint32_t others = lanes & ~in_plane(0, i);
    return lanes & ~flush_.without(i, others, [&](std::uint32_t j) { return in_plane(1, j); });
  }
  /// The triangles of B among `lanes` that no plane keeps farther from A's triangle i than
  /// CrossingSearch::touch.
  std::uint32_t within_touch(std::uint32_t i, std::uint32_t lanes) {
    const auto beyond_plane = [&](int side, std::uint32_t t) {
      return kept_apart(side, sides_by(side, t, search_.touch));
    };
    lanes &= ~beyond_plane(0, i);
    return touch_.without(i, lanes, [&](std::uint32_t j) { return beyond_plane(1, j); });
  }

 private:
  const PlacedPlanes& planes_of(int side) const {
    const PlacedPlanes*& planes = planes_[side];
    if (planes == nullptr)
      planes = side == 0
                   ? &placed_planes(*search_.a, number_[0], nullptr, *scratch_.placed_a)
                   : &placed_planes(*search_.b, number_[1], &search_.a_from_b, *scratch_.placed_b);
    return *planes;
  }
  /// Classifies the other block's vertices by the plane of triangle t.
  PlaneSides sides(int side, std::uint32_t t, double low, double high, Margin margin) const {
    return sides_of(*vertices_[1 - side], planes_of(side), t, low, high, aside_[side],
                    double{apart_}, margin,
                    double{margin == Margin::reach ? reach_ : search_.tolerance});
  }
  /// The other block's vertices that are farther from the plane of triangle t than `distance`.
  PlaneSides sides_by(int side, std::uint32_t t, double distance) const {
    const PlacedPlanes& planes = planes_of(side);
    const exact::Point& n = planes.normal[t].point;
    const double far = distance * std::sqrt(dot(n, n));
    return sides_of(*vertices_[1 - side], planes, t, -far, far, {0, 0, 0}, double{apart_},
                    Margin::rounding, 0);
  }
  std::uint32_t kept_apart(int side, const PlaneSides& found) const {
    return triangles_of(found.above, *vertices_[1 - side]) |
           triangles_of(found.below, *vertices_[1 - side]);
  }
  /// The other block's triangles that are on one side of the plane of triangle t.
  std::uint32_t beside(int side, std::uint32_t t) const {
    return kept_apart(side, sides(side, t, 0, 0, margin_));
  }
  /// The same, and those beyond an edge of triangle t.
  std::uint32_t beyond(int side, std::uint32_t t) const {
    const exact::Point still = {0, 0, 0};
    return beyond_edges_of(planes_of(side), t, *vertices_[1 - side],
                           margin_ == Margin::rounding ? aside_[side] : still, beyond_);
  }
  /// The triangles of A that planes of B separate, computed at the first use.
  class Columns {
   public:
    template <class Find>
    std::uint32_t without(std::uint32_t i, std::uint32_t lanes, const Find& find) {
      for (const std::uint32_t i : set_bits(lanes & ~known_)) add(i, find);
      known_ |= lanes;
      return lanes & ~apart_[i];
    }

   private:
    template <class Find>
    HWY_INLINE void add(std::uint32_t j, const Find& find) {
      const hn::CappedTag<std::uint16_t, kWidth> d;
      const auto rows = hn::Set(d, static_cast<std::uint16_t>(find(j))),
                 bit = hn::Set(d, static_cast<std::uint16_t>(1u << j));
      for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
        const auto one = hn::Load(d, kRow + l), before = hn::Load(d, apart_ + l);
        hn::Store(hn::Or(before, hn::And(bit, hn::VecFromMask(d, hn::And(rows, one) == one))), d,
                  apart_ + l);
      }
    }

    alignas(32) static constexpr std::uint16_t kRow[kWidth] = {
        1 << 0, 1 << 1, 1 << 2,  1 << 3,  1 << 4,  1 << 5,  1 << 6,  1 << 7,
        1 << 8, 1 << 9, 1 << 10, 1 << 11, 1 << 12, 1 << 13, 1 << 14, 1 << 15};
    alignas(32) std::uint16_t apart_[kWidth] = {};  ///< of a row, a bit a column
    std::uint32_t known_ = 0;
  };

  const CrossingSearch& search_;
  ExactScratch& scratch_;
  const Margin margin_;
  const float reach_;
  const std::uint32_t number_[2];
  const exact::Point aside_[2] = {search_.aside, -1 * search_.aside};  ///< of the other block
  const PlacedVertices* vertices_[2];
  mutable const PlacedPlanes* planes_[2] = {};  ///< computed at the first use
  float apart_ = 0;    ///< bounds the differences of coordinates of both blocks
  double beyond_;      ///< the separation that planes through edges must exceed
  bool flat_[2] = {};  ///< the block is flat: its edges are tested
  Columns columns_, edges_, touch_, flush_;
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
