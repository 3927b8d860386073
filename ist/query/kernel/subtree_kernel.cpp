#include "query/kernel/subtree_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/kernel/subtree_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/kernel/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

void sum_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) {
  const LaneTag<double> d;
  const SphereTree::Level& leaves = tree.level[0];
  for (std::size_t lane = 0; lane < kWidth; lane += hn::Lanes(d)) {
    auto cubes = hn::Load(d, sums.cubes + lane);
    auto x = hn::Load(d, sums.moment[0] + lane);
    auto y = hn::Load(d, sums.moment[1] + lane);
    auto z = hn::Load(d, sums.moment[2] + lane);
    for (std::size_t i = 0; i < n; ++i) {
      const SphereTree::Leaves below = tree.leaves_below(level, nodes[i]);
      for (std::uint32_t b = below.begin; b < below.end; ++b) {
        const BallBlock& balls = leaves.blocks[b];
        const Origin& origin = leaves.origins[b];
        // Unused lanes have negative radii.
        const auto r = hn::Max(load_as<double>(d, balls.r + lane), hn::Zero(d));
        const auto cube = r * (r * r);
        cubes = cubes + cube;
        x = x + cube * (load_as<double>(d, balls.x + lane) + hn::Set(d, origin.x));
        y = y + cube * (load_as<double>(d, balls.y + lane) + hn::Set(d, origin.y));
        z = z + cube * (load_as<double>(d, balls.z + lane) + hn::Set(d, origin.z));
      }
    }
    hn::Store(cubes, d, sums.cubes + lane);
    hn::Store(x, d, sums.moment[0] + lane);
    hn::Store(y, d, sums.moment[1] + lane);
    hn::Store(z, d, sums.moment[2] + lane);
  }
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(sum_subtrees);

void add_subtrees(const SphereTree& tree, int level, const std::uint32_t* nodes, std::size_t n,
                  SubtreeSums& sums) noexcept {
  if (n == 0) return;
  HWY_DYNAMIC_DISPATCH(sum_subtrees)(tree, level, nodes, n, sums);
  for (std::size_t i = 0; i < n; ++i) {
    const SphereTree::Leaves below = tree.leaves_below(level, nodes[i]);
    sums.spheres += std::min(kWidth * below.end, tree.header->sphere_count) - kWidth * below.begin;
  }
}

}  // namespace ist
#endif
