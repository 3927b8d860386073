#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <ist/gpu_query.h>
#include <ist/scene.h>

// Which of many bodies may overlap, found on a GPU: for penetration_batch() and the other batches.

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
  std::size_t max_pairs = 8192;  ///< in one step; < 2^32
  /// [u] ≥ 0: boxes of a pair come as near as this.
  double margin = 0;
  /// That pairs will be asked by: by matched spheres boxes are wider by what these protrude.
  Measure measure = Measure::matched;
  /// Bodies that are joined, by their indices: they are no pairs.
  std::span<const ScenePairName> excluded = {};
};

/// The pairs that a step found: arrays in device memory that the scene owns.
struct GpuScenePairs {
  /// [1] how many; 0 if there are more than max_pairs.
  const std::uint32_t* count = nullptr;
  const std::uint32_t* boxes_met = nullptr;  ///< [1] how many there are
  const std::uint32_t* a = nullptr;          ///< [max_pairs] index of a body
  const std::uint32_t* b = nullptr;          ///< [max_pairs] above `a`'s; pairs are by (a, b)
  /// The same for a batch: all max_pairs, since the host does not know how many there are. Those
  /// beyond `count` are invalid_input there, with NaN.
  GpuPairs pairs;
  /// [bodies] invalid_input: left out, since its pose or scale is not usable, or it reaches beyond
  /// 1e37 [u], or it has no content.
  const QueryStatus* status = nullptr;
};

/// Many bodies in device memory, and whose boxes meet: the broad phase of Scene for a GPU, for one
/// scene or for thousands of small ones side by side (`world`). It has the same pairs as a Scene of
/// the same bodies, in the order of bodies' indices, and the same in every run.
///
/// The hierarchy of boxes is built anew in every step. One step at a time may use it.
class GpuScene {
 public:
  /// Bodies are named by their index.
  ///
  /// Throws Error if the device cannot be used or has no memory left, for an index or a number out
  /// of range, for more than 2^31 bodies, and for a margin that is negative, infinite or NaN.
  GpuScene(const GpuSolids& solids, std::span<const GpuSceneBody> bodies,
           const GpuSceneSettings& settings, const GpuSettings& gpu = {});
  ~GpuScene();
  GpuScene(GpuScene&&) noexcept;
  GpuScene& operator=(GpuScene&&) noexcept;

  std::size_t size() const noexcept;   ///< number of bodies
  std::size_t bytes() const noexcept;  ///< of device memory

  /// Finds the pairs of bodies that stand at `poses`, which are as many in device memory.
  ///
  /// Only launches kernels on `stream`: it allocates nothing and waits for nothing, so a CUDA graph
  /// may capture it, together with the batch that answers. Throws Error if a launch fails.
  void find_pairs(const Pose* poses, CUstream_st* stream);
  /// The same arrays for every step.
  const GpuScenePairs& pairs() const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ist
