// Lists of lenses of any pairs of blocks. Included once per target.

#if defined(IST_QUERY_LENS_LIST_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef IST_QUERY_LENS_LIST_INL_H_
#undef IST_QUERY_LENS_LIST_INL_H_
#else
#define IST_QUERY_LENS_LIST_INL_H_
#endif

#include <limits>

#include "query/kernel/lanes-inl.h"
#include "query/kernel/leaf_kernel.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Lenses are summed as soon as there are this many.
inline constexpr std::size_t kFullList = 8 * kWidth;
inline constexpr std::size_t kListCapacity = kFullList + 2 * kWidth;

/// Candidate pairs of spheres i, j, in A's axes. A store writes a whole vector, of which only some
/// lanes count, so the arrays are longer than the list.
template <class T>
struct alignas(64) LensList {
  T dx[kListCapacity], dy[kListCapacity], dz[kListCapacity];  ///< centre of j less centre of i
  T rj[kListCapacity], ri[kListCapacity];
  T lx[kListCapacity], ly[kListCapacity],
      lz[kListCapacity];             ///< centre of i, relative to B's origin
  T error[kListCapacity];            ///< of the distance; negative if i is B's
  std::uint32_t bin[kListCapacity];  ///< of LeafBinning::sums
  std::size_t size = 0;
};

/// The sums of one list, in sixteen lanes.
template <class T>
struct alignas(64) LaneSums : LensSums<T[kWidth]> {};

/// visit(sum of each) for every member of LensSums.
template <class Visit, class... Sums>
HWY_INLINE void for_each_sum(const Visit& visit, Sums&... sums) {
  visit(sums.caps...);
  visit(sums.error...);
  for (int k = 0; k < 3; ++k) {
    visit(sums.force[k]...);
    visit(sums.torque[k]...);
    visit(sums.moment[k]...);
  }
}

/// total[l] += from[l] + from[l + 8], the last additions in double.
template <class T>
HWY_INLINE void fold(const T* from, double* total) {
  const hn::CappedTag<double, kSumLanes> d;
  for (std::size_t lane = 0; lane < kSumLanes; lane += hn::Lanes(d)) {
    hn::Vec<decltype(d)> sum;
    if constexpr (sizeof(T) == sizeof(float)) {
      const hn::Rebind<float, decltype(d)> df;
      sum = hn::PromoteTo(d, hn::Load(df, from + lane) + hn::Load(df, from + lane + kSumLanes));
    } else {
      sum = hn::Load(d, from + lane) + hn::Load(d, from + lane + kSumLanes);
    }
    hn::Store(hn::Load(d, total + lane) + sum, d, total + lane);
  }
}

/// Stores vectors as lanes [lane, …) of the sums.
template <class T, class D, class V>
HWY_INLINE void store(const LensSums<V>& from, D d, std::size_t lane, LaneSums<T>& to) {
  for_each_sum([&](const V& v, T* lanes) { hn::Store(v, d, lanes + lane); }, from, to);
}

/// lens() of lens.h for vectors, without branches. Counts the lenses that are not empty.
template <class T, class D, class V = hn::Vec<D>>
HWY_INLINE LensSums<V> lens_vectors(const LensList<T>& list, D d, std::size_t at,
                                    std::uint32_t& lenses) {
  const V zero = hn::Zero(d);
  const V two = hn::Set(d, T(2));
  const V three = hn::Set(d, T(3));
  const V tiny = hn::Set(d, std::numeric_limits<T>::min());
  const V dx = hn::Load(d, list.dx + at);
  const V dy = hn::Load(d, list.dy + at);
  const V dz = hn::Load(d, list.dz + at);
  const V ri = hn::Load(d, list.ri + at);
  const V rj = hn::Load(d, list.rj + at);
  const V signed_error = hn::Load(d, list.error + at);
  const V distance = hn::Sqrt((dx * dx + dy * dy) + dz * dz);
  const V a = hn::Max(ri, rj);
  const V b = hn::Min(ri, rj);
  const V g = (a - distance) + b;
  const V step = a - b;
  const V f = hn::IfThenElse(step <= b, distance - step, (distance - a) + b);
  const V e = step + distance;
  const V g0 = hn::Max(g, zero);
  const auto contained = hn::Or(f <= zero, distance < tiny);
  const V inverse = hn::Set(d, T(0.5)) / hn::Max(distance, tiny);
  const V ha = hn::IfThenZeroElse(contained, (f * inverse) * g0);
  const V diameter = two * b;
  const V hb = hn::IfThenElse(contained, diameter, hn::Min((e * inverse) * g0, diameter));
  const V large = (ha * ha) * (three * a - ha);
  const V small = (hb * hb) * (three * b - hb);
  const V circle = ha * (two * a - ha);
  const V cap_j = hn::IfThenElse(ri > rj, small, large);
  const V pull = hn::CopySignToAbs(circle * inverse, signed_error);
  // Within rounding of tangency the circle is meaningless; b² bounds it at any distance. Elsewhere
  // it is concave between the tangencies, so within ± error it is at most doubled.
  const V error = hn::Abs(signed_error);
  const V near = hn::Abs(hn::Min(g, f));
  const V lx = hn::Load(d, list.lx + at);
  const V ly = hn::Load(d, list.ly + at);
  const V lz = hn::Load(d, list.lz + at);
  LensSums<V> lens;
  lens.caps = large + small;
  lens.error = error * hn::IfThenElse(near < error, b * b, circle);
  lens.force[0] = pull * dx;
  lens.force[1] = pull * dy;
  lens.force[2] = pull * dz;
  // The force acts along the line of centres, so at the centre of i.
  lens.torque[0] = ly * lens.force[2] - lz * lens.force[1];
  lens.torque[1] = lz * lens.force[0] - lx * lens.force[2];
  lens.torque[2] = lx * lens.force[1] - ly * lens.force[0];
  lens.moment[0] = lens.caps * lx + cap_j * dx;
  lens.moment[1] = lens.caps * ly + cap_j * dy;
  lens.moment[2] = lens.caps * lz + cap_j * dz;
  lenses += static_cast<std::uint32_t>(hn::CountTrue(d, lens.caps > zero));
  return lens;
}

