#include "query/exact/overlap_terms.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/exact/overlap_terms.cpp"
#include <hwy/foreach_target.h>

#include "query/exact/points-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

HWY_INLINE void store(V v, double* to) { hn::Store(v, D(), to); }
HWY_INLINE void store(const Vec3& v, double (&to)[3][8], std::size_t l) {
  store(v.x, to[0] + l);
  store(v.y, to[1] + l);
  store(v.z, to[2] + l);
}

HWY_INLINE void store(const PieceTerms& terms, ExactTerms& out, std::size_t l) {
  store(terms.six_volumes[0], out.six_volumes[0] + l);
  store(terms.rounding, out.rounding + l);
  store(terms.moment, out.moment, l);
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
    const auto by_b = [&](int e) {
      const V edge = load(crossings.end(e, Crossings::kEdge)), eight = hn::Set(d, 8.0);
      return hn::IfThenElse(edge >= eight, edge - eight, edge) >= hn::Set(d, 3.0);
    };
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

/// Numbers of a block's sixteen vertices, of a corner of some triangles.
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
HWY_EXPORT(sum_triangles);

void place_fans(const PlacedVertices& placed, const MeshBlock& mesh, const exact::Point& origin,
                CrossedBlock& out) noexcept {
  HWY_DYNAMIC_DISPATCH(place_block_fans)(placed, mesh, origin, out);
}

void crossing_terms(const Crossings& crossings, std::uint32_t first, const exact::Point& origin,
                    ExactTerms& out) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_crossings)(crossings, first, origin, out);
}

void triangle_terms(const CrossedBlock& crossed, const std::int8_t (&whole)[kWidth], int h,
                    ExactTerms& out) noexcept {
  HWY_DYNAMIC_DISPATCH(sum_triangles)(crossed, whole, h, out);
}

}  // namespace ist
#endif
