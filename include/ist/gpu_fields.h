#pragma once

#include <cstddef>
#include <memory>
#include <span>

#include <ist/api.h>
#include <ist/field.h>
#include <ist/gpu.h>
#include <ist/gpu_query.h>

// Penetrations of many trees in fields at once, on a GPU: grounds, walls, terrains, primitives, and
// the surfaces in assets.

namespace IST_API ist {

/// Fields in device memory, with what they point to.
///
/// Threads may share it.
class GpuFields {
 public:
  /// Copies the fields to the device of `settings`, with heights, distances and assets' bytes;
  /// nothing of them is needed afterwards. Pairs name them by their place in the list.
  ///
  /// A field whose numbers are out of range makes its pairs invalid_input, as on the CPU.
  /// Throws Error where the device cannot be used or has no memory left, and for a FunctionField,
  /// which no GPU can call.
  explicit GpuFields(std::span<const Field> fields, const GpuSettings& settings = {});
  ~GpuFields();
  GpuFields(GpuFields&&) noexcept;
  GpuFields& operator=(GpuFields&&) noexcept;

  std::size_t size() const noexcept;   ///< fields
  std::size_t bytes() const noexcept;  ///< of device memory
  int device() const noexcept;

  struct Impl;
  const Impl& impl() const noexcept { return *impl_; }

 private:
  std::unique_ptr<Impl> impl_;
};

/// answers[i] = penetration(pairs[i]) of a field, held still, and a tree, finished:
/// pairs.asset_a are places in `fields`, pairs.asset_b in `assets`.
///
/// All is summed in double: the volume is within 1e-9 of the CPU's, or of a millionth of the tree's
/// size³ where that is more, and gradients are as near.
/// The same bits in every run, whatever else is in the batch.
/// node_visits are nodes of the tree and of a mesh's surface that were opened.
/// Only launches kernels on `stream`: allocates nothing and waits for nothing, so that a CUDA graph
/// may capture it.
///
/// Throws Error for Measure::exact, where a batch is larger than the workspace, the devices differ
/// or a launch fails.
void penetration_batch(const GpuAssets& assets, const GpuFields& fields, const GpuPairs& pairs,
                       Measure measure, GpuWorkspace& workspace, const GpuPenetrations& answers,
                       CUstream_st* stream);

}  // namespace ist
