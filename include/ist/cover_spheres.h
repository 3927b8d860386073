#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

// Few spheres, or capsules, that together cover a whole solid, for motion planners. Lengths are
// [u], the mesh's own unit and frame.

namespace IST_API ist {

/// A sphere in the mesh's own unit and frame.
struct CoverSphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u]
  double radius = 0;                                 ///< [u]
};

/// The largest number of spheres of a cover.
inline constexpr std::size_t kMostCoverSpheres = 4096;

/// How far spheres may protrude from a place of a mesh's surface outward, such as where another
/// link of a robot passes close by: [u] above 0. `outward`: unit, or zero for the least in any
/// direction.
/// Called from many threads at once.
using ProtrusionRoom =
    std::function<double(const Eigen::Vector3d& place, const Eigen::Vector3d& outward)>;

/// Number of spheres, or their largest protrusion.
struct SphereCoverSettings {
  /// [1, kMostCoverSpheres] of each mesh; with max_protrusion the most that may be used.
  std::size_t count = 64;
  /// For several meshes: counts[i] replaces `count` where it is not 0. Empty, or one per mesh.
  std::vector<std::size_t> counts = {};
  /// Not 0: largest number of spheres of all meshes together. Meshes without a count of their own
  /// share the rest, such that the largest protrusion of all is small. Excludes max_protrusion.
  std::size_t total = 0;
  /// [u] ≥ 0. 0: `count` spheres that protrude as little as possible. Else: the fewest spheres
  /// found that protrude by no more.
  double max_protrusion = 0;
  /// With max_protrusion: places where spheres should protrude by less. This guides the search, for
  /// about as few spheres as will do, and is never proven. Empty, or one per mesh, which may be
  /// null.
  std::vector<ProtrusionRoom> room = {};
  std::uint64_t seed = 0;  ///< of the search; any value works equally well
  unsigned threads = 0;    ///< 0 = all cores; never changes the result
};

/// Whether spheres cover a solid.
struct SphereCoverProof {
  bool covered = false;  ///< every point of the solid and of its mesh lies in a sphere: proven
  /// [u] If `covered` is false: the place that lies in no sphere, or could not be proven.
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  double gap = 0;  ///< [u] from there to the nearest sphere; 0 if merely unproven
};

/// How far spheres protrude from a solid.
struct SphereProtrusion {
  /// [u] No point of any sphere is further from the solid: proven.
  double largest = 0;
  /// [u] Some point of a sphere is at least this far: a lower bound of the true value.
  double largest_seen = 0;
  double mean = 0, p95 = 0;  ///< [u] over the area of the spheres' union, by sampling
  double volume_ratio = 0;   ///< the union's volume over the solid's, by sampling (0.5 %)
};

/// Spheres that cover a solid, with their proven protrusion.
struct SphereCover {
  std::vector<CoverSphere> spheres;
  SphereProtrusion protrusion;
  bool reached = true;  ///< false: max_protrusion was not reached; these are the best
  double seconds = 0;   ///< [s] time of the search
};

/// Spheres whose union covers the solid of a closed mesh and protrudes as little as was found.
///
/// The cover is proven as by prove_cover(). The same mesh, settings and seed give the same spheres
/// for any number of threads.
///
/// Throws Error on settings out of range, and when the callback cancels.
SphereCover cover_with_spheres(const ClosedMesh& mesh, const SphereCoverSettings& settings = {},
                               const ProgressCallback& progress = {});

/// The same for several meshes, on all threads at once: covers[i] is that of meshes[i]. Equal
/// meshes are covered once: the others' `seconds` is 0.
std::vector<SphereCover> cover_with_spheres(std::span<const ClosedMesh> meshes,
                                            const SphereCoverSettings& settings = {},
                                            const ProgressCallback& progress = {});

/// About how many spheres protrude from the solid by no more than max_protrusion, and than `room`:
/// those of a plain choice, which is quick. Above `enough` it is a lower bound.
std::size_t estimated_count(const ClosedMesh& mesh, double max_protrusion,
                            const ProtrusionRoom& room = {},
                            std::size_t enough = kMostCoverSpheres);

/// Proves, in double, that every point of the solid, and every triangle of its mesh, lies in the
/// union of the spheres. Spheres whose radius is not finite or not above 0 cover nothing.
SphereCoverProof prove_cover(const ClosedMesh& mesh, std::span<const CoverSphere> spheres);

/// Measures how far spheres protrude from the solid of a closed mesh.
SphereProtrusion sphere_protrusion(const ClosedMesh& mesh, std::span<const CoverSphere> spheres);

/// Makes a cover contain every triangle of a surface too, such as one that a mesh was repaired
/// from: spheres that nearly hold a part of it grow by a tenth of the largest protrusion at most,
/// others are added, at most as many as there are or 8. Every part lies in one sphere by
/// construction.
///
/// `surface`: in the cover's frame. protrusion.largest then bounds the distance from the solid and
/// the surface; the mean, the 95th percentile and the volume stay those of the cover before.
void extend_cover(const TriangleMesh& surface, SphereCover& cover);

/// Every point within `radius` of a segment.
struct CoverCapsule {
  Eigen::Vector3d begin = Eigen::Vector3d::Zero(), end = begin;  ///< [u] of the segment
  double radius = 0;                                             ///< [u]
};

/// The largest number of capsules of a cover.
inline constexpr std::size_t kMostCoverCapsules = 12;

/// Capsules that together contain a mesh and its solid, with about the least sum of volumes: at
/// most `count`, and fewer where more do not reduce it.
///
/// Proven: parallel planes divide the solid, and each capsule is convex and contains the corners of
/// its part; radii include a bound on rounding. `threads`: 0: all cores; never changes the result.
/// Throws Error for a mesh without triangles, and for a count of 0 or above kMostCoverCapsules.
std::vector<CoverCapsule> cover_with_capsules(const ClosedMesh& mesh, std::size_t count = 1,
                                              unsigned threads = 0);

}  // namespace ist
