#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

namespace IST_API ist {

/// Places a solid in the unit cube by a shift and a power of two, so that nothing later depends on
/// the mesh's unit or offset: x_unit = (x − centre) · 2^−exponent.
struct UnitFrame {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< [u]
  int exponent = 0;                                  ///< half-extent in (½, 1] after scaling

  double scale() const;  ///< [u] length of one unit-frame unit, 2^exponent
  Eigen::Vector3d to_unit(const Eigen::Vector3d& x) const { return (x - centre) / scale(); }
  Eigen::Vector3d from_unit(const Eigen::Vector3d& x) const { return x * scale() + centre; }
};

/// The frame whose cube of half-extent in (½, 1] contains the box. Throws Error for an empty,
/// infinite or zero-size box.
UnitFrame unit_frame(const Eigen::AlignedBox3d& bounds);

class MeshSolid;

/// Anything that can be packed: a set of points with a signed distance. Implementations are
/// immutable; every function may be called from many threads at once.
class Solid {
 public:
  virtual ~Solid() = default;

  /// [u] distance to the surface, negative inside, positive outside; 1-Lipschitz. Its magnitude
  /// may underestimate the true distance (as CSG by min and max does), never overestimate it.
  virtual double signed_distance(const Eigen::Vector3d& x) const = 0;

  virtual Eigen::AlignedBox3d bounds() const = 0;  ///< [u] contains the whole solid
  virtual double volume() const = 0;               ///< [u³]
  virtual double volume_error() const {
    return 0;
  }  ///< [u³] bound on volume(); see each make_… function

  /// The mesh that bounds the solid, if it is one (make_solid): it is then packed by its triangles,
  /// also on a GPU. Null for every other solid.
  virtual const MeshSolid* mesh() const noexcept { return nullptr; }
};

/// The solid of a closed mesh: where its winding number is ≥ 1, so that volume shared by two shells
/// counts once. Copies the mesh.
std::unique_ptr<Solid> make_solid(const ClosedMesh& mesh);

/// Analytic solids. Radii and half-extents [u] must be finite and > 0, else Error.
std::unique_ptr<Solid> make_ball(const Eigen::Vector3d& centre, double radius);
std::unique_ptr<Solid> make_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half_extent);
/// Torus about the z axis: `major` is the radius of the tube's centre line, `minor` ≤ `major` that
/// of the tube.
std::unique_ptr<Solid> make_torus(const Eigen::Vector3d& centre, double major, double minor);

/// The solid where a function [u] is < 0.
///
/// The function must be 1-Lipschitz, must be 0 or more outside `bounds` [u], and may be called from
/// many threads at once. Divide a smooth function by a bound of its slope. If the function is not
/// 1-Lipschitz, spheres may protrude and parts may be missed: bake() tests some thousand pairs of
/// points and throws Error with a place; pack() tests nothing. The volume is as for the boolean
/// combinations below. Throws Error for a null function or an empty box.
std::unique_ptr<Solid> make_function_solid(
    std::function<double(const Eigen::Vector3d&)> signed_distance,
    const Eigen::AlignedBox3d& bounds);

/// Boolean combinations by min and max of signed distances.
///
/// Their volume is integrated on first use (some 0.1 s). volume_error() is then an estimate with a
/// margin (six times the error or more on smooth solids), not a proof.
///
/// Throws Error for an intersection of solids whose bounds do not meet.
std::unique_ptr<Solid> make_union(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b);
std::unique_ptr<Solid> make_intersection(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b);
std::unique_ptr<Solid> make_difference(std::unique_ptr<Solid> a, std::unique_ptr<Solid> b);

/// Signed distances at the points of a lattice, negative inside. A band around the surface
/// suffices: beyond it only the sign matters.
struct DistanceGrid {
  std::array<std::uint32_t, 3> size = {};            ///< points along x, y, z, each ≥ 2
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< [u] of the first point
  double spacing = 0;                                ///< [u] of neighbours, > 0
  std::vector<float> values;                         ///< [u] x runs fastest, then y
};

/// The mesh of a level set.
struct LevelSetMesh {
  ClosedMesh mesh;   ///< [u]
  double error = 0;  ///< [u] proven: its surface and the level set lie within this of each other
};

/// The solid where the trilinear interpolation of a grid is < 0, as a mesh: a vertex in every cell
/// whose eight points have both signs, with sharp edges and corners. It is a mesh like any other:
/// bake() takes it, also on a GPU, and check() proves against it.
///
/// Distances inside are computed from the mesh, so a narrow band is enough. Values need not be
/// distances: only their zero counts. The error is proven from the steepest slope near the surface,
/// and is larger where slopes differ much there. Runs on the current threads of TBB; the bytes do
/// not depend on their number.
///
/// Throws Error, naming `name`, for mismatched sizes, values that are not finite, a grid without
/// inside points, a solid that reaches the grid's border, and if progress cancels (stage
/// "polygonise").
LevelSetMesh mesh_level_set(const DistanceGrid& grid, const std::string& name,
                            const ProgressCallback& progress = {});

/// The same as a Solid, by its mesh.
std::unique_ptr<Solid> make_grid_solid(const DistanceGrid& grid);

/// True if this library was built with OpenVDB.
bool vdb_available() noexcept;

/// The level set of an OpenVDB file: its one grid, of floats and marked as a level set, with any
/// linear transform. [u] is the file's world unit.
///
/// load_mesh() reads a .vdb likewise, so every function that takes a mesh file takes such a
/// file. OpenVDB reads the file: do not use it for untrusted files.
///
/// Throws Error (file, what is wrong, remedy) for a file of several grids or none, a grid of
/// another kind, a fog volume, as mesh_level_set() does, and without OpenVDB.
LevelSetMesh load_vdb(const std::string& path, const ProgressCallback& progress = {});

/// The same as a Solid, by its mesh.
std::unique_ptr<Solid> load_vdb_solid(const std::string& path);

}  // namespace ist
