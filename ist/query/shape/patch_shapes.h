#pragma once

#include "query/shape/probe_sum.h"
#include "query/shape/shapes.h"

// Shapes with a surface of triangles, which balls meet exactly.

namespace ist {

/// A box, as twelve triangles where a ball comes near more than one of its faces.
class BoxSampler : public SamplerOf<PlainBox> {
 public:
  using SamplerOf::SamplerOf;

  /// Adds what of a block of balls is inside.
  ProbeTotal block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                   std::uint32_t& pairs) noexcept;

 private:
  SurfacePatch patch_;
  bool has_patch_ = false;
};

/// Terrain: the triangles under a block of balls.
class HeightSampler : public SamplerOf<PlainTerrain> {
 public:
  using SamplerOf::SamplerOf;

  /// The distance from the triangles of the grid, and from the point straight below.
  ShapeSample nearest(const Eigen::Vector3d& x) noexcept;
  ProbeTotal block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                   std::uint32_t& pairs) noexcept;

 private:
  double height(std::int64_t i, std::int64_t j) noexcept;
  double surface(double x, double y) noexcept;

  /// Adds the triangles that come near a block of balls.
  void add_cells(const ProbeBalls& balls, std::uint32_t used, ProbeSums& sums) noexcept;
};

}  // namespace ist
