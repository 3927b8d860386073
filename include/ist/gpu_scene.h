#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <ist/gpu_query.h>
#include <ist/scene.h>

// The pairs of many bodies that may overlap, found on a GPU for penetration_batch() and the other
// batches.

namespace IST_API ist {

/// A body of a GpuScene.
struct GpuSceneBody {
  std::uint32_t solid = 0;    ///< index into the GpuSolids
  double scale = 1;           ///< > 0
  std::uint32_t world = 0;    ///< below kGpuWorlds: bodies of different worlds never meet
  bool moves = true;          ///< two bodies that do not move are no pair, nor are two shapes
  std::uint32_t layers = 1;   ///< bits
  std::uint32_t meets = ~0u;  ///< bits: layers of bodies that it meets; both must agree
};
inline constexpr std::uint32_t kGpuWorlds = 1u << 24;

struct GpuSceneSettings {
  std::size_t max_pairs = 8192;  ///< capacity for the pairs of one step; < 2^32
  /// [u] ≥ 0: two bodies are a pair too if their boxes are no farther apart.
  double margin = 0;
  /// The measure of the queries that follow. Matched spheres may protrude from their solid, so its
  /// box is widened for them.
  Measure measure = Measure::matched;
  /// Indices of bodies that are joined and never are a pair.
  std::span<const ScenePairName> excluded = {};
};

/// The pairs that a step found: arrays in device memory that the scene owns.
struct GpuScenePairs {
  /// [1] number of pairs. If there are more than max_pairs it is 0; see boxes_met.
  const std::uint32_t* count = nullptr;
  const std::uint32_t* boxes_met = nullptr;  ///< [1] number of pairs, even if above max_pairs
  const std::uint32_t* a = nullptr;          ///< [max_pairs] index of a body
  const std::uint32_t* b = nullptr;  ///< [max_pairs] a higher index; pairs are sorted by (a, b)
  /// The pairs as a batch takes them: always max_pairs of them, since the host does not know their
  /// number. A batch answers those beyond `count` with invalid_input and NaN.
  GpuPairs pairs;
  /// [bodies] invalid_input: the body is left out, since its pose, scale or shape is not usable,
  /// its box reaches beyond 1e37 [u], or its asset is empty.
  const QueryStatus* status = nullptr;
};

/// Many bodies in device memory, and the pairs whose boxes overlap: Scene's broad phase on a GPU,
/// for one scene or for thousands of small ones side by side (`world`). The pairs are those of a
/// Scene of the same bodies, in every run.
///
/// The hierarchy of boxes is built anew in every step. One step at a time.
class GpuScene {
 public:
  /// Bodies are named by their index.
  ///
  /// Throws Error if the device cannot be used or has no memory left, for an index or a number out
  /// of range, for more than 2^31 bodies, and for a margin that is negative, infinite or NaN.
  GpuScene(const GpuSolids& solids, std::span<const GpuSceneBody> bodies,
           const GpuSceneSettings& settings, const GpuSettings& gpu = {});

  std::size_t size() const noexcept;   ///< number of bodies
  std::size_t bytes() const noexcept;  ///< of device memory

  /// Finds the pairs of bodies at these poses: size() of them, in device memory.
  ///
  /// Only launches kernels on `stream`: it allocates nothing and waits for nothing, so a CUDA graph
  /// may capture it, together with the batch that answers. Throws Error if a launch fails.
  void find_pairs(const Pose* poses, CUstream_st* stream);
  /// The same arrays for every step.
  const GpuScenePairs& pairs() const noexcept;

 private:
  struct Impl;
  HiddenImpl<Impl> impl_;
};

}  // namespace ist
