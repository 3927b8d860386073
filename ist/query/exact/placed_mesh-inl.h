// Boxes and triangles of meshes in the other solid's frame, sixteen at a time. Included once per
// target.

#if defined(IST_QUERY_PLACED_MESH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_PLACED_MESH_INL_H_
#undef IST_QUERY_PLACED_MESH_INL_H_
#else
#define IST_QUERY_PLACED_MESH_INL_H_
#endif

#include <algorithm>
#include <cmath>

#include "query/exact/crossing_search.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Relative error of a few float operations.
inline constexpr float kFloatError = 4e-7f;
/// The position of empty boxes. It is not infinite, since infinities would be subtracted from each
/// other.
inline constexpr float kNowhere = 1e30f;

using F = LaneTag<float>;

inline float pad(const Similarity& map, const MeshTree& tree) {
  return placing_pad(map.scale, map.t, tree);
}

inline std::uint32_t used_lanes(const MeshTree& tree, int level, std::uint32_t i) {
  return std::min(kWidth, tree.level[level - 1].count - kWidth * i);
}

inline float lowest(const float* lanes) {
  const F d;
  auto least = hn::Load(d, lanes);
  for (std::size_t l = hn::Lanes(d); l < kWidth; l += hn::Lanes(d))
    least = hn::Min(least, hn::Load(d, lanes + l));
  return hn::GetLane(hn::MinOfLanes(d, least));
}
inline float highest(const float* lanes) {
  const F d;
  auto most = hn::Load(d, lanes);
  for (std::size_t l = hn::Lanes(d); l < kWidth; l += hn::Lanes(d))
    most = hn::Max(most, hn::Load(d, lanes + l));
  return hn::GetLane(hn::MaxOfLanes(d, most));
}

/// The boxes below a box block in the other solid's frame.
inline const PlacedBoxes& placed_boxes(const MeshTree& tree, int level, std::uint32_t i,
                                       const Similarity& map, float pad, PlacedMesh& kept) {
  const std::uint32_t number = tree.level[level].first + i;
  const auto [out, held] = kept.boxes.find(number);
  if (held) return out;
  const BoxBlock& from = tree.level[level].boxes[i];
  const F d;
  float m[9], turn[9], size[9], t[3];
  for (int k = 0; k < 9; ++k) {
    m[k] = static_cast<float>(map.m[k]);
    turn[k] = static_cast<float>(map.m[k] / map.scale);
    size[k] = std::abs(m[k]) * (1 + kFloatError);
  }
  for (int k = 0; k < 3; ++k) t[k] = static_cast<float>(map.t[k]);
  const auto half = hn::Set(d, 0.5f);
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    hn::Vec<F> middle[3], extent[3];
    for (int k = 0; k < 3; ++k) {
      const auto low = hn::Load(d, from.low[k] + l), high = hn::Load(d, from.high[k] + l);
      middle[k] = half * (low + high);
      extent[k] = half * (high - low);
    }
    // Unused lanes have negative extents and stay empty.
    for (int k = 0; k < 3; ++k) {
      const auto c = (hn::Set(d, m[3 * k]) * middle[0] + hn::Set(d, m[3 * k + 1]) * middle[1]) +
                     (hn::Set(d, m[3 * k + 2]) * middle[2] + hn::Set(d, t[k]));
      const auto h =
          (hn::Set(d, size[3 * k]) * extent[0] + hn::Set(d, size[3 * k + 1]) * extent[1]) +
          (hn::Set(d, size[3 * k + 2]) * extent[2] + hn::Set(d, pad));
      hn::Store(c - h, d, out.low[k] + l);
      hn::Store(c + h, d, out.high[k] + l);
    }
    hn::Vec<F> shift = hn::Zero(d);
    for (int k = 0; k < 3; ++k) {
      const auto turned = (hn::Set(d, turn[3 * k]) * hn::Load(d, from.normal[0] + l) +
                           hn::Set(d, turn[3 * k + 1]) * hn::Load(d, from.normal[1] + l)) +
                          hn::Set(d, turn[3 * k + 2]) * hn::Load(d, from.normal[2] + l);
      hn::Store(turned, d, out.normal[k] + l);
      shift = shift + turned * hn::Set(d, t[k]);
    }
    const auto scale = hn::Set(d, static_cast<float>(map.scale)), margin = hn::Set(d, 2 * pad);
    hn::Store((scale * hn::Load(d, from.slab_low + l) + shift) - margin, d, out.slab_low + l);
    hn::Store((scale * hn::Load(d, from.slab_high + l) + shift) + margin, d, out.slab_high + l);
  }
  const std::uint32_t used = used_lanes(tree, level, i);
  for (int k = 0; k < 3; ++k) {
    for (std::uint32_t l = used; l < kWidth; ++l)
      out.low[k][l] = kNowhere, out.high[k][l] = -kNowhere;
    out.all_low[k] = lowest(out.low[k]);
    out.all_high[k] = highest(out.high[k]);
  }
  return out;
}

