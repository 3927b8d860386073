// Sixteen virtual lanes of float or double on any vector width: included once a target.

#if defined(IST_QUERY_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_LANES_INL_H_
#undef IST_QUERY_LANES_INL_H_
#else
#define IST_QUERY_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include "query/asset_layout.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// The widest vectors that sixteen lanes fill.
template <class T>
using LaneTag = hn::CappedTag<T, kWidth>;

/// Loads floats as T.
template <class T, class D = LaneTag<T>>
HWY_INLINE hn::Vec<D> load_as(D d, const float* from) {
  if constexpr (sizeof(T) == sizeof(float)) {
    return hn::LoadU(d, from);
  } else {
    return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, D>(), from));
  }
}

/// One bit a lane.
template <class D>
HWY_INLINE std::uint32_t mask_bits(D d, hn::Mask<D> mask) {
  alignas(8) std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  const std::uint32_t bits =
      static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
  return bits & ((1u << hn::Lanes(d)) - 1);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
