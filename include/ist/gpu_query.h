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

/// Assets in device memory: the bytes of the files, unchanged.
///
/// May be shared by threads.
class GpuAssets {
 public:
  /// Copies the assets to the device of `settings`; they are not needed afterwards. Pairs refer to
  /// them by index.
  ///
  /// Throws Error if the device cannot be used or has no memory left, or if an asset holds no
  /// spheres.
  explicit GpuAssets(std::span<const TreeView> assets, const GpuSettings& settings = {});
  ~GpuAssets();
  GpuAssets(GpuAssets&&) noexcept;
  GpuAssets& operator=(GpuAssets&&) noexcept;

  std::size_t size() const noexcept;   ///< number of assets
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
  const std::uint32_t* asset_a = nullptr;  ///< index into GpuAssets
  const std::uint32_t* asset_b = nullptr;
  const Pose* pose_a = nullptr;     ///< null: all at the origin, not rotated
  const Pose* pose_b = nullptr;     ///< likewise
  const double* scale_a = nullptr;  ///< null: 1
  const double* scale_b = nullptr;  ///< likewise
};

/// Answers, each as in Penetration: arrays in device memory. Null pointers: not wanted.
struct GpuPenetrations {
  double* volume = nullptr;                ///< [count] [u³]
  double* centroid = nullptr;              ///< [count][3] [u] world
  double* translation_gradient = nullptr;  ///< [count][3] [u²] dV/d(translation of B), world
  /// [count][3] [u³/rad] dV/d(rotation vector of B about B's origin), world
  double* rotation_gradient = nullptr;
  /// [count] ok, or invalid_input for an invalid pose, scale or asset index: all numbers are NaN.
  /// Other pairs are not affected.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count]
};

/// Largest batch size that uses the low-latency partitioning; see GpuWorkspace.
inline constexpr std::size_t kFewGpuPairs = 16'384;

/// Working memory of a batch on the device. One batch at a time may use it.
class GpuWorkspace {
 public:
  /// For batches of up to `most_pairs`. Takes 100 MB, plus 8 bytes per pair, or 40 bytes up to
  /// kFewGpuPairs.
  ///
  /// Up to kFewGpuPairs pairs are partitioned more finely: a small batch ends sooner, at the cost
  /// of throughput. Answers of the two kinds differ by rounding.
  ///
  /// Throws Error if the device cannot be used or has no memory left.
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

/// Limits of a batch, as in PenetrationSettings; no relative_error, as exact is not on the GPU.
struct GpuPenetrationSettings {
  Measure measure = Measure::matched;  ///< matched or inner
  /// Count of sphere pairs to spend on each pair of trees; matched measure only; 0: no limit.
  ///
  /// The answer comes from the finest levels of detail that are expected to need no more, blended
  /// smoothly with the next coarser ones; see PenetrationSettings::pair_budget.
  std::uint32_t pair_budget = 0;
};

/// answers[i] = penetration(pairs[i]) by lenses (FieldUse::never), finished.
///
/// The volume is within 1e-6 of the sum in double. Gradients are within 1e-6 of the sum of the
/// lenses' magnitudes, or of volume^(2/3) if that is more. Under a budget, and for copies of one
/// asset at nearly the same pose, the answer is the CPU's blend of such sums. The bits are the same
/// in every run, whatever else is in the batch, in all workspaces for up to kFewGpuPairs, and in
/// all larger ones.
///
/// Only launches kernels on `stream`: it allocates nothing and waits for nothing, so a CUDA graph
/// may capture it.
///
/// Throws Error for Measure::exact, if a batch is larger than the workspace, if the devices differ,
/// or if a launch fails.
void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs,
                       const GpuPenetrationSettings& settings, GpuWorkspace& workspace,
                       const GpuPenetrations& answers, CUstream_st* stream);

/// The same without a budget.
void penetration_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                       GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream);

/// Answers, each as in Separation: arrays in device memory. Null pointers: not wanted.
struct GpuSeparations {
  double* distance = nullptr;      ///< [count] [u] between the inner spheres
  double* distance_min = nullptr;  ///< [count] [u] lower bound for the solids, certified
  double* distance_max = nullptr;  ///< [count] [u] upper bound, certified
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
/// The distance is the least over all pairs of inner spheres in double. separation() selects that
/// pair in float: its distance may be larger by 1e-6 of the objects' size, and among equally near
/// pairs it may select another. The interval is certified as there, and its lower end is never
/// lower. `max_visits` as in SeparationSettings; 0: no limit. Under a limit that binds the interval
/// is certified too, but differs from that of separation(). The bits are the same in every run,
/// whatever else is in the batch.
///
/// Only launches kernels on `stream`, as penetration_batch().
///
/// Throws Error if a batch is larger than the workspace, if the devices differ, or if a launch
/// fails.
void separation_batch(const GpuAssets& assets, const GpuPairs& pairs, std::uint32_t max_visits,
                      GpuWorkspace& workspace, const GpuSeparations& answers, CUstream_st* stream);

/// Largest number of patches for a pair.
inline constexpr std::uint32_t kMostGpuPatches = 32;

/// Patches, each as ContactPatch: arrays in device memory. Null pointers: not wanted.
///
/// Those of pair i begin at [i · most], in the order of their ids; entries beyond the last are not
/// written.
struct GpuContactPatches {
  std::uint32_t most = 0;          ///< patches of a pair, up to kMostGpuPatches
  std::uint32_t* count = nullptr;  ///< [count of pairs] patches written
  std::uint64_t* id = nullptr;     ///< as of contact_patches()
  double* centroid = nullptr;      ///< [3] [u] world
  double* normal = nullptr;        ///< [3] unit, from A to B, world; zero if the area is 0
  double* area = nullptr;          ///< [u²] |force|
  double* depth = nullptr;         ///< [u] volume/area; 0 if no area
  double* volume = nullptr;        ///< [u³] part of GpuPenetrations::volume
  double* force = nullptr;         ///< [3] [u²] part of −translation_gradient
  double* torque = nullptr;        ///< [3] [u³/rad] part of −rotation_gradient
};

/// answers[i] and its patches = contact_patches(pairs[i]) by lenses (FieldUse::never), without
/// limits: the contact condensed into at most `patches.most`.
///
/// Patches are the same regions of the same tree as there, with the same ids, unless two divisions
/// are equally good to a float's digits. Answers equal those of penetration_batch() to its
/// precision, not bit for bit; copies of one asset at nearly the same pose are not treated
/// specially. Volumes, forces and torques of a pair's patches sum to its answer's to about 1e-15.
/// The bits are the same in every run, whatever else is in the batch.
///
/// Only launches kernels on `stream`, as penetration_batch(). One warp processes a pair, so a very
/// large contact takes long.
///
/// Throws Error for Measure::exact, if a batch is larger than the workspace, if patches.most
/// exceeds kMostGpuPatches, if the devices differ, or if a launch fails.
void contact_patches_batch(const GpuAssets& assets, const GpuPairs& pairs, Measure measure,
                           GpuWorkspace& workspace, const GpuPenetrations& answers,
                           const GpuContactPatches& patches, CUstream_st* stream);

}  // namespace ist