/// A block's vertices in A's unit frame; `map` is null for A's own.
inline const PlacedVertices& placed_vertices(const MeshTree& tree, std::uint32_t number,
                                             const Similarity* map, PlacedMesh& kept) {
  const auto [out, held] = kept.vertices.find(number);
  if (held) return out;
  const MeshBlock& block = tree.blocks[number];
  for (std::uint32_t v = 0; v < kWidth; ++v) {
    const double* x = tree.vertices + std::size_t{3} * block.vertex[v];
    for (int k = 0; k < 3; ++k) out.at[k][v] = x[k];
  }
  for (std::uint32_t t = 0; t < kWidth; ++t)
    out.corners[t] = static_cast<std::uint16_t>(
        1u << block.corner[0][t] | 1u << block.corner[1][t] | 1u << block.corner[2][t]);
  if (map == nullptr) return out;
  const hn::CappedTag<double, 8> d;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    const auto x = hn::Load(d, out.at[0] + l), y = hn::Load(d, out.at[1] + l),
               z = hn::Load(d, out.at[2] + l);
    for (int k = 0; k < 3; ++k)
      hn::Store(((hn::Set(d, map->m[3 * k]) * x + hn::Set(d, map->m[3 * k + 1]) * y) +
                 hn::Set(d, map->m[3 * k + 2]) * z) +
                    hn::Set(d, map->t[k]),
                d, out.at[k] + l);
  }
  return out;
}

