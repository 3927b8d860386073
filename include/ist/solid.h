#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <ist/api.h>
#include <ist/mesh.h>

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

}  // namespace ist
