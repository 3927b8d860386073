#include "query/exact/overlap_terms.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/overlap_terms.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

HWY_INLINE void store(V v, double* to) { hn::Store(v, D(), to); }
HWY_INLINE void store(const Vec3& v, double (*to)[8], std::size_t l) {
  store(v.x, to[0] + l);
  store(v.y, to[1] + l);
  store(v.z, to[2] + l);
}

HWY_INLINE void store(const PieceTerms& terms, ExactTerms& out, std::size_t l) {
  store(terms.six_volumes[0], out.six_volumes[0] + l);
  store(terms.rounding, out.rounding + l);
  store(terms.moment, out.moment, l);
}

/// True where an end's edge is B's, for crossings from `i` on.
HWY_INLINE Mask ends_by_b(const Crossings& crossings, int e, std::size_t i) {
  const D d;
  const V edge = hn::LoadU(d, crossings.end(e, Crossings::kEdge) + i), eight = hn::Set(d, 8.0);
  return hn::IfThenElse(edge >= eight, edge - eight, edge) >= hn::Set(d, 3.0);
}

void sum_crossings(const Crossings& crossings, std::uint32_t first, const exact::Point& origin,
                   ExactTerms& out) {
  const D d;
  const Vec3 o = {hn::Set(d, origin.x), hn::Set(d, origin.y), hn::Set(d, origin.z)};
  for (std::size_t l = 0; l < 8; l += hn::Lanes(d)) {
    const auto load = [&](const double* from) { return hn::LoadU(d, from + first + l); };
    const auto vector = [&](int e, int number) -> Vec3 {
      return {load(crossings.end(e, number)), load(crossings.end(e, number + 1)),
              load(crossings.end(e, number + 2))};
    };
    const auto apex = [&](int side) -> Vec3 {
      return {load(crossings.apex(side, 0)), load(crossings.apex(side, 1)),
              load(crossings.apex(side, 2))};
    };
    const auto by_b = [&](int e) { return ends_by_b(crossings, e, first + l); };
    PieceTerms terms;
    segment_terms({vector(0, Crossings::kFrom) - o, vector(1, Crossings::kFrom) - o},
                  {vector(0, Crossings::kOffset), vector(1, Crossings::kOffset)},
                  {apex(0), apex(1)}, {by_b(0), by_b(1)},
                  {load(crossings.opposite(0)), load(crossings.opposite(1))},
                  {load(crossings.end(0, Crossings::kHeightError)),
                   load(crossings.end(1, Crossings::kHeightError))},
                  terms);
    store(terms, out, l);
    for (int e = 1; e < 3; ++e) store(terms.six_volumes[e], out.six_volumes[e] + l);
    store(terms.force, out.force, l);
    store(terms.torque, out.torque, l);
  }
}

void sum_octant_pieces(const Crossings& crossings, std::uint32_t first, const OctantView& view,
                       OctantPieces& out) {
  const D d;
  const auto all = [&](const exact::Point& x) -> Vec3 {
    return {hn::Set(d, x.x), hn::Set(d, x.y), hn::Set(d, x.z)};
  };
  const Vec3 origin = all(view.origin),
             axis[3] = {all(view.axis[0]), all(view.axis[1]), all(view.axis[2])};
  const V once = hn::Set(d, 1.0), zero = hn::Zero(d);
  for (std::size_t l = 0; l < 8; l += hn::Lanes(d)) {
    const std::size_t i = first + l;
    const Vec3 centre = {hn::Load(d, view.centre[0] + l), hn::Load(d, view.centre[1] + l),
                         hn::Load(d, view.centre[2] + l)};
    const auto load = [&](const auto& number) -> Vec3 {
      return {hn::LoadU(d, number(0) + i), hn::LoadU(d, number(1) + i),
              hn::LoadU(d, number(2) + i)};
    };
    Vec3 corner[6];
    const auto bytes = [&](V numbers, std::uint8_t* to) {
      hn::StoreU(hn::DemoteTo(hn::Rebind<std::uint8_t, D>(),
                              hn::DemoteTo(hn::Rebind<std::int32_t, D>(), numbers)),
                 hn::Rebind<std::uint8_t, D>(), to + l);
    };
    const auto see = [&](int c, const Vec3& x) {
      const Vec3 from = x - centre;
      corner[c] = {dot(axis[0], from), dot(axis[1], from), dot(axis[2], from)};
      store(corner[c], out.at[c], l);
      const auto above = [&](V at, double bit) {
        return hn::IfThenElseZero(at >= zero, hn::Set(d, bit));
      };
      bytes((above(corner[c].x, 1.0) + above(corner[c].y, 2.0)) + above(corner[c].z, 4.0),
            out.octant[c]);
    };
    for (int s = 0; s < 2; ++s) see(s, load([&](int k) { return crossings.apex(s, k); }));
    for (int e = 0; e < 2; ++e) {
      const Vec3 near =
          load([&](int k) { return crossings.end(e, Crossings::kFrom + k); }) - origin;
      see(OctantPieces::kEnd + e,
          near + load([&](int k) { return crossings.end(e, Crossings::kOffset + k); }));
      see(OctantPieces::kNear + e, near);
    }
    const Mask by_b[2] = {ends_by_b(crossings, 0, i), ends_by_b(crossings, 1, i)};
    const V times[4] = {once, once, hn::LoadU(d, crossings.opposite(0) + i),
                        hn::LoadU(d, crossings.opposite(1) + i)};
    OctantTriangles found;
    octant_triangles(corner, by_b, {times[2], times[3]}, found);
    for (int t = 0; t < OctantPieces::kTriangles; ++t) {
      const OctantTerms& terms = found.of[t];
      bytes(t < 2 ? (t == 1 ? once : zero) : hn::IfThenElseZero(by_b[t - 2], once), out.of_b[t]);
      store(times[t], out.times[t] + l);
      store(terms.six_volumes, out.term[t][0] + l);
      store(terms.moment, out.term[t] + 1, l);
      store(terms.area, out.term[t] + 4, l);
      store(terms.torque, out.term[t] + 7, l);
    }
    store(found.all.six_volumes, out.sum[0] + l);
    const Vec3* const sums[] = {&found.all.moment, &found.area[0], &found.area[1],
                                &found.all.torque};
    for (int n = 0; n < 4; ++n) store(*sums[n], out.sum + 1 + 3 * n, l);
  }
}