/// Adds each of lenses [0, 16 · batches) to the sums of its bin, in order.
template <class T>
HWY_INLINE void bin_lenses(const LensList<T>& list, std::size_t batches, LeafSums* bins) {
  const LaneTag<T> d;
  LaneSums<T> lenses;
  std::uint32_t counted = 0;
  for (std::size_t at = 0; at < kWidth * batches; at += kWidth) {
    for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d))
      store<T>(lens_vectors<T>(list, d, at + lane, counted), d, lane, lenses);
    for (std::size_t lane = 0; lane < kWidth; ++lane)
      for_each_sum([&](const T* from, double* bin) { *bin += static_cast<double>(from[lane]); },
                   lenses, bins[list.bin[at + lane]]);
  }
}

/// Adds lenses [0, 16 · batches) to sums and bins, in the same order for every vector width.
template <class T>
HWY_INLINE void sum_lenses(const LensList<T>& list, std::size_t batches, LeafSums& sums,
                           LeafSums* bins) {
  const LaneTag<T> d;
  using V = hn::Vec<decltype(d)>;
  LaneSums<T> lanes;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    LensSums<V> total;
    for_each_sum([&](V& sum) { sum = hn::Zero(d); }, total);
    for (std::size_t i = 0; i < batches; ++i) {
      const LensSums<V> lens = lens_vectors<T>(list, d, kWidth * i + lane, sums.lenses);
      for_each_sum([](V& sum, const V& x) { sum = sum + x; }, total, lens);
    }
    store<T>(total, d, lane, lanes);
  }
  for_each_sum([](const T* from, double* to) { fold(from, to); }, lanes, sums);
  if (bins != nullptr) bin_lenses(list, batches, bins);
}

/// Sums a full list's whole batches and keeps the rest.
template <class T>
HWY_INLINE void sum_full_list(LensList<T>& list, LeafSums& sums, LeafSums* bins) {
  sum_lenses(list, kFullList / kWidth, sums, bins);
  list.size -= kFullList;
  for (std::size_t i = 0; i < list.size; ++i) {
    const std::size_t from = kFullList + i;
    list.dx[i] = list.dx[from], list.dy[i] = list.dy[from], list.dz[i] = list.dz[from];
    list.rj[i] = list.rj[from], list.ri[i] = list.ri[from];
    list.lx[i] = list.lx[from], list.ly[i] = list.ly[from], list.lz[i] = list.lz[from];
    list.error[i] = list.error[from], list.bin[i] = list.bin[from];
  }
}

/// Sums the rest, padded with points that overlap nothing.
template <class T>
HWY_INLINE void sum_last_lenses(LensList<T>& list, LeafSums& sums, LeafSums* bins) {
  const std::size_t batches = (list.size + kWidth - 1) / kWidth;
  for (std::size_t i = list.size; i < kWidth * batches; ++i) {
    list.dx[i] = 1, list.dy[i] = list.dz[i] = 0;
    list.rj[i] = list.ri[i] = 0;
    list.lx[i] = list.ly[i] = list.lz[i] = 0;
    list.error[i] = 0, list.bin[i] = list.bin[list.size - 1];
  }
  if (batches != 0) sum_lenses(list, batches, sums, bins);
  list.size = 0;
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
