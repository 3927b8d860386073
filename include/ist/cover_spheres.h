#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <ist/api.h>
#include <ist/mesh.h>
#include <ist/progress.h>

// Few spheres that together hold a whole solid, for planners that must not be told of free space
// where there is none. Lengths are [u], the mesh's own unit and frame.

namespace IST_API ist {

/// A sphere in the mesh's own unit and frame.
struct CoverSphere {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u]
  double radius = 0;                                 ///< [u]
};

/// The most spheres that a cover is made of.
inline constexpr std::size_t kMostCoverSpheres = 4096;

/// How many spheres, or how close.
struct SphereCoverSettings {
  std::size_t count =
      64;  ///< [1, kMostCoverSpheres]; with max_protrusion the most that may be used
  /// [u] ≥ 0. 0: `count` spheres that protrude as little as they can. Else: as few spheres as are
  /// found to protrude by no more.
  double max_protrusion = 0;
  std::uint64_t seed = 0;  ///< of the search; any value serves equally well
  unsigned threads = 0;    ///< 0 = all cores; never changes the result
};

/// Whether spheres hold a solid.
struct SphereCoverProof {
  bool covered = false;  ///< every point of the solid and of its mesh lies in a sphere: proven
  /// [u] where `covered` is false: the place that is not in any sphere, or could not be proven.
  Eigen::Vector3d where = Eigen::Vector3d::Zero();
  double gap = 0;  ///< [u] from there to the nearest sphere; 0 where it is merely not proven
};

/// How far spheres reach out of a solid.
struct SphereProtrusion {
  /// [u] No point of any sphere is further from the solid: proven.
  double largest = 0;
  /// [u] Some point of a sphere is at least so far: the bound above is no further from the truth.
  double largest_seen = 0;
  double mean = 0, p95 = 0;  ///< [u] over the area of the spheres' union, by sampling
  double volume_ratio = 0;   ///< the union's volume over the solid's, by sampling (0.5 %)
};

/// Spheres that hold a solid, and the proof.
struct SphereCover {
  std::vector<CoverSphere> spheres;
  SphereProtrusion protrusion;
  bool reached = true;  ///< false: max_protrusion was not reached; these are the best
  double seconds = 0;   ///< [s] that the search took
};

/// Spheres whose union holds the solid of a closed mesh, and protrudes as little as was found.
///
/// That the union holds the solid is proven as prove_cover() does it.
/// Same mesh, settings and seed give the same spheres for any number of threads.
///
/// Throws Error on settings out of range, and when the callback cancels.
SphereCover cover_with_spheres(const ClosedMesh& mesh, const SphereCoverSettings& settings = {},
                               const ProgressCallback& progress = {});

/// The same for several meshes, on all threads at once: covers[i] is that of meshes[i].
std::vector<SphereCover> cover_with_spheres(std::span<const ClosedMesh> meshes,
                                            const SphereCoverSettings& settings = {},
                                            const ProgressCallback& progress = {});

/// Proves, in double, that every point of the solid, and every triangle of its mesh, lies in the
/// union of the spheres. Spheres of a radius that is not finite or above 0 hold nothing.
SphereCoverProof prove_cover(const ClosedMesh& mesh, std::span<const CoverSphere> spheres);

/// Measures how far spheres reach out of the solid of a closed mesh.
SphereProtrusion sphere_protrusion(const ClosedMesh& mesh, std::span<const CoverSphere> spheres);

}  // namespace ist
