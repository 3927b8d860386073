#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <variant>

#include <ist/asset.h>
#include <ist/gpu.h>
#include <ist/shapes.h>
#include <ist/types.h>

// Penetrations, separations and contact patches of many pairs at once, on a GPU. Solids are
// uploaded once; poses and answers are arrays in device memory that the caller owns.

namespace IST_API ist {

/// A solid of a batch: an asset, or a shape.
using GpuSolid = std::variant<AssetView, Shape>;

/// Solids in device memory, with all that they point to: assets' bytes, heights, distances.
///
/// May be shared by threads.
class GpuSolids {
 public:
  /// Copies the solids to the device of `settings`; they are not needed afterwards. Pairs refer to
  /// them by index.
  ///
  /// A shape whose numbers are out of range makes its pairs invalid_input, as on the CPU. Throws
  /// Error if the device cannot be used or has no memory left, for an asset with neither spheres
  /// nor a mesh, and for a FunctionShape, which a GPU cannot call.
  explicit GpuSolids(std::span<const GpuSolid> solids, const GpuSettings& settings = {});

  std::size_t size() const noexcept;   ///< number of solids
  std::size_t bytes() const noexcept;  ///< of device memory
  int device() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  HiddenImpl<Impl> impl_;
};

/// Working memory of a batch on the device. One batch at a time may use it.
class GpuWorkspace {
 public:
  /// For batches of up to `most_pairs`. Takes 100 MB, and for the exact measure more: 130 MB for
  /// 1,000 pairs, up to 480 MB on a large card for 8,192 or more. With it 12 bytes per pair, or 40
  /// bytes up to kFewGpuPairs.
  ///
  /// Up to kFewGpuPairs pairs are partitioned more finely: a small batch ends sooner, at the cost
  /// of throughput. Answers of the two kinds differ by rounding.
  ///
  /// Throws Error if the device cannot be used or has no memory left.
  explicit GpuWorkspace(std::size_t most_pairs, const GpuSettings& settings = {});

  std::size_t most_pairs() const noexcept;
  std::size_t bytes() const noexcept;  ///< of device memory

  struct Impl;
  Impl& impl() noexcept { return *impl_; }

 private:
  HiddenImpl<Impl> impl_;
};

/// Data of each pair that exact batches keep from call to call, in device memory: triangles near
/// each other, so that a pair that has moved little is not searched again. For simulators,
/// which ask about the same pairs step by step. One batch at a time may use it.
class GpuKept {
 public:
  /// For batches of up to `most_pairs`. `bytes_each` [bytes] of device memory for a pair, 1,024 to
  /// 2^24: a pair of triangles that are near each other takes 2, a pair of their blocks 8. Pairs
  /// that take more are searched in each call.
  ///
  /// Throws Error if the device cannot be used or has no memory left.
  explicit GpuKept(std::size_t most_pairs, std::size_t bytes_each = 8192,
                   const GpuSettings& settings = {});

