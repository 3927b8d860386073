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
  std::size_t filled_holes = 0;    ///< boundary loops closed by repair
  bool closed = false;             ///< bounds a solid
  bool repaired = false;           ///< repair changed the mesh
  double volume = 0;               ///< [u³] divergence theorem; counts self-overlaps twice
  Eigen::AlignedBox3d bounds;      ///< [u] of the referenced vertices
  std::vector<std::string> notes;  ///< one sentence a finding, ready to print
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
  repair,  ///< weld cracks, fill holes, drop what cannot bound a solid; say so in the report
};

/// Reads a mesh file: OBJ, STL, PLY, OFF, GLB/glTF and DAE by readers of this library, level sets
/// of OpenVDB as load_vdb() does, the rest through assimp. The file's own node transforms are
/// applied; axes are left as they are, whichever the file declares to be up, and so are units (a
/// DAE alone comes out in metres, by the unit that it declares). Vertices are welded. Throws Error
/// (file, place, way out). Thread-safe.
TriangleMesh load_mesh(const std::string& path, const ImportSettings& settings = {});

/// Validates and orients a mesh: reduces coincident faces to their signed sum, drops degenerate
/// triangles, orients every shell. Throws Error for a mesh that is flat, empty,
/// not finite, non-orientable, or, as OpenMeshError, open under OpenMeshPolicy::refuse.
/// Thread-safe.
ClosedMesh close_mesh(TriangleMesh mesh, const std::string& name,
                      OpenMeshPolicy policy = OpenMeshPolicy::refuse);

}  // namespace ist
