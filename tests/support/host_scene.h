#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "cuda/query/broad_steps.h"
#include "cuda/query/make_broad_scene.h"
#include "query/find_solid_box.h"
#include "support/fiber_team.h"

namespace ist::testing {

/// The GPU's broad phase on the host: its source run by teams of 32 lanes that go on in an order
/// that nobody can count on.
class HostScene {
 public:
  HostScene(std::span<const GpuSolid> solids, std::span<const GpuSceneBody> bodies,
            const GpuSceneSettings& settings)
      : scene_(gpu::make_broad_scene(boxes_of(solids), bodies, settings)) {
    gpu::BroadArrays& arrays = scene_.arrays;
    gpu::Parts sizes(nullptr);
    gpu::place_broad(sizes, arrays);
    memory_ = std::make_unique<Line[]>(sizes.used() / sizeof(Line) + 1);
    gpu::Parts parts(reinterpret_cast<std::byte*>(memory_.get()));
    gpu::place_broad(parts, arrays);
    arrays.bodies = scene_.bodies.data();
    arrays.excluded = scene_.excluded.data();
    for (std::uint32_t i = 0; i < arrays.count; ++i) arrays.indices[i] = i;
  }

  GpuScenePairs pairs() const { return gpu::pairs_of(scene_.arrays); }

  /// `seed` > 0: of the order of lanes.
  GpuScenePairs find_pairs(const std::vector<Pose>& poses, unsigned seed) {
    gpu::BroadArrays& all = scene_.arrays;
    all.poses = poses.data();
    for (std::uint32_t i = 0; i < all.count; ++i) gpu::place_body(all, i);
    std::copy_n(all.indices, all.count, all.order);
    std::stable_sort(all.order, all.order + all.count,
                     [&](std::uint32_t i, std::uint32_t j) { return all.keys[i] < all.keys[j]; });
    for (int level = 1; level <= all.top; ++level)
      for (std::uint32_t j = 0; j < all.nodes[level]; ++j)
        by_fibers(seed, [&](const auto& team) { gpu::fit_node(team, all, level, j); });
    all.met[0] = 0;
    std::fill_n(all.found, all.max_pairs, ~std::uint64_t{0});
    for (std::uint32_t g = 0; g < all.nodes[1]; ++g) {
      gpu::BroadMemory memory;
      by_fibers(seed, [&](const auto& team) { gpu::find_pairs_of(team, all, g, memory); });
    }
    std::copy_n(all.found, all.max_pairs, all.sorted);
    std::sort(all.sorted, all.sorted + all.max_pairs);
    for (std::uint32_t k = 0; k < all.max_pairs; ++k) gpu::write_pair(all, k);
    return gpu::pairs_of(all);
  }

 private:
  struct alignas(256) Line {
    std::byte bytes[256];
  };
  static std::vector<SolidBox> boxes_of(std::span<const GpuSolid> solids) {
    std::vector<SolidBox> out;
    for (const GpuSolid& solid : solids)
      out.push_back(std::visit([](const auto& s) { return solid_box(s); }, solid));
    return out;
  }
  template <class Work>
  static void by_fibers(unsigned seed, const Work& work) {
    static Fibers<32> fibers(seed);
    fibers.run([&](int lane) { work(FiberTeam<32>(fibers, lane)); });
  }

  gpu::BroadScene scene_;
  std::unique_ptr<Line[]> memory_;
};

}  // namespace ist::testing