/// Picks the numbers of a triangle's corner from those of a block's sixteen vertices.
HWY_INLINE V pick(const double* of_vertex, const std::uint8_t* local) {
  const D d;
  if constexpr (hn::MaxLanes(D()) == 8) {
    const hn::RebindToUnsigned<D> du;
    const auto number =
        hn::PromoteTo(du, hn::PromoteTo(hn::Rebind<std::uint32_t, D>(),
                                        hn::LoadU(hn::Rebind<std::uint8_t, D>(), local)));
    const auto lanes = hn::IndicesFromVec(d, hn::And(number, hn::Set(du, 7)));
    const auto low = hn::RebindMask(d, number < hn::Set(du, 8));
    return hn::IfThenElse(low, hn::TableLookupLanes(hn::LoadU(d, of_vertex), lanes),
                          hn::TableLookupLanes(hn::LoadU(d, of_vertex + 8), lanes));
  } else {
    HWY_ALIGN double lanes[hn::MaxLanes(D())];
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) lanes[i] = of_vertex[local[i]];
    return hn::Load(d, lanes);
  }
}

void place_block_fans(const PlacedVertices& placed, const MeshBlock& mesh,
                      const exact::Point& origin, CrossedBlock& out) {
  const D d;
  const hn::Rebind<std::uint8_t, D> bytes;
  const hn::Rebind<std::int32_t, D> integers;
  const Vec3 o = {hn::Set(d, origin.x), hn::Set(d, origin.y), hn::Set(d, origin.z)};
  alignas(64) double away[kWidth];
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    const Vec3 at = Vec3{hn::Load(d, placed.at[0] + l), hn::Load(d, placed.at[1] + l),
                         hn::Load(d, placed.at[2] + l)} -
                    o;
    hn::StoreU(at.x, d, out.vertex[0] + l);
    hn::StoreU(at.y, d, out.vertex[1] + l);
    hn::StoreU(at.z, d, out.vertex[2] + l);
    hn::Store(length_bound(at), d, away + l);
  }
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    const V first = pick(away, mesh.corner[0] + l), second = pick(away, mesh.corner[1] + l),
            third = pick(away, mesh.corner[2] + l);
    const V nearest = apex_of(first, second, third);
    const auto apex = hn::DemoteTo(bytes, hn::DemoteTo(integers, nearest));
    hn::StoreU(apex, bytes, out.apex + l);
    const auto is_third = apex == hn::Set(bytes, 2), is_second = apex == hn::Set(bytes, 1);
    for (int k = 0; k < 3; ++k) {
      const auto corner = [&](int c) { return hn::LoadU(bytes, mesh.corner[(k + c) % 3] + l); };
      hn::StoreU(
          hn::IfThenElse(is_third, corner(2), hn::IfThenElse(is_second, corner(1), corner(0))),
          bytes, out.fan[k] + l);
    }
  }
}

void sum_triangles(const CrossedBlock& crossed, const std::int8_t (&whole)[kWidth], int h,
                   ExactTerms& out) {
  const D d;
  alignas(64) double times[8];
  for (int i = 0; i < 8; ++i) times[i] = whole[8 * h + i];
  for (std::size_t l = 0; l < 8; l += hn::Lanes(d)) {
    const auto corner = [&](int k) -> Vec3 {
      const std::uint8_t* const local = crossed.fan[k] + 8 * h + l;
      return {pick(crossed.vertex[0], local), pick(crossed.vertex[1], local),
              pick(crossed.vertex[2], local)};
    };
    PieceTerms terms;
    cone_terms(hn::Load(d, times + l), corner(0), corner(1), corner(2), terms);
    store(terms, out, l);
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(place_block_fans);
HWY_EXPORT(sum_crossings);
HWY_EXPORT(sum_octant_pieces);
HWY_EXPORT(sum_triangles);

void place_fans(const PlacedVertices& placed, const MeshBlock& mesh, const exact::Point& origin,
                CrossedBlock& out) noexcept {
  HWY_DYNAMIC_DISPATCH(place_block_fans)(placed, mesh, origin, out);
}

void crossing_terms(const Crossings& crossings, std::uint32_t first, const exact::Point& origin,
                    ExactTerms& out) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_crossings)(crossings, first, origin, out);
}

void octant_pieces(const Crossings& crossings, std::uint32_t first, const OctantView& view,
                   OctantPieces& out) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_octant_pieces)(crossings, first, view, out);
}

void triangle_terms(const CrossedBlock& crossed, const std::int8_t (&whole)[kWidth], int h,
                    ExactTerms& out) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_triangles)(crossed, whole, h, out);
}

}  // namespace ist
#endif
