// Bounds of the distances of sixteen boxes of a mesh from a box of the other. Included once per
// target.

#if defined(IST_QUERY_BOX_GAPS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_BOX_GAPS_INL_H_
#undef IST_QUERY_BOX_GAPS_INL_H_
#else
#define IST_QUERY_BOX_GAPS_INL_H_
#endif

#include <algorithm>
#include <limits>

#include "query/exact/box_gaps.h"
#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// The longest side of a node's box.
inline double size_of(const MeshTree& mesh, int level, std::uint32_t i) {
  float size = 0;
  for (int k = 0; k < 3; ++k) {
    if (level == mesh.top) {
      size = std::max(size, mesh.high[k] - mesh.low[k]);
    } else {
      const BoxBlock& boxes = mesh.level[level + 1].boxes[i / kWidth];
      size = std::max(size, boxes.high[k][i % kWidth] - boxes.low[k][i % kWidth]);
    }
  }
  return double{size};
}

#define IST_FORMULA HWY_INLINE
#include "query/exact/box_gap_formulas-inl.h"
#undef IST_FORMULA

template <class Number>
struct BoxLanes {
  using T = Number;
  using V = hn::Vec<LaneTag<T>>;
  static HWY_INLINE V set(T x) { return hn::Set(LaneTag<T>(), x); }
  static HWY_INLINE V magnitude(V x) { return hn::Abs(x); }
  static HWY_INLINE V lesser(V x, V y) { return hn::Min(x, y); }
  static HWY_INLINE V greater(V x, V y) { return hn::Max(x, y); }
  static HWY_INLINE bool all(hn::Mask<LaneTag<T>> x) { return hn::AllTrue(LaneTag<T>(), x); }
};

/// The boxes out of sixteen that may be within `limit`, squared, of box `one` of the other mesh, a
/// bit each, with lower bounds of their squared distances and their largest gaps along an axis.
template <class T>
HWY_INLINE std::uint32_t measure_sixteen(const BoxLook<T, double>& look, const BoxBlock& boxes,
                                         const SeenBox<double>& one, double limit,
                                         T (&squared)[kWidth], T (&apart)[kWidth]) {
  const LaneTag<T> d;
  using V = hn::Vec<decltype(d)>;
  const V beyond =
      hn::Set(d, static_cast<T>(std::min(limit, double{std::numeric_limits<T>::max()} / 4) *
                                (1 + 4 * kGapRounding<T>)));
  std::uint32_t within = 0;
  for (std::size_t l = 0; l < kWidth; l += hn::Lanes(d)) {
    LaneBox<V> box;
    for (int i = 0; i < 3; ++i) {
      box.low[i] = load_as<T>(d, boxes.low[i] + l), box.high[i] = load_as<T>(d, boxes.high[i] + l);
      box.normal[i] = load_as<T>(d, boxes.normal[i] + l);
    }
    box.slab_low = load_as<T>(d, boxes.slab_low + l);
    box.slab_high = load_as<T>(d, boxes.slab_high + l);
    V least, largest;
    if (!measure_boxes<BoxLanes<T>>(look, one, box, beyond, least, largest)) continue;
    hn::Store(largest, d, apart + l);
    hn::Store(hn::Set(d, static_cast<T>(1 - kGapRounding<T>)) * least, d, squared + l);
    within |= mask_bits(d, least <= beyond) << l;
  }
  return within;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
