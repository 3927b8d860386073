#pragma once

#include <cstddef>
#include <string>

#include <ist/api.h>

// How packing and baking use a GPU. Needs no CUDA header: cudaStream_t is a pointer to CUstream_st.

struct CUstream_st;

namespace IST_API ist {

/// Where device memory comes from, in stream order: what is freed on a stream may be handed out to
/// later work of that stream without waiting. May be called from any host thread that bakes.
class DeviceMemoryResource {
 public:
  virtual ~DeviceMemoryResource() = default;

  /// Device memory of the current device, aligned to 256 bytes, or nullptr if there is none left.
  virtual void* allocate(std::size_t bytes, CUstream_st* stream) = 0;
  virtual void deallocate(void* memory, std::size_t bytes, CUstream_st* stream) noexcept = 0;
};

/// Which device, stream and memory a bake uses. Every bake that runs at the same time as another
/// needs a stream of its own; the result does not depend on it. A bake that is given neither stream
/// nor memory, and has levels of detail, works on two streams at once, of which the first comes
/// before a device's work of usual priority: it is done sooner, and needs some more memory.
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

/// Whether this build can bake on device `device` here; if not, `why` says what is missing (no GPU
/// backend in this build, no device, no code for it, a driver that is too old, …). Makes the
/// device's CUDA context, if there is a device.
bool gpu_available(int device = 0, std::string* why = nullptr);

/// Throws Error, with the way out, where gpu_available() is false.
GpuInfo gpu_info(int device = 0);

}  // namespace ist
