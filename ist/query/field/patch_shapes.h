#pragma once

#include "query/field/probe_sum.h"
#include "query/field/shapes.h"

// Fields with a surface of triangles, which balls meet exactly.

namespace ist {

/// A box, as twelve triangles where a ball comes near more than one of its faces.
class BoxShape {
 public:
  explicit BoxShape(const BoxField& f) noexcept;
  FieldSample look(const Eigen::Vector3d& x) const noexcept;
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept { return look(x); }
  double error() const noexcept { return 0; }

  /// Adds what of a block of balls is inside.
  ProbeTotal block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                   std::uint32_t& pairs) noexcept;

  Eigen::Vector3d half;
  bool sound;

 private:
  SurfacePatch patch_;
  bool has_patch_ = false;
};

/// Terrain: the triangles under a block of balls.
class HeightShape {
 public:
  explicit HeightShape(const HeightField& f) noexcept;
  /// 0 where only a closer look tells.
  FieldSample look(const Eigen::Vector3d& x) const noexcept;
  /// The distance from the triangles of the grid, and from the point straight below.
  FieldSample nearest(const Eigen::Vector3d& x) const noexcept;
  double error() const noexcept { return 0; }
  ProbeTotal block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                   std::uint32_t& pairs) noexcept;

  mutable bool sound;  ///< no longer once a height that is no number is looked at

 private:
  double height(std::int64_t i, std::int64_t j) const noexcept;

  /// Height of the surface over a point.
  double surface(double x, double y) const noexcept;

  /// Adds the triangles that come near a block of balls.
  void add_cells(const ProbeBalls& balls, std::uint32_t used, ProbeSums& sums) const noexcept;

  const HeightField& field_;
};

}  // namespace ist
