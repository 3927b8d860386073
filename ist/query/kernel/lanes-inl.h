// Sixteen virtual lanes of float or double on any vector width. Included once per target.

#if defined(IST_QUERY_LANES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_LANES_INL_H_
#undef IST_QUERY_LANES_INL_H_
#else
#define IST_QUERY_LANES_INL_H_
#endif

#include <hwy/highway.h>

#include <cstring>

#include <ist/asset_layout.h>
#include "base/bits.h"
#include "query/kernel/compress_table.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Vectors of up to sixteen lanes.
template <class T>
using LaneTag = hn::CappedTag<T, kWidth>;

template <class T, class D = LaneTag<T>>
HWY_INLINE hn::Vec<D> load_as(D d, const float* from) {
  if constexpr (sizeof(T) == sizeof(float)) {
    return hn::LoadU(d, from);
  } else {
    return hn::PromoteTo(d, hn::LoadU(hn::Rebind<float, D>(), from));
  }
}

template <class T, class D>
HWY_INLINE void store_as(hn::Vec<D> v, D d, T* to) {
  if constexpr (sizeof(T) == sizeof(float)) {
    const hn::Rebind<float, D> df;
    hn::Store(hn::DemoteTo(df, v), df, to);
  } else {
    hn::Store(v, d, to);
  }
}

/// One bit per lane.
template <class D>
HWY_INLINE std::uint32_t mask_bits(D d, hn::Mask<D> mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  std::uint16_t bits;  // x86 and ARM are little-endian, as assets are
  std::memcpy(&bits, bytes, sizeof(bits));
  return hn::Lanes(d) < 16 ? bits & ((1u << hn::Lanes(d)) - 1) : bits;
}

/// The mask of the lowest bits, one per lane.
template <class D>
HWY_INLINE hn::Mask<D> mask_of_bits(D d, std::uint32_t bits) {
  std::uint8_t bytes[8] = {};
  std::memcpy(bytes, &bits, sizeof(bits));
  return hn::LoadMaskBits(d, bytes);
}

/// True if Compress is one instruction. GCC copies the table of the other form at every call.
template <class D>
inline constexpr bool kCompressInstruction = HWY_ARCH_X86&& HWY_TARGET <= HWY_AVX3 &&
                                             sizeof(hn::TFromD<D>) == sizeof(float);

/// Moves the lanes of a mask to the front of vectors.
template <class D, bool = kCompressInstruction<D>>
class Compressor {
 public:
  HWY_INLINE Compressor(D d, hn::Mask<D> mask)
      : from_(lanes_of(kSetBits[mask_bits(d, mask)].data())), count_(hn::CountTrue(d, mask)) {}

  template <class V>
  HWY_INLINE V operator()(V v) const {
    return hn::TableLookupLanes(v, hn::IndicesFromVec(hn::DFromV<V>(), from_));
  }

  HWY_INLINE std::size_t count() const { return count_; }

 private:
  using DI = hn::RebindToUnsigned<D>;
  static HWY_INLINE hn::Vec<DI> lanes_of(const std::uint8_t* numbers) {
    const hn::Rebind<std::uint32_t, DI> d32;
    const hn::Rebind<std::uint8_t, DI> d8;
    const auto narrow = hn::PromoteTo(d32, hn::LoadU(d8, numbers));
    if constexpr (sizeof(hn::TFromD<DI>) == sizeof(std::uint32_t)) {
      return narrow;
    } else {
      return hn::PromoteTo(DI(), narrow);
    }
  }
  hn::Vec<DI> from_;
  std::size_t count_;
};

template <class D>
class Compressor<D, true> {
 public:
  HWY_INLINE Compressor(D d, hn::Mask<D> mask) : mask_(mask), count_(hn::CountTrue(d, mask)) {}

  template <class V>
  HWY_INLINE V operator()(V v) const {
    return hn::Compress(v, hn::RebindMask(hn::DFromV<V>(), mask_));
  }

  HWY_INLINE std::size_t count() const { return count_; }

 private:
  hn::Mask<D> mask_;
  std::size_t count_;
};

/// Writes first + lane for every chosen lane, and perhaps scratch beyond; returns their number.
template <class T, class M>
HWY_INLINE std::size_t append_lanes(LaneTag<T> d, M chosen, std::uint32_t first,
                                    std::uint32_t* out) {
  if constexpr (sizeof(T) == sizeof(float)) {
    const hn::RebindToUnsigned<decltype(d)> du;
    const Compressor compress(d, chosen);
    hn::StoreU(compress(hn::Set(du, first) + hn::Load(du, kLaneNumbers)), du, out);
    return compress.count();
  } else {
    std::size_t count = 0;
    for (const std::uint32_t i : set_bits(mask_bits(d, chosen))) out[count++] = first + i;
    return count;
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
