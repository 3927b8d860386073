#pragma once

#include <cstddef>
#include <cstdint>

#include <ist/api.h>
#include <ist/pose.h>
#include <ist/query_enums.h>

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
  double* volume = nullptr;                ///< [count] [u³]
  double* centroid = nullptr;              ///< [count][3] [u] world
  double* translation_gradient = nullptr;  ///< [count][3] [u²] dV/d(translation of B), world
  /// [count][3] [u³/rad] dV/d(rotation vector of B about B's origin), world
  double* rotation_gradient = nullptr;
  /// [count] ok; invalid_input for an invalid pose, scale, field or index; not_held for two fields,
  /// and for any field in a query of two assets. Except for ok all numbers are NaN. Other pairs are
  /// not affected.
  QueryStatus* status = nullptr;
  std::uint32_t* node_visits = nullptr;   ///< [count]
  std::uint32_t* sphere_pairs = nullptr;  ///< [count]
  double* force = nullptr;                ///< [count][3] [u²] −translation_gradient: on B
  double* torque = nullptr;      ///< [count][3] [u³] −rotation_gradient: about B's origin
  double* volume_min = nullptr;  ///< [count] [u³] of the true volume; by spheres: the volume
  double* volume_max = nullptr;  ///< [count] [u³] likewise
};

/// Answers, each as in Separation: arrays in device memory. Null pointers: not wanted.
struct GpuSeparations {
  double* distance = nullptr;      ///< [count] [u] between the inner spheres
  double* distance_min = nullptr;  ///< [count] [u] lower bound for the solids, certified
  double* distance_max = nullptr;  ///< [count] [u] upper bound, certified
  double* point_a = nullptr;       ///< [count][3] [u] on A's inner spheres, world
  double* point_b = nullptr;       ///< [count][3] [u] on B's inner spheres, world
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
  double* force = nullptr;         ///< [3] [u²] part of −translation_gradient
  double* torque = nullptr;        ///< [3] [u³/rad] part of −rotation_gradient
  double* point = nullptr;         ///< [3] [u] world, as ContactPatch::point
  double* twist = nullptr;         ///< [u³] as ContactPatch::twist
};

}  // namespace ist
