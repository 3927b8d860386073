#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <ist/api.h>
#include <ist/gpu.h>
#include <ist/progress.h>
#include <ist/solid.h>
#include <ist/sphere.h>
#include <ist/stop_reason.h>

namespace IST_API ist {

/// How space is searched for the next spheres. All modes except `banded` are the paper's.
enum class GridMode : std::uint32_t {
  banded = 0,               ///< ours: a greedy packing with a guarantee
  uniform = 1,              ///< original ProtoSphere: one fixed, fine grid
  explicit_refinement = 2,  ///< one grid, coarse at first, split in 8 every few rounds
  implicit_refinement = 3,  ///< prototypes on a refined grid, distances on a fixed fine one
  hybrid = 4,               ///< both refined together
};

constexpr int kMostGridCells = 1024;  ///< on the longest side of any grid
constexpr int kMostGridRefinements = 10;

/// Grids of the modes after Weller and Zachmann (GridMode other than banded).
///
/// 0, or a negative count of refinements, is automatic: sizes are chosen from how much of its box
/// the solid fills, and that of the distance grid also from the free memory. The packing depends
/// on `start`, `refinements`, `rounds_per_level` and, for uniform, `resolution`; the rest affects
/// speed and memory.
struct GridSettings {
  unsigned start = 0;  ///< cells on the solid's longest side, first prototype grid; 1 … 1024
  /// Cells on the longest side of the fixed grid (uniform: both grids; implicit: the distance grid)
  /// or of the first distance grid (hybrid). Except for uniform it is rounded up to start · 2^k. At
  /// most 1024.
  unsigned resolution = 0;
  int refinements = -1;           ///< how often the prototype grid is split in 8; 5 if automatic
  unsigned rounds_per_level = 0;  ///< rounds before a refinement; 2 if automatic
};

/// Where packing and baking run. The result is the same, bit for bit.
enum class Device : std::uint32_t {
  automatic,  ///< the GPU if there is one, else the CPU
  cpu,
  cuda,  ///< throws Error if gpu_available() is false
};

/// Limits of a packing, and its options. The first limit met stops it.
struct PackingSettings {
  /// Count, met exactly unless another limit is met first; 0 = no limit.
  std::size_t max_spheres = 10'000;
  double target_coverage = 1.0;  ///< [0, 1] of the solid's volume
  double min_radius = 0.0;       ///< [u] smaller spheres are not inserted
  double time_limit = 0.0;  ///< [s] wall clock, 0 = none; the only setting that costs repeatability
  /// Greedy slack: every sphere is at least (1 − epsilon) times the largest that would fit when its
  /// round began. 0 = automatic: the library's schedule, fastest at equal coverage.
  double epsilon = 0.0;
  GridMode grid = GridMode::banded;
  GridSettings grids = {};            ///< for the other modes
  std::uint64_t seed = 0;             ///< tie-breaks only; any value packs equally well
  unsigned threads = 0;               ///< 0 = all cores; never changes the result
  Device device = Device::automatic;  ///< a Solid that is not a mesh is always packed on the CPU
  GpuSettings gpu = {};               ///< if `device` is a GPU
  /// The asset stores the mesh, which Measure::exact, distances of surfaces, rays and times of
  /// impact need. pack() ignores it.
  bool keep_mesh = true;
};

/// Certified, non-overlapping spheres inside a solid, in insertion order.
///
/// Every prefix is a valid packing and, under the greedy order, a good one of its size.
struct SpherePacking {
  UnitFrame frame;
  std::vector<Sphere> spheres;
  StopReason stop = StopReason::sphere_count;
  double coverage = 0;  ///< [0, 1] of the solid's volume
  /// Min over spheres of radius / largest live bound at insertion; 1 for modes without a bound.
  double kept_ratio_worst = 1;
  double kept_ratio_median = 1;    ///< median of the same
  bool below_float_noise = false;  ///< radii fell below 1e-4 of the half-extent: not greedy there
  std::size_t rounds = 0;
};

/// Fills a solid with certified spheres, large ones first.
///
/// The same solid and settings give the same spheres, bit for bit, for any number of threads
/// (except for a time limit or cancel). A cancelled packing returns what is packed so far.
///
/// Throws Error on settings out of range.
SpherePacking pack(const Solid& solid, const PackingSettings& settings = {},
                   const ProgressCallback& progress = {});

}  // namespace ist
