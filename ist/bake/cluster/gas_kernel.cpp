#include "bake/cluster/gas_kernel.h"

#include <algorithm>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bake/cluster/gas_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, 8>;
using Vector = hn::Vec<Tag>;
using FloatTag = hn::CappedTag<float, kWidth>;
using IntTag = hn::RebindToSigned<FloatTag>;

/// Squared distances of a ball's centre; infinite in unused prototypes.
HWY_INLINE void measure(const Ball& ball, const Prototypes& at, PrototypeValues& distance2) {
  const Tag d;
  const Vector far = hn::Set(d, std::numeric_limits<double>::infinity());
  for (std::size_t p = 0; p < kWidth; p += hn::Lanes(d)) {
    const Vector dx = hn::Set(d, ball.x) - hn::Load(d, at.x.data() + p),
                 dy = hn::Set(d, ball.y) - hn::Load(d, at.y.data() + p),
                 dz = hn::Set(d, ball.z) - hn::Load(d, at.z.data() + p);
    const Vector sum = (dx * dx + dy * dy) + dz * dz;
    const auto is_one = hn::FirstN(d, at.count > p ? at.count - p : 0);
    hn::StoreU(hn::IfThenElse(is_one, sum, far), d, distance2.data() + p);
  }
}

using Keys = std::array<float, kWidth>;
using Ranks = std::array<std::int32_t, kWidth>;

/// Rounds to float, which keeps the order except for new ties.
HWY_INLINE void round(const PrototypeValues& distance2, Keys& keys) {
  const Tag d;
  const hn::Rebind<float, Tag> half;
  for (std::size_t p = 0; p < kWidth; p += hn::Lanes(d))
    hn::Store(hn::DemoteTo(half, hn::Load(d, distance2.data() + p)), half, keys.data() + p);
}

/// The number of smaller keys, for each. Counting beats sorting: no branch depends on the data.
HWY_INLINE void rank(const Keys& keys, std::size_t count, Ranks& ranks) {
  const FloatTag df;
  const IntTag di;
  for (std::size_t p = 0; p < kWidth; p += hn::Lanes(df)) {
    const auto mine = hn::Load(df, keys.data() + p);
    auto less = hn::Zero(di);
    for (std::size_t q = 0; q < count; ++q)
      less = hn::Sub(less, hn::VecFromMask(di, hn::RebindMask(di, hn::Set(df, keys[q]) < mine)));
    hn::Store(less, di, ranks.data() + p);
  }
}

void rank_exactly(const PrototypeValues& distance2, std::size_t count, Ranks& ranks) {
  for (std::size_t p = 0; p < count; ++p) {
    ranks[p] = 0;
    for (std::size_t q = 0; q < count; ++q)
      ranks[p] += q < p ? distance2[q] <= distance2[p] : distance2[q] < distance2[p];
  }
}

GasPull pull_of(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                const Prototypes& at, const PrototypeValues& kernel) {
  const Tag d;
  constexpr std::size_t kAtOnce = 64;
  const auto ranks_of_all = static_cast<std::int32_t>(at.count * (at.count - 1) / 2);
  std::array<Ball, kAtOnce> centres;
  alignas(64) std::array<Keys, kAtOnce> keys;
  alignas(64) std::array<PrototypeValues, kAtOnce> weights;
  alignas(64) PrototypeValues distance2;
  alignas(64) Ranks ranks;
  GasPull pull;
  for (std::size_t first = 0; first < part.size(); first += kAtOnce) {
    const std::size_t size = std::min(kAtOnce, part.size() - first);
    for (std::size_t i = 0; i < size; ++i) {
      centres[i] = balls[part[first + i]];
      measure(centres[i], at, distance2);
      round(distance2, keys[i]);
    }
    for (std::size_t i = 0; i < size; ++i) {
      rank(keys[i], at.count, ranks);
      std::int32_t sum = 0;
      for (std::size_t p = 0; p < at.count; ++p) sum += ranks[p];
      if (sum != ranks_of_all) {  // some are equal
        measure(centres[i], at, distance2);
        rank_exactly(distance2, at.count, ranks);
      }
      const double r = centres[i].r, weight = r * r * r + 1e-30;
      for (std::size_t p = 0; p < at.count; ++p)
        weights[i][p] = kernel[static_cast<std::size_t>(ranks[p])] * weight;
      for (std::size_t p = at.count; p < kWidth; ++p) weights[i][p] = 0;
    }
    for (std::size_t p = 0; p < kWidth; p += hn::Lanes(d)) {
      Vector x = hn::Load(d, pull.x.data() + p), y = hn::Load(d, pull.y.data() + p),
             z = hn::Load(d, pull.z.data() + p), total = hn::Load(d, pull.total.data() + p);
      for (std::size_t i = 0; i < size; ++i) {
        const Vector weight = hn::Load(d, weights[i].data() + p);
        x = x + weight * hn::Set(d, centres[i].x);
        y = y + weight * hn::Set(d, centres[i].y);
        z = z + weight * hn::Set(d, centres[i].z);
        total = total + weight;
      }
      hn::Store(x, d, pull.x.data() + p);
      hn::Store(y, d, pull.y.data() + p);
      hn::Store(z, d, pull.z.data() + p);
      hn::Store(total, d, pull.total.data() + p);
    }
  }
  return pull;
}

void measure_all(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                 const Prototypes& at, PrototypeValues* distances2) {
  for (std::size_t i = 0; i < part.size(); ++i) measure(balls[part[i]], at, distances2[i]);
}

PrototypeValues least_leads(const PrototypeValues* distances2,
                            std::span<const std::uint32_t> members, std::size_t own) {
  const Tag d;
  PrototypeValues least;
  for (std::size_t p = 0; p < kWidth; p += hn::Lanes(d)) {
    Vector lead = hn::Set(d, std::numeric_limits<double>::infinity());
    for (const std::uint32_t i : members)
      lead = hn::Min(lead, hn::LoadU(d, distances2[i].data() + p) - hn::Set(d, distances2[i][own]));
    hn::StoreU(lead, d, least.data() + p);
  }
  return least;
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(pull_of);
HWY_EXPORT(measure_all);
HWY_EXPORT(least_leads);

GasPull pull_of(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                const Prototypes& prototypes, const PrototypeValues& kernel) {
  return HWY_DYNAMIC_DISPATCH(pull_of)(balls, part, prototypes, kernel);
}

void measure_all(std::span<const Ball> balls, std::span<const std::uint32_t> part,
                 const Prototypes& prototypes, PrototypeValues* distances2) {
  HWY_DYNAMIC_DISPATCH(measure_all)(balls, part, prototypes, distances2);
}

PrototypeValues least_leads(const PrototypeValues* distances2,
                            std::span<const std::uint32_t> members, std::size_t own) {
  return HWY_DYNAMIC_DISPATCH(least_leads)(distances2, members, own);
}

}  // namespace ist
#endif
