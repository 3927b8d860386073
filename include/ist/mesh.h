#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ist/api.h>

namespace IST_API ist {

/// What a file says of its axes and its unit. No coordinate is turned by it.
struct DeclaredFrame {
  char up_axis = 0;  ///< 'X', 'Y' or 'Z'; 0: the file does not say
  double unit = 0;   ///< [m] length of the file's unit; 0: the file does not say
};

/// Triangles over shared vertices, in the file's own unit [u] and frame, in double.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;                ///< [u]
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from outside
  DeclaredFrame declared = {};                          ///< as loaded; nothing later reads it
};

/// How a file becomes a TriangleMesh.
struct ImportSettings {
  /// Vertices closer than this fraction of the bounding-box diagonal are one vertex.
  /// In [0, 0.1], else Error; 0 welds equal coordinates only.
  double weld_tolerance = 0;
};

/// How a solid that was made of a surface that is not closed compares with that surface.
///
/// The measure is the surface's generalised winding number w, cut to [0, 1]: 1 in a closed solid,
/// less where holes are looked through. Before it is asked, coincident triangles are reduced and
/// patches turned to show their fronts to the outside.
/// Volumes are sampled in the bounding box, at the same points on any machine.
struct Judgement {
  double confidence = 0;  ///< [0, 1] (agreement − agreement_error) · kept_surface
  /// [0, 1] ∫ w over the solid, by the volume of the solid and of where w ≥ ½ besides.
  double agreement = 0;
  double agreement_error = 0;  ///< of it, twice the standard error and what no sample may have met
  /// [0, 1] of the input's area: within 1e-4 diagonals of the solid's surface, of a wrapped mesh's
  /// within twice its detail.
  double kept_surface = 0;
  double volume_ratio = 0;  ///< volume where w ≥ ½ over that of the solid
  double input_mean = 0;    ///< [u] distance from the input's surface to the solid's, mean
  double input_max = 0;     ///< [u] the same, largest of 8,192 points
  double made_mean = 0;     ///< [u] from the solid's surface to the input's
  double made_max = 0;      ///< [u] likewise
};

/// What import and validation found. Counts refer to the welded mesh as it came, unless they name
/// the closed one.
struct MeshReport {
  std::size_t vertices = 0;              ///< referenced vertices after welding
  std::size_t triangles = 0;             ///< as imported
  std::size_t components = 0;            ///< edge-connected shells
  std::size_t boundary_edges = 0;        ///< edges with one triangle
  std::size_t nonmanifold_edges = 0;     ///< edges with three or more triangles
  std::size_t nonmanifold_vertices = 0;  ///< where sheets touch in a point only (bow-ties)
  std::size_t inconsistent_edges = 0;    ///< edges whose two triangles disagree about the outside
  std::size_t flipped_components = 0;    ///< shells turned outward by validation
  std::size_t cavities = 0;              ///< inward shells that lie inside an outward one
  std::size_t degenerate_triangles = 0;  ///< zero area or repeated corners
  std::size_t coincident_triangles = 0;  ///< removed as copies or cancelled pairs
  std::size_t self_intersections =
      0;  ///< triangle pairs that meet elsewhere than in shared corners
  bool self_intersections_counted = false;  ///< false: too many triangles, not looked for
  std::size_t shells = 0;    ///< of the closed mesh: pieces that are oriented one by one
  bool meets_itself = true;  ///< the closed mesh: triangles of it intersect, or may (not counted)
  std::size_t filled_holes = 0;     ///< boundary loops closed by repair
  bool closed = false;              ///< bounds a solid
  bool repaired = false;            ///< repair changed the mesh
  bool wrapped = false;             ///< the mesh was made by wrap_mesh()
  std::optional<Judgement> judged;  ///< of a repaired or wrapped mesh
  double volume = 0;                ///< [u³] divergence theorem; counts self-overlaps twice
  Eigen::AlignedBox3d bounds;       ///< [u] of the referenced vertices
  std::vector<std::string> notes;   ///< one sentence a finding, ready to print
};

/// A mesh that bounds a solid: every edge balanced, every shell oriented.
/// A point is inside where the winding number is ≥ 1.
struct ClosedMesh {
  TriangleMesh mesh;
  MeshReport report;
  std::string name;  ///< for messages: the file's path, or what the caller called it
  /// Pairs of triangles of `mesh` (indices, the smaller first, sorted) that meet elsewhere than in
  /// the corners and sides they share; degenerate triangles are in none. Saves a second search.
  /// Nothing: not known, because they were not looked for or are more than ten million. Reset it
  /// when you change `mesh`.
  std::optional<std::vector<std::array<std::uint32_t, 2>>> meeting_pairs = {};
};

/// What to do with a mesh that does not bound a solid.
enum class OpenMeshPolicy {
  refuse,  ///< throw OpenMeshError that names the first open edge
  /// Weld cracks, fill holes, drop what cannot bound a solid; say so in the report, and judge it:
  /// throw OpenMeshError where the confidence is too low.
  repair,
};

/// Reads a mesh file: OBJ, STL, PLY, OFF, GLB/glTF and DAE by readers of this library, level sets
/// of OpenVDB as load_vdb() does, the rest through assimp. The file's own node transforms are
/// applied; axes are left as they are, whichever the file declares to be up, and so are units (a
/// DAE alone comes out in metres, by the unit that it declares). Vertices are welded. Throws Error
/// (file, place, way out). Thread-safe.
TriangleMesh load_mesh(const std::string& path, const ImportSettings& settings = {});

/// Validates and orients a mesh: reduces coincident faces to their signed sum, drops degenerate
/// triangles, orients every shell. Throws Error for a mesh that is flat, empty,
/// not finite, non-orientable, or, as OpenMeshError, open under OpenMeshPolicy::refuse or not to be
/// closed with confidence under OpenMeshPolicy::repair. Thread-safe.
ClosedMesh close_mesh(TriangleMesh mesh, const std::string& name,
                      OpenMeshPolicy policy = OpenMeshPolicy::refuse);

/// A closed surface around any triangles, however they meet: the solid is where their generalised
/// winding number is ½ or more (Judgement says how triangles are turned before), and what is
/// thinner than the detail asked for is given that thickness to either side. Holes are closed where
/// the winding number passes ½.
///
/// `detail`: edge of the lattice it is sampled on, over the diagonal of the mesh's bounds, in
/// [1e-3, 0.1]; what is finer is lost. Time and memory grow with its inverse square and cube.
///
/// The report is that of the made mesh, with `wrapped` set and `judged` against the input.
/// Same bytes for any number of threads, which are those of the current arena.
/// Throws Error for a mesh that is empty or not finite, and where nothing is left to wrap.
ClosedMesh wrap_mesh(TriangleMesh mesh, const std::string& name, double detail);

}  // namespace ist
