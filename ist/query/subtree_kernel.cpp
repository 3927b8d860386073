#include "query/subtree_kernel.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/subtree_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Sums of leaf blocks [from, end): a lane a sphere, lanes added up at the end.
void sum_blocks(const SphereTree::Level& leaves, std::uint32_t from, std::uint32_t end,
                SubtreeSums& sums) {
  const LaneTag<double> d;
  const auto zero = hn::Zero(d);
  alignas(64) double lanes[4][kWidth];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    auto volume = zero, x = zero, y = zero, z = zero;
    for (std::uint32_t b = from; b < end; ++b) {
      const BallBlock& balls = leaves.blocks[b];
      const Origin& origin = leaves.origins[b];
      // Negative for an unused lane.
      const auto r = hn::Max(load_as<double>(d, balls.r + lane), zero);
      const auto cube = r * (r * r);
      volume = volume + cube;
      x = x + cube * (load_as<double>(d, balls.x + lane) + hn::Set(d, origin.x));
      y = y + cube * (load_as<double>(d, balls.y + lane) + hn::Set(d, origin.y));
      z = z + cube * (load_as<double>(d, balls.z + lane) + hn::Set(d, origin.z));
    }
    hn::Store(volume, d, lanes[0] + lane);
    hn::Store(x, d, lanes[1] + lane);
    hn::Store(y, d, lanes[2] + lane);
    hn::Store(z, d, lanes[3] + lane);
  }
  for (std::size_t lane = 0; lane < kWidth; ++lane) {
    sums.volume += lanes[0][lane];
    for (int k = 0; k < 3; ++k) sums.moment[k] += lanes[k + 1][lane];
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(sum_blocks);

SubtreeSums subtree_sums(const SphereTree& tree, int level, std::uint32_t block) noexcept {
  const std::uint64_t blocks = std::uint64_t{1} << (4 * level);  // leaves of a full node
  const std::uint32_t count = tree.level[0].count;
  const auto from = static_cast<std::uint32_t>(std::min<std::uint64_t>(count, blocks * block));
  const auto end = static_cast<std::uint32_t>(std::min<std::uint64_t>(count, blocks * (block + 1)));
  SubtreeSums sums;
  HWY_DYNAMIC_DISPATCH(sum_blocks)(tree.level[0], from, end, sums);
  sums.volume *= 4 * M_PI / 3;
  for (double& m : sums.moment) m *= 4 * M_PI / 3;
  sums.spheres = std::min(kWidth * end, tree.header->sphere_count) - kWidth * from;
  return sums;
}

}  // namespace ist
#endif
