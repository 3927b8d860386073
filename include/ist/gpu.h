#pragma once

#include <cstddef>
#include <string>

#include <ist/api.h>

// Settings for packing and baking on a GPU. Needs no CUDA header: cudaStream_t is a pointer to
// CUstream_st.

struct CUstream_st;

namespace IST_API ist {

/// Source of device memory, in stream order: memory freed on a stream may be reused by later work
/// of that stream without waiting. May be called from any host thread that bakes.
class DeviceMemoryResource {
 public:
  virtual ~DeviceMemoryResource() = default;

  /// Device memory of the current device, aligned to 256 bytes, or nullptr if there is none left.
  virtual void* allocate(std::size_t bytes, CUstream_st* stream) = 0;
  virtual void deallocate(void* memory, std::size_t bytes, CUstream_st* stream) noexcept = 0;
};

/// Device, stream and memory of a bake. Bakes that run at the same time need different streams; the
/// result does not depend on it.
///
/// With neither stream nor memory set, a bake with levels of detail uses two streams. The first has
/// high priority, so the bake finishes earlier; it needs some more memory.
struct GpuSettings {
  int device = 0;                          ///< CUDA device index
  CUstream_st* stream = nullptr;           ///< null: made for the call
  DeviceMemoryResource* memory = nullptr;  ///< null: the device's own memory pool, which is kept
};

/// A GPU that this build can use.
struct GpuInfo {
  std::string name;
  int compute_capability = 0;    ///< 90 for 9.0
  std::size_t total_memory = 0;  ///< bytes
  std::size_t free_memory = 0;   ///< bytes
};

/// Whether this build can bake on device `device`. If not, `why` receives what is missing (no GPU
/// backend in this build, no device, no code for it, a driver that is too old, …). Creates the
/// device's CUDA context, if there is a device.
bool gpu_available(int device = 0, std::string* why = nullptr);

/// Throws Error, with the remedy, if gpu_available() is false.
GpuInfo gpu_info(int device = 0);

}  // namespace ist
