#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ist/types.h>

namespace IST_API ist {

/// Axis and unit that a file declares. Coordinates are not turned by it.
struct DeclaredFrame {
  char up_axis = 0;        ///< 'X', 'Y' or 'Z'; 0: not declared
  double unit = 0;         ///< [m] length of the file's unit; 0: not declared
  bool converted = false;  ///< lengths were multiplied by unit: they are metres
};

/// Triangles over shared vertices, in the file's own unit [u] (metres if declared.converted) and
/// frame, in double.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;                ///< [u]
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
  DeclaredFrame declared = {};                          ///< as loaded; nothing later reads it
  /// Content of the file that its reader left out though it may change the shape: one printable
  /// sentence each. close_mesh() and wrap_mesh() take them into their report.
  std::vector<std::string> notes = {};
};

/// Options of load_mesh().
struct ImportSettings {
  /// Vertices closer than this fraction of the bounding-box diagonal are one vertex. In [0, 0.1],
  /// else Error; 0 welds equal coordinates only.
  double weld_tolerance = 0;
};

/// Compares a solid made of an open surface with that surface.
///
/// The measure is the surface's generalised winding number w, clamped to [0, 1]: 1 in a closed
/// solid, less where holes are visible. Coincident triangles are reduced first, and patches are
/// oriented outward as seen from infinity. Volumes are sampled in the bounding box, at the same
/// points on any machine.
struct RepairQuality {
  double confidence = 0;  ///< [0, 1] (agreement − agreement_error) · kept_surface
  /// [0, 1] ∫ w over the solid, divided by the volume of the solid and of the places outside it
  /// where w ≥ ½.
  double agreement = 0;
  double agreement_error = 0;  ///< twice its standard error, plus a bound on what the samples may
                               ///< have missed
  /// [0, 1] Share of the input's area within 1e-4 diagonals of the solid's surface, for a wrapped
  /// mesh within twice its detail.
  double kept_surface = 0;
  double volume_ratio = 0;  ///< volume where w ≥ ½ over that of the solid
  double input_mean = 0;    ///< [u] mean distance from the input's surface to the solid's
  double input_max = 0;     ///< [u] the same, largest of 8,192 points
  double made_mean = 0;     ///< [u] from the solid's surface to the input's
  double made_max = 0;      ///< [u] likewise
};

/// Results of import and validation. Counts refer to the welded input mesh, unless they name the
/// closed one.
struct MeshReport {
  std::size_t vertices = 0;              ///< referenced vertices after welding
  std::size_t triangles = 0;             ///< as imported
  std::size_t components = 0;            ///< edge-connected shells
  std::size_t boundary_edges = 0;        ///< edges with one triangle
  std::size_t nonmanifold_edges = 0;     ///< edges with three or more triangles
  std::size_t nonmanifold_vertices = 0;  ///< where sheets touch in one point only (bow-ties)
  std::size_t inconsistent_edges = 0;    ///< edges whose two triangles disagree about the outside
  std::size_t flipped_components = 0;    ///< shells turned outward by validation
  std::size_t cavities = 0;              ///< inward shells that lie inside an outward one
  std::size_t degenerate_triangles = 0;  ///< zero area or repeated corners
  std::size_t coincident_triangles = 0;  ///< removed as copies or cancelled pairs
  std::size_t self_intersections = 0;    ///< pairs of triangles that meet outside shared corners
  bool self_intersections_counted = false;  ///< false: too many triangles, not searched for
  std::size_t shells = 0;        ///< of the closed mesh: pieces that are oriented one by one
  bool meets_itself = true;      ///< the closed mesh: its triangles intersect, or may (not counted)
  std::size_t filled_holes = 0;  ///< boundary loops closed by repair
  bool closed = false;           ///< bounds a solid
  bool repaired = false;         ///< repair changed the mesh
  bool wrapped = false;          ///< the mesh was made by wrap_mesh()
  std::optional<RepairQuality> judged;  ///< of a repaired or wrapped mesh
  double volume = 0;                    ///< [u³] divergence theorem; counts self-overlaps twice
  Eigen::AlignedBox3d bounds;           ///< [u] of the referenced vertices
  std::vector<std::string> notes;       ///< one printable sentence per finding
};

/// A mesh that bounds a solid: every edge balanced, every shell oriented. A point is inside where
/// the winding number is ≥ 1.
struct ClosedMesh {
  TriangleMesh mesh;
  MeshReport report;
  std::string name;  ///< for messages: the file's path, or the caller's name
  /// Pairs of triangles of `mesh` (indices, the smaller first, sorted) that meet elsewhere than in
  /// the corners and sides they share; without degenerate triangles. Saves a second search. Empty
  /// optional: not known, because they were not searched or exceed ten million. Reset it when you
  /// change `mesh`.
  std::optional<std::vector<std::array<std::uint32_t, 2>>> meeting_pairs = {};
};

/// The treatment of a mesh that does not bound a solid.
enum class OpenMeshPolicy {
  refuse,  ///< throw OpenMeshError with the place of the first open edge
  /// Weld cracks, fill holes, drop open sheets and fins; report and judge the result. Throw
  /// OpenMeshError if the confidence is too low.
  repair,
};

/// Reads a mesh file: OBJ, STL, PLY, OFF, GLB/glTF and DAE by readers of this library, level sets
/// of OpenVDB as load_vdb() does, all others by assimp.
///
/// The file's own node transforms are applied; in glTF also skins, morph weights and instances.
/// Axes and units are not converted, except that COLLADA is scaled to metres. Vertices are welded.
/// TriangleMesh::notes lists what was left out and may change the shape.
///
/// Throws Error (file, place, remedy). Thread-safe.
TriangleMesh load_mesh(const std::string& path, const ImportSettings& settings = {});

/// Multiplies the coordinates by a factor for each axis. Negative factors mirror; triangles stay
/// counter-clockwise. Throws Error if a factor is 0 or not finite.
void scale_mesh(TriangleMesh& mesh, const Eigen::Vector3d& factors);

/// Validates and orients a mesh: reduces coincident faces to their signed sum, drops degenerate
/// triangles, orients every shell.
///
/// Throws Error for a mesh that is flat, empty, not finite or non-orientable. Throws OpenMeshError
/// for one that is open under OpenMeshPolicy::refuse, or that OpenMeshPolicy::repair cannot close
/// with confidence. Thread-safe.
ClosedMesh close_mesh(TriangleMesh mesh, const std::string& name,
                      OpenMeshPolicy policy = OpenMeshPolicy::refuse);

/// A closed surface around any triangles. The solid is where their generalised winding number is ½
/// or more (RepairQuality states how triangles are oriented first). Parts thinner than the detail
/// are thickened by the detail on either side. Holes are closed where the winding number passes ½.
///
/// `detail`: edge of the sampling lattice over the diagonal of the mesh's bounds, in [1e-3, 0.1];
/// finer features are lost. Time grows with its inverse square, memory with its inverse cube.
///
/// The report is that of the resulting mesh, with `wrapped` set and `judged` against the input.
/// Runs on the threads of the current arena; the bytes do not depend on their number. Throws Error
/// for a mesh that is empty or not finite, and if nothing is left to wrap.
ClosedMesh wrap_mesh(TriangleMesh mesh, const std::string& name, double detail);

}  // namespace ist
