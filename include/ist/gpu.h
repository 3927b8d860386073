#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include <ist/types.h>

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

/// Owns an object of a type that only the library defines.
template <class Impl>
struct HiddenImpl : std::unique_ptr<Impl, void (*)(Impl*)> {
  explicit HiddenImpl(Impl* own)
      : std::unique_ptr<Impl, void (*)(Impl*)>(own, [](Impl* impl) { delete impl; }) {}
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

// Pairs and answers of batches on a GPU (<ist/gpu_query.h>): arrays in device memory that the
// caller owns. Device code may include it.

namespace IST_API ist {

/// One side of all pairs of a batch: arrays of their count in device memory.
struct GpuPlacedSolids {
  const std::uint32_t* solid = nullptr;  ///< index into GpuSolids
  const Pose* pose = nullptr;            ///< null: all at the origin, not rotated
  const double* scale = nullptr;         ///< null: 1
};

/// Placed pairs of solids.
struct GpuPairs {
  std::size_t count = 0;
  GpuPlacedSolids a, b;
};

/// Largest batch size that uses the low-latency partitioning; see GpuWorkspace.
inline constexpr std::size_t kFewGpuPairs = 16'384;

/// Answers, each as in Penetration: arrays in device memory. Null: not computed.
struct GpuPenetrations {
  double* volume = nullptr;    ///< [count] [u³]
  double* centroid = nullptr;  ///< [count][3] [u] world
  double* force = nullptr;     ///< [count][3] [u²] on B, as Penetration::force
  double* torque = nullptr;    ///< [count][3] [u³/rad] about B's origin, as Penetration::torque
  /// [count] ok; invalid_input for an invalid pose, scale, field or index; missing_data for two
  /// shapes, and for any shape in a query of two assets. Except for ok all numbers are NaN. Other
  /// pairs are not affected.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count]
  double* volume_min = nullptr;  ///< [count] [u³] of the true volume; by spheres: the volume
  double* volume_max = nullptr;  ///< [count] [u³] likewise
  // For touching solids by Measure::exact; else 0.
  double* contact_area = nullptr;    ///< [count] [u²] as Penetration::contact_area
  double* contact_normal = nullptr;  ///< [count][3] unit, from A to B, world
  bool* touching = nullptr;          ///< [count]
};

/// Answers, each as in Separation: arrays in device memory. Null pointers: not wanted.
struct GpuSeparations {
  double* distance = nullptr;      ///< [count] [u] between surfaces or inner spheres
  double* distance_min = nullptr;  ///< [count] [u] lower bound for the solids, certified
  double* distance_max = nullptr;  ///< [count] [u] upper bound, certified
  double* point_a = nullptr;       ///< [count][3] [u] on A's surface or spheres, world
  double* point_b = nullptr;       ///< [count][3] [u] on B's surface or spheres, world
  double* normal = nullptr;        ///< [count][3] unit, from A to B, world
  /// [count] ok; budget_exhausted under max_visits; others as in GpuPenetrations.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count] measured
};

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
  double* force = nullptr;         ///< [3] [u²] part of GpuPenetrations::force
  double* torque = nullptr;        ///< [3] [u³/rad] part of GpuPenetrations::torque
  double* point = nullptr;         ///< [3] [u] world, as ContactPatch::point
  double* torsion = nullptr;       ///< [u³] as ContactPatch::torsion
};

}  // namespace ist
