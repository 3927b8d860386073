#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include <ist/api.h>
#include <ist/field.h>
#include <ist/gpu.h>
#include <ist/gpu_query.h>

// Penetrations of many trees against fields at once, on a GPU: half-spaces, primitives, terrains,
// distance grids and the surfaces of assets.

namespace IST_API ist {

/// Fields in device memory, with the data they point to.
///
/// May be shared by threads.
class GpuFields {
 public:
  /// Copies the fields to the device of `settings`, with heights, distances and assets' bytes; none
  /// of it is needed afterwards. Pairs refer to them by index.
  ///
  /// A field whose numbers are out of range makes its pairs invalid_input, as on the CPU. Throws
  /// Error if the device cannot be used or has no memory left, and for a FunctionField, which a GPU
  /// cannot call.
  explicit GpuFields(std::span<const Field> fields, const GpuSettings& settings = {});
  ~GpuFields();
  GpuFields(GpuFields&&) noexcept;
  GpuFields& operator=(GpuFields&&) noexcept;

  std::size_t size() const noexcept;   ///< number of fields
  std::size_t bytes() const noexcept;  ///< of device memory
  int device() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// answers[i] = penetration(pairs[i]) of a field, held still, and a tree, finished. pairs.asset_a
/// are indices into `fields`, pairs.asset_b into `assets`.
///
/// Sums are in double: the volume is within 1e-9 of the CPU's, or within a millionth of that of the
/// tree's size³ if that is more, and gradients likewise. The bits are the same in every run,
/// whatever else is in the batch. node_visits counts opened nodes of the tree and of a mesh's
/// surface.
///
/// Only launches kernels on `stream`: it allocates nothing and waits for nothing, so a CUDA graph
/// may capture it.
///
/// Throws Error for Measure::exact, if a batch is larger than the workspace, if the devices differ,
/// or if a launch fails.
void penetration_batch(const GpuAssets& assets, const GpuFields& fields, const GpuPairs& pairs,
                       Measure measure, GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream);

}  // namespace ist
