#include "query/kernel/leaf_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/leaf_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/leaf_pairs-inl.h"
#include "query/kernel/lens_list-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Appends the lenses of a task with the lanes it meets.
template <class T>
HWY_INLINE void add_lenses(const PairsOfBlocks<T>& pairs, std::uint32_t met, bool binned,
                           LensList<T>& list) {
  const LaneTag<T> d;
  const std::size_t at = met >> 16;
  const std::size_t i = at / kWidth;
  const Spheres<T>& spheres = *pairs.many[i];
  const T* const lever = pairs.lever[i];
  const auto xi = hn::Set(d, pairs.x[at]);
  const auto yi = hn::Set(d, pairs.y[at]);
  const auto zi = hn::Set(d, pairs.z[at]);
  const auto ri = hn::Set(d, pairs.one[i]->r[at % kWidth]);
  const auto lx = xi + hn::Set(d, lever[0]);
  const auto ly = yi + hn::Set(d, lever[1]);
  const auto lz = zi + hn::Set(d, lever[2]);
  const auto error = hn::Set(d, pairs.error[i]);
  const std::size_t before = list.size;
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    const Compressor compress(d, mask_of_bits(d, (met & 0xffff) >> lane));
    const auto rj = hn::Load(d, spheres.r + lane);
    const auto dx = hn::Load(d, spheres.x + lane) - xi;
    const auto dy = hn::Load(d, spheres.y + lane) - yi;
    const auto dz = hn::Load(d, spheres.z + lane) - zi;
    const std::size_t end = list.size;
    hn::StoreU(compress(dx), d, list.dx + end);
    hn::StoreU(compress(dy), d, list.dy + end);
    hn::StoreU(compress(dz), d, list.dz + end);
    hn::StoreU(compress(rj), d, list.rj + end);
    hn::StoreU(ri, d, list.ri + end);
    hn::StoreU(lx, d, list.lx + end);
    hn::StoreU(ly, d, list.ly + end);
    hn::StoreU(lz, d, list.lz + end);
    hn::StoreU(error, d, list.error + end);
    list.size += compress.count();
  }
  if (binned) std::fill(list.bin + before, list.bin + list.size, pairs.bin[i]);
}

/// Appends the lenses of two tasks, which together meet sixteen lanes at most, with half the
/// stores: only for vectors of sixteen lanes.
template <class T>
HWY_INLINE void add_two(const PairsOfBlocks<T>& pairs, std::uint32_t met_1, std::uint32_t met_2,
                        LensList<T>& list) {
  const LaneTag<T> d;
  static_assert(hn::MaxLanes(d) == kWidth);
  const hn::RebindToUnsigned<decltype(d)> du;
  using V = hn::Vec<decltype(d)>;
  const std::size_t at_1 = met_1 >> 16, at_2 = met_2 >> 16;
  const std::size_t i_1 = at_1 / kWidth, i_2 = at_2 / kWidth;
  const auto lanes_1 = hn::RebindMask(du, mask_of_bits(d, met_1 & 0xffff));
  const auto lanes_2 = hn::RebindMask(du, mask_of_bits(d, met_2 & 0xffff));
  const std::size_t count_1 = hn::CountTrue(du, lanes_1);
  const std::size_t count_2 = hn::CountTrue(du, lanes_2);
  const auto later = mask_of_bits(d, 0xffffu << count_1 & 0xffffu);
  const auto numbers = hn::Load(du, kLaneNumbers);
  // The second task's lanes move up behind the first one's.
  const auto moved = hn::IndicesFromVec(du, hn::LoadU(du, kLateLanes + kWidth - count_1));
  const auto from = hn::IndicesFromVec(
      d, hn::IfThenElse(hn::RebindMask(du, later),
                        hn::TableLookupLanes(hn::Compress(numbers, lanes_2), moved),
                        hn::Compress(numbers, lanes_1)));
  const auto of_lanes = [&](const T* x_1, const T* x_2) -> V {
    return hn::IfThenElse(later, hn::TableLookupLanes(hn::Load(d, x_2), from),
                          hn::TableLookupLanes(hn::Load(d, x_1), from));
  };
  const auto of_tasks = [&](T x_1, T x_2) -> V {
    return hn::IfThenElse(later, hn::Set(d, x_2), hn::Set(d, x_1));
  };
  const Spheres<T>& many_1 = *pairs.many[i_1];
  const Spheres<T>& many_2 = *pairs.many[i_2];
  const auto xi = of_tasks(pairs.x[at_1], pairs.x[at_2]);
  const auto yi = of_tasks(pairs.y[at_1], pairs.y[at_2]);
  const auto zi = of_tasks(pairs.z[at_1], pairs.z[at_2]);
  const T* const lever_1 = pairs.lever[i_1];
  const T* const lever_2 = pairs.lever[i_2];
  const std::size_t end = list.size;
  hn::StoreU(of_lanes(many_1.x, many_2.x) - xi, d, list.dx + end);
  hn::StoreU(of_lanes(many_1.y, many_2.y) - yi, d, list.dy + end);
  hn::StoreU(of_lanes(many_1.z, many_2.z) - zi, d, list.dz + end);
  hn::StoreU(of_lanes(many_1.r, many_2.r), d, list.rj + end);
  hn::StoreU(of_tasks(pairs.one[i_1]->r[at_1 % kWidth], pairs.one[i_2]->r[at_2 % kWidth]), d,
             list.ri + end);
  hn::StoreU(xi + of_tasks(lever_1[0], lever_2[0]), d, list.lx + end);
  hn::StoreU(yi + of_tasks(lever_1[1], lever_2[1]), d, list.ly + end);
  hn::StoreU(zi + of_tasks(lever_1[2], lever_2[2]), d, list.lz + end);
  hn::StoreU(of_tasks(pairs.error[i_1], pairs.error[i_2]), d, list.error + end);
  list.size = end + count_1 + count_2;
}

