#pragma once

#include "query/shape/probe_sum.h"
#include "query/shape/shapes.h"

// Shapes with a surface of triangles, whose overlap with balls is exact.

namespace ist {

/// A box: twelve triangles for blocks of balls that come near more than one face.
class BoxSampler : public SamplerOf<PlainBox> {
 public:
  using SamplerOf::SamplerOf;

  /// The parts of a block of balls inside; adds to `pairs`.
  ProbeTotal block(const ProbeBalls& balls, std::uint32_t used, const double (&origin)[3],
                   std::uint32_t& pairs) noexcept;

 private:
  SurfacePatch patch_;
  bool has_patch_ = false;
};

/// A height field, by the triangles near a block of balls.
class HeightSampler : public SamplerOf<PlainTerrain> {
 public:
  using SamplerOf::SamplerOf;

  /// The distance from the nearest of the grid's triangles and the point straight below.
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
