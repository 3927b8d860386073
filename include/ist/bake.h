#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <ist/asset.h>
#include <ist/gpu.h>
#include <ist/mesh.h>
#include <ist/solid.h>
#include <ist/types.h>

namespace IST_API ist {

/// The search for the next spheres. All modes except `banded` are the paper's.
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

/// The device for packing and baking. The result is the same, bit for bit.
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

/// Makes the asset of a closed mesh: inner spheres, matched spheres, cover radii, trees and the
/// mesh.
///
/// The same mesh, settings and seed give the same bytes on any machine, CPU or GPU, for any number
/// of threads. Cancelling during packing keeps the spheres so far; before and after packing it
/// throws Error.
///
/// A mesh that counts volume twice is first resolved to the boundary of the set where its winding
/// number is 1 or more (MeshState::resolved). If that fails, no mesh is kept
/// (MeshState::unresolved).
///
/// Throws Error if no sphere fits and on settings out of range.
Asset bake(const ClosedMesh& mesh, const PackingSettings& settings = {},
           const ProgressCallback& progress = {});

/// Makes a mesh-only asset: the mesh, mass properties and bounds, without spheres. Takes about
/// as long as the import.
///
/// It serves Measure::exact and mass_properties(); queries of spheres return
/// QueryStatus::missing_data.
///
/// `threads`: 0 = all cores. The only stage of `progress` is "resolve". Throws Error if the
/// mesh counts volume twice and cannot be resolved, and if the callback cancels.
Asset bake_mesh_only(const ClosedMesh& mesh, unsigned threads = 0,
                     const ProgressCallback& progress = {});

/// Options of the mesh that is made in place of a solid, for calibration.
struct PolygoniseSettings {
  /// Cells along the longest side of the bounds, [8, 1024]. Time and memory grow with the square.
  /// 0: chosen from the sphere count, 32 to 256, for an error of some 5 % of the mean radius; up to
  /// four times that where curved faces meet at an edge.
  unsigned cells = 0;
  std::string name = "solid";  ///< for messages; no part of the asset
};

/// Makes the asset of any solid known by its signed distance: CSG, functions, distance grids.
///
/// Inner spheres and cover radii are certified against the solid itself, on the CPU, by the banded
/// mode alone. Matched spheres and volume are those of a mesh in its place. The proven distance
/// between the surfaces of both is in the asset (AssetHeader::polygonise_error, kFlagPolygonised)
/// and counts into the protrusion. The volume's error is its difference from solid.volume() plus
/// solid.volume_error(). If solid.mesh() is a mesh, this is the bake of that mesh.
///
/// The same solid, settings and cells give the same bytes for any number of threads, and on any
/// machine if signed_distance() does. The solid is evaluated from many threads at once, and at some
/// points outside its bounds. Progress reports the stage "polygonise" first; cancelling it throws
/// Error.
///
/// Throws Error as the bake of a mesh does; if the signed distance is found not to be 1-Lipschitz
/// or not finite; if the solid reaches out of its bounds; if no cell contains a part of it; and for
/// a grid mode other than banded.
Asset bake(const Solid& solid, const PackingSettings& settings = {},
           const ProgressCallback& progress = {}, const PolygoniseSettings& meshing = {});

/// Wanted accuracy of an asset's volumes.
struct ErrorTarget {
  double relative_error = 0.01;  ///< (0, 1) median over random poses, for every TrialPartner
  double at_overlap = 0.001;     ///< [1e-4, 0.5] of the solid's volume, within half a decade
};

/// Error of an asset against one kind of partner, near the requested overlap.
struct PartnerError {
  TrialPartner partner = TrialPartner::copy;
  double median = 0;        ///< relative
  std::uint32_t poses = 0;  ///< too few to count if the partner hardly reaches the overlap
};

/// Result of bake_to_error(). AssetView::predicted_errors() has more.
struct TargetedAsset {
  Asset asset;
  double measured_error = 0;  ///< relative, median near the requested overlap, of the worst partner
  std::uint32_t poses = 0;    ///< of all partners; 0: none was found, or time ran out
  std::array<PartnerError, kTrialPartners> partners = {};  ///< error of each
  bool met = false;  ///< poses > 0 and measured_error ≤ the requested one
  /// The reason for the end of the search. sphere_count: the target is met with few spheres, or not
  /// met with the largest allowed count. time_limit: the best asset until then, met or not. Else
  /// the limit that stopped the packing.
  StopReason stop = StopReason::sphere_count;
};

/// bake() with about as few spheres as the target needs, at most settings.max_spheres (0 =
/// 200,000). If those are not enough, the best asset is returned, and the result says so.
///
/// The asset is tried against a copy of itself and, as an analytic field, each other TrialPartner.
/// The target is met if the worst partner's median meets it. The truth is exact, at some 300 poses
/// with independent random rotations. The asset stores the medians of the copies and the worst
/// partner.
///
/// settings.time_limit bounds everything except the first bake, of a few hundred spheres. Takes up
/// to about six times a bake of the final count. Reports the stages of each bake, and "predict".
///
/// Throws Error as bake() does, whenever the callback cancels, and for a mesh that counts volume
/// twice and cannot be resolved: there is no exact volume to measure by.
TargetedAsset bake_to_error(const ClosedMesh& mesh, const ErrorTarget& target,
                            const PackingSettings& settings = {},
                            const ProgressCallback& progress = {});

/// One proven property of an asset.
struct Invariant {
  std::string name;  ///< "sphere inside solid", …
  /// Largest measure of a violation, unit as in `meaning`; ≤ 0 is sound unless stated.
  double worst = 0;
  std::string meaning;      ///< what `worst` measures, with its unit
  std::size_t where = 0;    ///< index of the worst sphere, node, triangle or cell
  std::size_t checked = 0;  ///< count of them, or of pairs, that were checked
  std::size_t violations = 0;
};

/// Proves every invariant of an asset again, in double, from its bytes and the mesh alone. It
/// shares no code with packing except the mesh.
///
/// `threads`: 0 = all cores. Throws Error if the asset is of another mesh.
std::vector<Invariant> check(const Asset& asset, const ClosedMesh& mesh, unsigned threads = 0);

/// The same for an asset of any solid, from its bytes and the solid's signed distance alone.
///
/// Data calibrated with a mesh in the solid's place is proven against that mesh, which is made
/// again.
///
/// Throws Error if that mesh shows that the asset is of another solid, and if the solid is a mesh:
/// use its ClosedMesh then.
std::vector<Invariant> check(const Asset& asset, const Solid& solid, unsigned threads = 0);

/// A point of a solid's medial axis, where a ball touches the surface from several sides.
struct MedialNode {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [u], the mesh's frame
  double radius = 0;  ///< [u] distance from the surface, within 4e-6 of the half-extent
  int contacts = 0;   ///< directions found to the surface, over 45° apart: 2, 3, 4 or more
};

struct MedialSettings {
  unsigned resolution = 0;  ///< cells on the solid's longest side, one node each at most; 1 … 1024
                            ///< or 0 = automatic (32–72)
  std::uint64_t seed = 0;  ///< other seeds give other nodes of the same axis
  unsigned threads = 0;    ///< 0 = all cores; never changes the result
  Device device = Device::automatic;
  GpuSettings gpu = {};  ///< if `device` is a GPU
};

/// An approximation of the medial axis: the first round of a grid packing.
///
/// One prototype per grid cell moves away from the surface, confined to its cell. Those that come
/// to rest between surface points over 45° apart are the nodes: Voronoi nodes between four, else
/// points of the axis' sheets and seams. Ordered by cell; the same for any device and number of
/// threads.
///
/// Throws Error on settings out of range, and for a Solid that is not a mesh.
std::vector<MedialNode> medial_nodes(const Solid& solid, const MedialSettings& settings = {});

}  // namespace ist
