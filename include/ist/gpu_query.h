#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <ist/api.h>
#include <ist/gpu.h>
#include <ist/pose.h>
#include <ist/query_enums.h>
#include <ist/tree_view.h>

// Penetrations, separations and contact patches of many pairs at once, on a GPU. Assets are
// uploaded once; poses and answers are arrays in device memory that the caller owns.

namespace IST_API ist {

/// Assets in device memory: the bytes of the files as they are.
///
/// Threads may share it.
class GpuAssets {
 public:
  /// Copies the assets to the device of `settings`; they are not needed afterwards. Pairs name them
  /// by their place in the list.
  ///
  /// Throws Error where the device cannot be used or has no memory left, or an asset holds no
  /// spheres.
  explicit GpuAssets(std::span<const TreeView> assets, const GpuSettings& settings = {});
  ~GpuAssets();
  GpuAssets(GpuAssets&&) noexcept;
  GpuAssets& operator=(GpuAssets&&) noexcept;

  std::size_t size() const noexcept;   ///< assets
  std::size_t bytes() const noexcept;  ///< of device memory
  int device() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// Placed pairs of assets: arrays of `count` in device memory.
struct GpuPairs {
  std::size_t count = 0;
  const std::uint32_t* asset_a = nullptr;  ///< place in GpuAssets
  const std::uint32_t* asset_b = nullptr;
  const Pose* pose_a = nullptr;     ///< null: all at the origin, unturned
  const Pose* pose_b = nullptr;     ///< likewise
  const double* scale_a = nullptr;  ///< null: 1
  const double* scale_b = nullptr;  ///< likewise
};

/// Answers, each as in Penetration: arrays in device memory; null: not wanted.
struct GpuPenetrations {
  double* volume = nullptr;                ///< [count] [u³]
  double* centroid = nullptr;              ///< [count][3] [u] world
  double* translation_gradient = nullptr;  ///< [count][3] [u²] dV/d(translation of B), world
  /// [count][3] [u³/rad] dV/d(rotation vector of B about B's origin), world
  double* rotation_gradient = nullptr;
  /// [count] ok, or invalid_input of a pose, a scale or an asset's number; others are not touched
  /// by that.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count]
};

/// Up to so many pairs a workspace is one for few (GpuWorkspace).
inline constexpr std::size_t kFewGpuPairs = 16'384;

/// Device memory that a batch works in. One batch at a time may use it.
class GpuWorkspace {
 public:
  /// For batches of up to `most_pairs`; takes 8 bytes each, 40 where they are few, and
  /// 100 MB besides.
  ///
  /// One for up to kFewGpuPairs cuts them up finer than a larger one: a step of few then ends
  /// sooner, at the cost of pairs a second. Answers of the two differ by rounding.
  ///
  /// Throws Error where the device cannot be used or has no memory left.
  explicit GpuWorkspace(std::size_t most_pairs, const GpuSettings& settings = {});
  ~GpuWorkspace();
  GpuWorkspace(GpuWorkspace&&) noexcept;
  GpuWorkspace& operator=(GpuWorkspace&&) noexcept;

  std::size_t most_pairs() const noexcept;
  std::size_t bytes() const noexcept;  ///< of device memory

