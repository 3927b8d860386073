#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <ist/gpu_scene.h>
#include <ist/types.h>

#include "cuda/query/broad_arrays.h"

// Bodies of a scene in plain numbers. Host code only.

namespace ist::gpu {

/// The bodies of a scene and its numbers, without its memory.
struct BroadScene {
  BroadArrays arrays = {};
  std::vector<BroadBody> bodies;
  std::vector<std::uint64_t> excluded;
};

/// `boxes`: of the solids. Throws Error, as GpuScene does.
inline BroadScene make_broad_scene(std::span<const SolidBox> boxes,
                                   std::span<const GpuSceneBody> bodies,
                                   const GpuSceneSettings& settings) {
  if (!(settings.margin >= 0 && std::isfinite(settings.margin)))
    throw Error("GPU scene: a margin that is negative, infinite or NaN");
  if (bodies.size() > 1u << 31) throw Error("GPU scene: more than 2^31 bodies");
  if (settings.max_pairs == 0 || settings.max_pairs >= kNoIndex)
    throw Error("GPU scene: max_pairs is 1 … 2^32 - 2");
  BroadScene scene;
  std::vector<std::uint32_t> of_world(1);  // bodies
  double sizes = 0;                        // log2, of those that have one
  std::size_t sized = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const GpuSceneBody& body = bodies[i];
    const std::string named = "GPU scene: body " + std::to_string(i);
    if (body.solid >= boxes.size())
      throw Error(named + " is of solid " + std::to_string(body.solid) + "; there are " +
                  std::to_string(boxes.size()));
    if (body.world >= kGpuWorlds)
      throw Error(named + " is of world " + std::to_string(body.world) + "; worlds are below " +
                  std::to_string(kGpuWorlds));
    SolidBox box = boxes[body.solid];
    box.scale(body.scale);
    const double wider =
        settings.margin / 2 + (settings.measure == Measure::matched ? box.protrusion : 0);
    scene.bodies.push_back(
        {box, wider, body.scale, body.world, body.solid, body.layers, body.meets, body.moves});
    if (body.world >= of_world.size()) of_world.resize(body.world + 1);
    ++of_world[body.world];
    const double size = norm(box.half) + wider;
    if (size > 0 && std::isfinite(size)) {
      sizes += std::log2(size);
      ++sized;
    }
  }
  BroadArrays& arrays = scene.arrays;
  arrays.count = static_cast<std::uint32_t>(bodies.size());
  arrays.max_pairs = static_cast<std::uint32_t>(settings.max_pairs);
  // A cell is about as large as a body: smaller cells would not improve the order.
  arrays.cells = sized == 0 ? 1 : std::exp2(-std::round(sizes / static_cast<double>(sized)));
  const auto bits_of_count = [](std::size_t count) {
    return static_cast<int>(std::bit_width(count));
  };
  const int world_bits = bits_of_count(of_world.size() - 1);
  // Few bodies need no fine order, and each 8 bits of a key cost a pass of the sort.
  const int most = bits_of_count(*std::max_element(of_world.begin(), of_world.end()));
  arrays.axis_bits = std::min({20, (64 - world_bits) / 3, 4 + most});
  arrays.key_bits = 3 * arrays.axis_bits + world_bits;
  arrays.index_bits = std::max(1, bits_of_count(arrays.count));
  for (const ScenePairName& two : settings.excluded) {
    if (two.a >= bodies.size() || two.b >= bodies.size())
      throw Error("GPU scene: an excluded pair of bodies " + std::to_string(two.a) + " and " +
                  std::to_string(two.b) + "; there are " + std::to_string(bodies.size()));
    scene.excluded.push_back(arrays.key(two.a, two.b));
  }
  std::sort(scene.excluded.begin(), scene.excluded.end());
  arrays.excluded_count = static_cast<std::uint32_t>(scene.excluded.size());
  return scene;
}

/// The answer that the scene's steps write.
inline GpuScenePairs pairs_of(const BroadArrays& scene) {
  return {scene.met + 1,
          scene.met,
          scene.a,
          scene.b,
          {scene.max_pairs,
           {scene.solid_a, scene.pose_a, scene.scale_a},
           {scene.solid_b, scene.pose_b, scene.scale_b}},
          scene.status};
}

}  // namespace ist::gpu