/// Tasks that meet too much for add_two: seldom, so kept out of the registers of the others.
template <class T>
HWY_NOINLINE void add_apart(const PairsOfBlocks<T>& pairs, std::uint32_t met_1, std::uint32_t met_2,
                            bool binned, LensList<T>& list) {
  add_lenses(pairs, met_1, binned, list);
  add_lenses(pairs, met_2, binned, list);
}

/// Appends the lenses of two tasks: the same list whatever the vectors.
template <class T>
HWY_INLINE void add_both(const PairsOfBlocks<T>& pairs, std::uint32_t met_1, std::uint32_t met_2,
                         bool binned, LensList<T>& list) {
  if constexpr (kCompressInstruction<LaneTag<T>>) {
    const std::size_t count_1 = hwy::PopCount(met_1 & 0xffff);
    if (count_1 + hwy::PopCount(met_2 & 0xffff) > kWidth)
      return add_apart(pairs, met_1, met_2, binned, list);
    std::uint32_t* const bins = list.bin + list.size;
    add_two(pairs, met_1, met_2, list);
    if (!binned) return;
    std::fill(bins, bins + count_1, pairs.bin[(met_1 >> 16) / kWidth]);
    std::fill(bins + count_1, list.bin + list.size, pairs.bin[(met_2 >> 16) / kWidth]);
  } else {
    add_lenses(pairs, met_1, binned, list);
    add_lenses(pairs, met_2, binned, list);
  }
}

/// add_leaf_pairs in T, a few pairs through all stages at a time.
template <class T>
void add_as(const LeafStage& stage, PlacedBlocks<T>& blocks, const std::uint32_t* a,
            const std::uint32_t* b, std::size_t n, LeafSums& sums) {
  const TurnedAxes<T> axes(*stage.a_from_b);
  LeafSums* const bins = stage.bins.sums;
  const bool single_a = stage.level_a == kSphereLevel;
  const bool single_b = stage.level_b == kSphereLevel;
  const Tasks tasks{!single_a && !single_b ? 1u : 0u, single_b ? 1u : 0u};
  const int shift_a = single_a ? kWidthBits : 0;  // from spheres to blocks
  const int shift_b = single_b ? kWidthBits : 0;
  const auto place_a = [&](std::uint32_t block, PlacedBlock<T>& placed) {
    place_block(*stage.a, block, axes, placed);
  };
  const auto turn_b = [&](std::uint32_t block, PlacedBlock<T>& placed) {
    turn_block(*stage.b, block, axes, placed);
  };
  PairsOfBlocks<T> pairs;
  LensList<T> list;
  std::size_t done = 0;
  while (done < n) {
    const std::size_t most = std::min(kPairsAtOnce, n - done);
    std::size_t taken = 0;
    for (; taken < most; ++taken) {
      const PlacedBlock<T>** const both = pairs.block[taken];
      both[0] = blocks.a.find(a[done + taken] >> shift_a, pairs.block[0], 2 * taken, place_a);
      both[1] = blocks.b.find(b[done + taken] >> shift_b, pairs.block[0], 2 * taken, turn_b);
      if (both[0] == nullptr || both[1] == nullptr) break;
    }
    for (std::size_t i = 0; i < taken; ++i) describe_pair(tasks, i, pairs);
    std::size_t listed = 0;
    for (std::size_t i = 0; i < taken; ++i) {
      const int single = single_a   ? static_cast<int>(a[done + i] % kWidth)
                         : single_b ? static_cast<int>(b[done + i] % kWidth)
                                    : -1;
      listed = list_tasks(pairs, i, single, listed);
    }
    if (bins != nullptr)
      for (std::size_t i = 0; i < taken; ++i)
        pairs.bin[i] = stage.bins.node[done + i] >> stage.bins.shift;
    done += taken;
    const std::size_t found = find_met(pairs, listed);
    if (found % 2 != 0) pairs.met[found] = pairs.met[found - 1] & 0xffff0000;  // meets nothing
    for (std::size_t k = 0; k < found; k += 2) {
      add_both(pairs, pairs.met[k], pairs.met[k + 1], bins != nullptr, list);
      if (list.size >= kFullList) sum_full_list(list, sums, bins);
    }
  }
  sum_last_lenses(list, sums, bins);
}

void add_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
               const std::uint32_t* b, std::size_t n, LeafSums& sums) {
  stage.precision == Precision::float32 ? add_as<float>(stage, scratch.float32, a, b, n, sums)
                                        : add_as<double>(stage, scratch.float64, a, b, n, sums);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(add_pairs);

void add_leaf_pairs(const LeafStage& stage, LeafScratch& scratch, const std::uint32_t* a,
                    const std::uint32_t* b, std::size_t n, LeafSums& sums) noexcept {
  HWY_DYNAMIC_DISPATCH(add_pairs)(stage, scratch, a, b, n, sums);
}

}  // namespace ist
#endif