  struct Impl;
  Impl& impl() noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// What a penetration of a batch may cost, as in PenetrationSettings.
struct GpuPenetrationSettings {
  Measure measure = Measure::matched;  ///< matched or inner
  /// Count of sphere pairs to spend on each pair of trees; matched measure only; 0: no limit.
  ///
  /// The answer comes from the finest levels of detail that are expected to need no more, blended
  /// smoothly with the next coarser ones: PenetrationSettings::pair_budget says how.
  std::uint32_t pair_budget = 0;
};

/// answers[i] = penetration(pairs[i]) by lenses (FieldUse::never), finished.
///
/// The volume is within 1e-6 of the sum in double, gradients within 1e-6 of the lenses' single ones
/// together or of volume^(2/3), if that is more. Under a budget, and of copies of one asset at
/// nearly the same pose, the sum is the CPU's blend of such sums.
/// The same bits in every run, whatever else is in the batch, in all workspaces for up to
/// kFewGpuPairs and in all for more.
/// Only launches kernels on `stream`: allocates nothing and waits for nothing, so that a CUDA graph
/// may capture it.
///
/// Throws Error for Measure::exact, where a batch is larger than the workspace, the devices differ
/// or a launch fails.
void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs,
                       const GpuPenetrationSettings& settings, GpuWorkspace& workspace,
                       const GpuPenetrations& answers, CUstream_st* stream);

/// Without a budget.
void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                       GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream);

/// Answers, each as in Separation: arrays in device memory; null: not wanted.
struct GpuSeparations {
  double* distance = nullptr;      ///< [count] [u] between the inner spheres
  double* distance_min = nullptr;  ///< [count] [u] of the solids at least, certified
  double* distance_max = nullptr;  ///< [count] [u] and at most, certified
  double* point_a = nullptr;       ///< [count][3] [u] on A's inner spheres, world
  double* point_b = nullptr;       ///< [count][3] [u] on B's inner spheres, world
  double* normal = nullptr;        ///< [count][3] unit, from A to B, world
  /// [count] ok; budget_exhausted under max_visits; invalid_input as in GpuPenetrations.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count] measured
};

/// answers[i] = separation(pairs[i]).
///
/// The distance is the least of all pairs of inner spheres in double. separation() picks that pair
/// in float, so that its distance may be more by 1e-6 of the objects' size; of several pairs as
/// near it may have picked another. The interval is certified as there, its lower end never less.
/// `max_visits` as in SeparationSettings; 0: no limit. Under a limit that binds the interval is
/// certified too, yet another one than separation()'s.
/// The same bits in every run, whatever else is in the batch.
/// Only launches kernels on `stream`, as penetration_batch().
///
/// Throws Error where a batch is larger than the workspace, the devices differ or a launch fails.
void separation_batch(const GpuAssets& assets, const GpuPairs& pairs, std::uint32_t max_visits,
                      GpuWorkspace& workspace, const GpuSeparations& answers, CUstream_st* stream);

/// Patches that a pair may be asked for.
inline constexpr std::uint32_t kMostGpuPatches = 32;

/// Patches, each as ContactPatch: arrays in device memory; null: not wanted.
///
/// Those of pair i begin at [i · most], in the order of their ids; what lies beyond the last of
/// them is not written.
struct GpuContactPatches {
  std::uint32_t most = 0;          ///< patches of a pair, up to kMostGpuPatches
  std::uint32_t* count = nullptr;  ///< [count of pairs] patches written
  std::uint64_t* id = nullptr;     ///< those of contact_patches()
  double* centroid = nullptr;      ///< [3] [u] world
  double* normal = nullptr;        ///< [3] unit, from A to B, world; zero if the area is
  double* area = nullptr;          ///< [u²] |force|
  double* depth = nullptr;         ///< [u] volume/area; 0 if no area
  double* volume = nullptr;        ///< [u³] share of GpuPenetrations::volume
  double* force = nullptr;         ///< [3] [u²] share of −translation_gradient
  double* torque = nullptr;        ///< [3] [u³/rad] share of −rotation_gradient
};

/// answers[i] and its patches = contact_patches(pairs[i]) by lenses (FieldUse::never), without
/// limits: the contact condensed into at most `patches.most`.
///
/// The same regions of the same tree as there, with the same names, unless two divisions are worth
/// the same to a float's digits.
/// Answers are those of penetration_batch() to its digits, not its bits; copies of one asset at
/// nearly the same pose are asked as they are.
/// Volumes, forces and torques of a pair's patches sum to its answer's to about 1e-15.
/// The same bits in every run, whatever else is in the batch.
/// Only launches kernels on `stream`, as penetration_batch(). One warp does a pair: a very large
/// contact takes it long.
///
/// Throws Error for Measure::exact, where a batch is larger than the workspace, more patches than
/// kMostGpuPatches are asked for, the devices differ or a launch fails.
void contact_patches_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                           GpuWorkspace& workspace, const GpuPenetrations& answers,
                           const GpuContactPatches& patches, CUstream_st* stream);

}  // namespace ist