/// A block's triangles in A's unit frame.
inline const PlacedTriangles& placed_triangles(const MeshTree& tree, std::uint32_t number,
                                               const Similarity* map, PlacedMesh& kept) {
  const auto [out, held] = kept.triangles.find(number);
  if (held) return out;
  const MeshBlock& block = tree.blocks[number];
  const PlacedVertices& vertices = placed_vertices(tree, number, map, kept);
  const hn::CappedTag<double, 8> dd;
  const hn::Rebind<float, decltype(dd)> df;
  alignas(64) float at[3][kWidth];
  for (int k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(dd))
      hn::Store(hn::DemoteTo(df, hn::Load(dd, vertices.at[k] + l)), df, at[k] + l);
  const F d;
  float reach = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    out.all_low[k] = lowest(at[k]);
    out.all_high[k] = highest(at[k]);
    reach = std::max({reach, std::abs(out.all_low[k]), std::abs(out.all_high[k])});
    size += (out.all_high[k] - out.all_low[k]) * (out.all_high[k] - out.all_low[k]);
  }
  for (int k = 0; k < 3; ++k) {
    out.all_low[k] -= reach * 2e-7f;
    out.all_high[k] += reach * 2e-7f;
  }
  const hn::RebindToSigned<F> di;
  for (int c = 0; c < 3; ++c)
    for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
      const auto from_lane =
          hn::PromoteTo(di, hn::LoadU(hn::Rebind<std::uint8_t, F>(), block.corner[c] + l));
      for (int k = 0; k < 3; ++k) {
        if constexpr (hn::MaxLanes(F()) == kWidth)
          hn::Store(hn::TableLookupLanes(hn::Load(d, at[k]), hn::IndicesFromVec(d, from_lane)), d,
                    out.corner[c][k] + l);
        else
          hn::Store(hn::GatherIndex(d, at[k], from_lane), d, out.corner[c][k] + l);
      }
    }
  out.reach = reach;
  out.size = std::sqrt(size) * (1 + kFloatError) + reach * kFloatError;
  const auto outward = hn::Set(d, reach * 2e-7f);
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    hn::Vec<F> u[3], v[3], n[3];
    for (int k = 0; k < 3; ++k) {
      const auto p = hn::Load(d, out.corner[0][k] + l), q = hn::Load(d, out.corner[1][k] + l),
                 r = hn::Load(d, out.corner[2][k] + l);
      hn::Store(hn::Min(p, hn::Min(q, r)) - outward, d, out.low[k] + l);
      hn::Store(hn::Max(p, hn::Max(q, r)) + outward, d, out.high[k] + l);
      u[k] = q - p;
      v[k] = r - p;
    }
    for (int k = 0; k < 3; ++k) {
      const int i = (k + 1) % 3, j = (k + 2) % 3;
      n[k] = u[i] * v[j] - u[j] * v[i];
      hn::Store(n[k], d, out.normal[k] + l);
    }
    hn::Store(
        (n[0] * hn::Load(d, out.corner[0][0] + l) + n[1] * hn::Load(d, out.corner[0][1] + l)) +
            n[2] * hn::Load(d, out.corner[0][2] + l),
        d, out.offset + l);
    // Corners are rounded, so sides have an error relative to the reach, and normals that error
    // times the other side. The rounding of a product of sides comes on top.
    const auto length = [](const hn::Vec<F>(&x)[3]) {
      return hn::Abs(x[0]) + (hn::Abs(x[1]) + hn::Abs(x[2]));
    };
    const auto lu = length(u), lv = length(v);
    hn::Store(length(n), d, out.length + l);
    hn::Store(hn::Set(d, 6e-7f) * (hn::Set(d, reach) * hn::Max(lu, lv) + lu * lv), d,
              out.slack + l);
  }
  for (int k = 0; k < 3; ++k)
    for (std::uint32_t l = block.triangles; l < kWidth; ++l)
      out.low[k][l] = kNowhere, out.high[k][l] = -kNowhere;
  return out;
}

/// The boxes out of sixteen that intersect one, a bit each.
HWY_INLINE std::uint32_t meeting(const float (&low)[3][kWidth], const float (&high)[3][kWidth],
                                 const float* one_low, const float* one_high) {
  const F d;
  std::uint32_t bits = 0;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    auto mask = hn::And(hn::Load(d, low[0] + l) <= hn::Set(d, one_high[0]),
                        hn::Load(d, high[0] + l) >= hn::Set(d, one_low[0]));
    for (int k = 1; k < 3; ++k)
      mask = hn::And(mask, hn::And(hn::Load(d, low[k] + l) <= hn::Set(d, one_high[k]),
                                   hn::Load(d, high[k] + l) >= hn::Set(d, one_low[k])));
    bits |= mask_bits(d, mask) << l;
  }
  return bits;
}

/// Places each part of a mesh that a search visits once.
class PlacedMeshes {
 public:
  PlacedMeshes(const CrossingSearch& search, ExactScratch& scratch)
      : search_(search), scratch_(scratch) {}

  const PlacedVertices& vertices(bool of_b, std::uint32_t number) {
    return of_b ? placed_vertices(*search_.b, number, &search_.a_from_b, *scratch_.placed_b)
                : placed_vertices(*search_.a, number, nullptr, *scratch_.placed_a);
  }
  const PlacedTriangles& triangles(bool of_b, std::uint32_t number) {
    return of_b ? placed_triangles(*search_.b, number, &search_.a_from_b, *scratch_.placed_b)
                : placed_triangles(*search_.a, number, nullptr, *scratch_.placed_a);
  }

 private:
  const CrossingSearch& search_;
  ExactScratch& scratch_;
};

struct OneBox {
  float low[3], high[3];
  OneBox(const float (&l)[3], const float (&h)[3], float margin) {
    for (int k = 0; k < 3; ++k) low[k] = l[k] - margin, high[k] = h[k] + margin;
  }
  OneBox(const float (&l)[3][kWidth], const float (&h)[3][kWidth], std::uint32_t lane,
         float margin) {
    for (int k = 0; k < 3; ++k) low[k] = l[k][lane] - margin, high[k] = h[k][lane] + margin;
  }
};

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