  std::size_t most_pairs() const noexcept;
  std::size_t bytes() const noexcept;  ///< of device memory

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  HiddenImpl<Impl> impl_;
};

/// Settings of a batch, as in PenetrationSettings. There is no relative_error: nothing goes over
/// from spheres to meshes within a batch.
struct GpuPenetrationSettings {
  Measure measure = Measure::matched;
  /// Count of sphere pairs to spend on each pair of assets; matched measure only; 0: no limit. With
  /// shapes it has no effect.
  ///
  /// The answer comes from the finest levels of detail that are expected to need no more, blended
  /// smoothly with the next coarser ones; see PenetrationSettings::pair_budget.
  std::uint32_t pair_budget = 0;
  /// Exact measure only. Keeps the near triangles of pair i of a batch for pair i of the next ones
  /// while the solids are the same and have moved little relative to each other since they were
  /// searched: by up to six steps and 0.3 of a triangle's side. Otherwise the pair is searched, and
  /// its near triangles are kept if they fit and steps are short. Solids and poses may change at
  /// will: answers have the same bits as without it, except node_visits, which is 0 for a pair that
  /// was not searched. Null: nothing is kept.
  GpuKept* kept = nullptr;
};

/// answers[i] = penetration(pairs[i]) as a finished sum, of two assets by lenses
/// (PenetrationSettings::spheres_only).
///
/// Two assets: the volume is within 1e-6 of the sum in double. Gradients are within 1e-6 of the sum
/// of the lenses' magnitudes, or of volume^(2/3) if that is more. Under a budget, and for copies of
/// one asset at nearly the same pose, the answer is the CPU's blend of such sums.
///
/// An asset and a shape, in either order: sums are in double. The volume is within 1e-9 of the
/// CPU's, or 1e-15 of the asset's size³ if that is more; gradients likewise. node_visits counts
/// opened nodes of the asset.
///
/// Measure::exact, of two assets with meshes: the true volume as in penetration(),
/// within 1e-12 of the smaller solid's size³, force and torque likewise, between volume_min and
/// volume_max, at any pose, flush, coaxial and copied ones too. sphere_pairs counts crossing
/// triangles. Solids that touch have a volume of 0, `touching`, contact_area and contact_normal, as
/// there to 1e-9 of these. A pair that needs more memory than the workspace
/// has for it is budget_exhausted, with NaN. On its first call the driver takes some 14 KB of local
/// memory for each thread that the device can hold: 3.7 GB on an H200.
///
/// The bits are the same in every run and in any batch; they depend only on whether the workspace
/// is for up to kFewGpuPairs or more, and by the exact measure not on that either.
///
/// Only launches kernels on `stream`: it allocates nothing and waits for nothing, so a CUDA graph
/// may capture it.
///
/// Throws Error if a batch is larger than the workspace or what is kept, if the devices differ, if
/// a mesh is too large for the workspace (tens of millions of triangles), or if a launch fails.
void penetration_batch(const GpuSolids& solids, const GpuPairs& pairs,
                       const GpuPenetrationSettings& settings, GpuWorkspace& workspace,
                       const GpuPenetrations& answers, CUstream_st* stream);

/// Settings of a batch, as in SeparationSettings.
struct GpuSeparationSettings {
  std::uint32_t max_visits = 0;  ///< count of node pairs opened, depth first; 0: no limit
  double max_distance = 0;       ///< [u] as in SeparationSettings; 0: no limit
};

/// answers[i] = separation(pairs[i]) of two assets: of their surfaces if both keep a mesh, else of
/// their inner spheres.
///
/// Surfaces: the distance is within 1e-9 of the CPU's, relative, or 1e-13 of the solids' size, and
/// mostly the same double; of pairs of triangles that are as near, to rounding, the one of the
/// lowest numbers answers, as there. The interval is certified as there. sphere_pairs counts
/// spheres and triangles that were measured.
///
/// Inner spheres: the distance is the least over all pairs in double. separation() selects that
/// pair in float: its distance may be larger by 1e-6 of the objects' size, and among equally near
/// pairs it may select another. The interval is certified too, and its lower end is at least
/// separation()'s.
///
/// Under a max_visits that binds the interval is certified, but differs from that of separation().
/// The bits are the same in every run, whatever else is in the batch.
///
/// Only launches kernels on `stream`, as penetration_batch().
///
/// Throws Error if a batch is larger than the workspace, if the devices differ, or if a launch
/// fails.
void separation_batch(const GpuSolids& solids, const GpuPairs& pairs,
                      const GpuSeparationSettings& settings, GpuWorkspace& workspace,
                      const GpuSeparations& answers, CUstream_st* stream);

/// answers[i] and its patches = contact_patches(pairs[i]) of two assets, without limits: the
/// contact condensed into at most `patches.most`.
///
/// By lenses (PenetrationSettings::spheres_only) patches are the same regions of the same tree as
/// there, with the same ids, unless two divisions are equally good to a float's digits. Answers
/// equal those of penetration_batch() to its precision, not bit for bit; copies of one asset at
/// nearly the same pose are not treated specially. Volumes, forces and torques of a pair's patches
/// sum to its answer's to about 1e-15.
///
/// Measure::exact, of two assets that keep their meshes: the connected parts of the overlap and
/// their octants, as contact_patches() has them of a pair without an id, within 1e-12 of the pair's
/// size and mostly the same doubles, flush, coaxial and copied ones too. answers[i] has the bits of
/// penetration_batch(). A pair that needs more memory than the workspace has for it is
/// budget_exhausted, with NaN and a count of 0.
///
/// The bits are the same in every run, whatever else is in the batch.
///
/// Only launches kernels on `stream`, as penetration_batch(). One warp processes a pair, so a very
/// large contact takes long.
///
/// Throws Error if a batch is larger than the workspace, if patches.most exceeds kMostGpuPatches,
/// if the devices differ, if a mesh is too large for the workspace, or if a launch fails.
void contact_patches_batch(const GpuSolids& solids, const GpuPairs& pairs, Measure measure,
                           GpuWorkspace& workspace, const GpuPenetrations& answers,
                           const GpuContactPatches& patches, CUstream_st* stream);

}  // namespace ist
