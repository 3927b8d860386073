#pragma once

#include <ist/solid.h>
#include <oneapi/tbb/collaborative_call_once.h>
#include <limits>
#include <optional>

#include "base/raw_array.h"
#include "mesh/hierarchy/bvh.h"
#include "mesh/mesh_moments.h"
#include "mesh/resolve/resolve.h"

namespace ist {

struct ClosestPoint {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< unit frame
  double distance = 0;                              ///< unit frame, ≥ 0
  std::uint32_t triangle = 0;                       ///< smallest index among equals
};

inline std::array<Eigen::Vector3d, 3> triangle_corners(const MeshView& mesh,
                                                       std::uint32_t triangle) {
  std::array<Eigen::Vector3d, 3> corners;
  for (std::size_t k = 0; k < 3; ++k)
    corners[k] = Eigen::Map<const Eigen::Vector3d>(
        mesh.vertices + 3 * std::size_t{mesh.triangles[3 * std::size_t{triangle} + k]});
  return corners;
}

/// The solid of a closed mesh. All internal data is in the unit frame, in double; view() adds float
/// copies for packing. Immutable; every function may be called from many threads at once. The
/// hierarchy and the moments are computed at the first use, on the caller's TBB threads: a bake on
/// the GPU never needs the hierarchy.
class [[gnu::visibility("hidden")]] MeshSolid final : public Solid {
 public:
  explicit MeshSolid(const ClosedMesh& mesh);
  /// For a mesh that is known to bound its solid, unless it is unresolved.
  explicit MeshSolid(const ResolvedMesh& resolved);

  double signed_distance(const Eigen::Vector3d& x) const override;
  Eigen::AlignedBox3d bounds() const override { return bounds_; }
  double volume() const override;
  double volume_error() const override;
  const MeshSolid* mesh() const noexcept override { return this; }

  const UnitFrame& frame() const { return frame_; }
  double rounding() const { return rounding_; }  ///< unit frame: bound on a vertex's motion
  double unit_volume() const { return unit_moments().volume; }  ///< unit frame³
  const MeshMoments& unit_moments() const;
  /// Unit frame: bound on the distance of any vertex from its place without any rounding.
  double moved() const { return moved_; }
  /// Triangles of the mesh intersect, or may (unknown), by more than rounding.
  bool meets_itself() const { return meets_itself_; }
  /// ClosedMesh::meeting_pairs if the unit frame rounded no coordinate, else null.
  const std::vector<std::array<std::uint32_t, 2>>* meeting_pairs() const {
    return meeting_pairs_ ? &*meeting_pairs_ : nullptr;
  }
  /// The mesh winds around some point twice, or may: it has several shells.
  bool may_overlap() const { return may_overlap_; }
  std::uint64_t hash() const;    ///< XXH3-64 of vertices and triangles
  const MeshView& view() const;  ///< plain arrays for host code, the hierarchy included
  /// The vertices and triangles of view() alone, without the hierarchy: nodes and blocks are null.
  const MeshView& arrays() const { return arrays_; }

  /// Exact to double rounding, over every triangle (inner walls included). Returns distance ≥ limit
  /// as soon as nothing is closer than `limit`.
  ClosestPoint closest_point(const Eigen::Vector3d& unit,
                             double limit = std::numeric_limits<double>::infinity()) const;

  /// Winding number of a point off the surface (any integer; ≥ 1 is inside). Robust: edges and
  /// vertices on the test ray are counted consistently.
  int winding_number(const Eigen::Vector3d& unit) const;
  bool inside(const Eigen::Vector3d& unit) const { return winding_number(unit) >= 1; }

 private:
  UnitFrame frame_;
  Eigen::AlignedBox3d bounds_;
  RawArray<double> vertices_;  // unit frame
  RawArray<std::uint32_t> triangles_;
  MeshView arrays_;
  double rounding_ = 0, moved_ = 0;  // unit frame
  bool meets_itself_ = false, may_overlap_ = false;
  std::optional<std::vector<std::array<std::uint32_t, 2>>> meeting_pairs_;

  // Computed at the first use.
  mutable oneapi::tbb::collaborative_once_flag hierarchy_made_, moments_made_, hash_made_;
  mutable std::uint64_t hash_ = 0;
  mutable Bvh bvh_;
  mutable MeshView view_;  // arrays and bvh
  mutable MeshMoments moments_;
};

}  // namespace ist
