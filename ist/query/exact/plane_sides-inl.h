// On which sides of a triangle's plane the vertices of a block lie: included once a target.

#if defined(IST_QUERY_PLANE_SIDES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PLANE_SIDES_INL_H_
#undef IST_QUERY_PLANE_SIDES_INL_H_
#else
#define IST_QUERY_PLANE_SIDES_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "query/exact/crossing_search.h"
#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// A bit a vertex that lies above or below.
struct PlaneSides {
  std::uint32_t above = 0, below = 0;
};

/// What a vertex is above or below by: what doubles round; or so much that it stays there wherever
/// points move by the room, or B by what the search reaches.
enum class Margin { rounding, room, reach };

/// A plane whose points are seen from one of them.
struct SeenPlane {
  Vec3 at, normal, size;

  SeenPlane(const PlacedPlanes& planes, std::uint32_t t)
      : at(one(planes.at, t)), normal(one(planes.normal, t)), size(one(planes.size, t)) {}

  /// Vertices l … of a block: heights, times the length of the normal, and what these may be off by.
  HWY_INLINE V height(const PlacedVertices& vertices, std::size_t l, V& error, Vec3& r) const {
    const D d;
    r = Vec3{hn::Load(d, vertices.at[0] + l), hn::Load(d, vertices.at[1] + l),
             hn::Load(d, vertices.at[2] + l)} -
        at;
    error = hn::Set(d, exact::kFilter) * absolute_dot(r, size);
    return dot(r, normal);
  }

 private:
  static Vec3 one(const double (&from)[3][kWidth], std::uint32_t t) {
    const D d;
    return {hn::Set(d, from[0][t]), hn::Set(d, from[1][t]), hn::Set(d, from[2][t])};
  }
};

/// Of vertices of the other solid, seen from the plane of triangle t of a block; above and below what
/// lies between `low` and `high`. `aside`: what they move by.
HWY_INLINE PlaneSides sides_of(const PlacedVertices& vertices, const PlacedPlanes& planes,
                               std::uint32_t t, double low, double high,
                               const exact::Point& aside, Margin margin, double by) {
  const D d;
  const SeenPlane plane(planes, t);
  const Vec3 moved = {hn::Set(d, aside.x), hn::Set(d, aside.y), hn::Set(d, aside.z)};
  const V shift = dot(moved, plane.normal);
  V least = hn::Set(d, exact::kFilter) * absolute_dot(moved, plane.size);
  if (margin == Margin::reach) least = least + hn::Set(d, by) * length_bound(plane.normal);
  const V bottom = (hn::Set(d, low) - shift) - least, top = (hn::Set(d, high) - shift) + least;
  const V longest = hn::Set(d, planes.longest[t] + by), two = hn::Set(d, 2.0);
  const V moves = hn::Set(d, 6 * by) * longest;
  PlaneSides out;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    V error;
    Vec3 r;
    const V height = plane.height(vertices, l, error, r);
    // Six products of three numbers.
    if (margin == Margin::room) error = error + moves * (two * largest(r) + longest);
    out.above |= mask_bits(d, height - error > top) << l;
    out.below |= mask_bits(d, height + error < bottom) << l;
  }
  return out;
}

/// The planes of a block.
inline const PlacedPlanes& placed_planes(const MeshTree& tree, std::uint32_t number,
                                         const Similarity* map, PlacedMesh& kept) {
  const auto [out, held] = kept.planes.find(number);
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
    const auto store = [&](const Vec3& x, double (&to)[3][kWidth]) {
      hn::Store(x.x, d, to[0] + l);
      hn::Store(x.y, d, to[1] + l);
      hn::Store(x.z, d, to[2] + l);
    };
    store(p[0], out.at);
    store(normal, out.normal);
    store(size, out.size);
    hn::Store(hn::Max(largest(u), largest(v)), d, out.longest + l);
    hn::Store(length_bound(normal), d, length + l);
  }
  out.widest =
      static_cast<std::uint32_t>(std::max_element(length, length + block.triangles) - length);
  const SeenPlane plane(out, out.widest);
  V low = hn::Set(d, HUGE_VAL), high = hn::Set(d, -HUGE_VAL);
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    V error;
    Vec3 r;
    const V height = plane.height(vertices, l, error, r);
    low = hn::Min(low, height - error);
    high = hn::Max(high, height + error);
  }
  out.low = hn::GetLane(hn::MinOfLanes(d, low));
  out.high = hn::GetLane(hn::MaxOfLanes(d, high));
  return out;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
