#pragma once

#include <ist/mesh.h>
#include <ist/solid.h>

namespace ist {

/// The functions of a solid that `check` uses, unit frame. Immutable.
class CheckedSolid {
 public:
  virtual ~CheckedSolid() = default;

  /// Distance to the surface, or a lower bound if it is not known; any value ≥ limit beyond
  /// `limit`.
  virtual double distance(const Eigen::Vector3d& p, double limit) const = 0;

  /// Winding number of a point off the surface: ≥ 1 inside.
  virtual int winding(const Eigen::Vector3d& p) const = 0;

  virtual const Eigen::AlignedBox3d& bounds() const = 0;  ///< contains the whole solid
};

/// A mesh's surface for `check`: simple, in double, and an independent implementation, so that a
/// mistake in the solid that packing used is not repeated. Immutable.
class CheckedMesh final : public CheckedSolid {
 public:
  using Corners = std::array<Eigen::Vector3d, 3>;

  CheckedMesh(const ClosedMesh& mesh, const UnitFrame& frame);

  /// Unit frame, to the nearest triangle; if nothing is nearer than `limit`, any value ≥ limit.
  double distance(const Eigen::Vector3d& p, double limit) const override;

  /// The triangles in internal order.
  const std::vector<Corners>& triangles() const { return triangles_; }

  /// Winding number of a point off the surface, by a ray in a direction unlikely to occur in a
  /// model; if rounding leaves a sign undecided, by the sum of all solid angles.
  int winding(const Eigen::Vector3d& p) const override;

  const Eigen::AlignedBox3d& bounds() const override { return bounds_; }

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    std::uint32_t begin = 0, end = 0;  ///< triangles
    std::uint32_t right = 0;           ///< second child; the first is the next node; 0 at a leaf
  };

  void build(std::uint32_t begin, std::uint32_t end);
  int winding_by_solid_angle(const Eigen::Vector3d& p) const;

  std::vector<Corners> triangles_;
  std::vector<Node> nodes_;
  Eigen::AlignedBox3d bounds_;
};

}  // namespace ist
