#pragma once

#include <ist/asset_layout.h>

#include <cmath>

#include "query/base/pair_place.h"
#include "query/exact/expansion.h"

namespace ist {

/// A box around a solid, unit frame.
struct MeshBox {
  double low[3], high[3];
  double rounding;  ///< of these numbers

  static MeshBox of(const AssetHeader& asset) noexcept {
    MeshBox box = {};
    const double unit = std::ldexp(1.0, asset.exponent);
    for (int k = 0; k < 3; ++k) {
      box.low[k] = (asset.box_lower[k] - asset.centre[k]) / unit;
      box.high[k] = (asset.box_upper[k] - asset.centre[k]) / unit;
      box.rounding +=
          exact::kHalfUnit / unit * (std::abs(asset.box_lower[k]) + std::abs(asset.box_upper[k]));
    }
    return box;
  }
};

/// True if B's box is apart from A's along an axis of A's, by more than `touch` (A's unit frame).
IST_HD inline bool apart_along_axes(const MeshBox& a, const MeshBox& b, const Similarity& a_from_b,
                                    double touch) noexcept {
  double middle[3], half[3], at[3];
  for (int k = 0; k < 3; ++k) {
    middle[k] = 0.5 * (b.low[k] + b.high[k]);
    half[k] = 0.5 * (b.high[k] - b.low[k]);
  }
  a_from_b.apply(middle, at);
  for (int k = 0; k < 3; ++k) {
    const double* const row = a_from_b.m + 3 * k;
    const double reach =
        (std::abs(row[0]) * half[0] + std::abs(row[1]) * half[1]) + std::abs(row[2]) * half[2];
    const double size =
        (std::abs(at[k]) + std::abs(a_from_b.t[k])) + (reach + (a.high[k] - a.low[k]));
    const double pad =
        2 * touch + 2 * (a.rounding + a_from_b.scale * b.rounding) + 32 * exact::kHalfUnit * size;
    if (at[k] - reach > a.high[k] + pad || at[k] + reach < a.low[k] - pad) return true;
  }
  return false;
}

/// True if boxes in double show that two solids neither overlap nor touch. Floats cannot separate
/// the many triangles of parts that are just outside a mate. `touch`: the distance within which
/// solids touch, A's unit frame.
IST_HD inline bool boxes_apart(const MeshBox& a, const MeshBox& b, const PairPlace& place,
                               double touch) noexcept {
  return apart_along_axes(a, b, place.a_from_b, touch) ||
         apart_along_axes(b, a, place.b_from_a, touch * place.b_from_a.scale);
}

}  // namespace ist
