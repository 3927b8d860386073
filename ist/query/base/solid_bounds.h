#pragma once

#include <algorithm>
#include <cmath>

#include <ist/query.h>

#include <ist/asset_layout.h>

namespace ist {

/// [u³] An upper bound.
inline double volume_of(const PlacedAsset& placed) noexcept {
  const AssetHeader& asset = placed.asset.header();
  return std::ldexp(asset.volume + asset.volume_error, 3 * asset.exponent) *
         (placed.scale * placed.scale * placed.scale);
}

inline double smaller_volume(const PlacedAsset& a, const PlacedAsset& b) noexcept {
  return std::min(volume_of(a), volume_of(b));
}

/// Bounds the volume by 0 and the smaller solid's volume, or by the spheres' sum if that is larger.
inline void bound_by_solids(const PlacedAsset& a, const PlacedAsset& b,
                            Penetration& answer) noexcept {
  answer.volume_min = 0;
  answer.volume_max = smaller_volume(a, b) * (1 + 1e-12);
  if (!std::isnan(answer.volume)) answer.volume_max = std::max(answer.volume_max, answer.volume);
}

}  // namespace ist
