// The sides of a triangle's plane on which the vertices of a block are. Included once per target.

#if defined(IST_QUERY_PLANE_SIDES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PLANE_SIDES_INL_H_
#undef IST_QUERY_PLANE_SIDES_INL_H_
#else
#define IST_QUERY_PLANE_SIDES_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "query/exact/crossing_search.h"
#include "query/exact/placed_mesh-inl.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// The margin by which a vertex is above or below: the rounding of doubles; or so much that it
/// stays there wherever points move within the tolerance, or B within the search's reach.
enum class Margin { rounding, room, reach };

/// The triangles of a block whose corners are all among the given vertices, a bit each.
HWY_INLINE std::uint32_t triangles_of(std::uint32_t vertices, const PlacedVertices& block) {
  const hn::CappedTag<std::uint16_t, kWidth> d;
  const auto others = hn::Set(d, static_cast<std::uint16_t>(~vertices));
  std::uint32_t out = 0;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d))
    out |= mask_bits(d, hn::And(hn::Load(d, block.corners + l), others) == hn::Zero(d)) << l;
  return out;
}

/// The plane of a triangle, and axes along it.
struct SeenPlane {
  Vec3 at, normal;

  SeenPlane(const PlacedPlanes& planes, std::uint32_t t)
      : at(one(planes.at, t)), normal(one(planes.normal, t)) {}

  /// The heights of vertices l … of a block, times the length of the normal.
  HWY_INLINE V heights(const PlacedVertices& vertices, std::size_t l) const {
    const D d;
    return dot(Vec3{hn::Load(d, vertices.at[0] + l), hn::Load(d, vertices.at[1] + l),
                    hn::Load(d, vertices.at[2] + l)} -
                   at,
               normal);
  }

 private:
  static Vec3 one(const double (&from)[3][kWidth], std::uint32_t t) {
    const D d;
    return {hn::Set(d, from[0][t]), hn::Set(d, from[1][t]), hn::Set(d, from[2][t])};
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
  const exact::Point n = {planes.normal[0][t], planes.normal[1][t], planes.normal[2][t]};
  const double shift = dot(aside, n), longest = planes.longest[t] + by;
  double beyond = 1.1 * exact::kFilter * planes.size[t] * apart;
  if (margin == Margin::reach)
    beyond += by * ((std::abs(n.x) + std::abs(n.y)) + std::abs(n.z));
  else if (margin == Margin::room)  // six products of three numbers
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
    const exact::Point n = {planes.edge[e][0][t], planes.edge[e][1][t], planes.edge[e][2][t]};
    const V least = hn::Set(d, (planes.edge_offset[e][t] - dot(aside, n)) + by);
    const Vec3 away = {hn::Set(d, n.x), hn::Set(d, n.y), hn::Set(d, n.z)};
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

/// The planes of a block.
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
    hn::Store((size.x + size.y) + size.z, d, out.size + l);
    const auto store = [&](const Vec3& x, double(&to)[3][kWidth]) {
      hn::Store(x.x, d, to[0] + l);
      hn::Store(x.y, d, to[1] + l);
      hn::Store(x.z, d, to[2] + l);
    };
    store(p[0], out.at);
    store(normal, out.normal);
    hn::Store(hn::Max(largest(u), largest(v)), d, out.longest + l);
    for (int e = 0; e < 3; ++e) {
      const Vec3 across = cross(p[(e + 1) % 3] - p[e], normal);
      const Vec3 out_of =
          (hn::Set(d, 1.0) / hn::Max(length_bound(across), hn::Set(d, 1e-300))) * across;
      store(out_of, out.edge[e]);
      hn::Store(max3(dot(out_of, p[0]), dot(out_of, p[1]), dot(out_of, p[2])), d,
                out.edge_offset[e] + l);
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

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
