#pragma once

#include <ist/shapes.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/bits.h"
#include "query/asset/shared_constants.h"
#include "query/ball_triangle/patch_sums.h"
#include "query/kernel/overlap.h"
#include "query/shape/shapes.h"

// Shapes with a surface of triangles, whose overlap with balls is exact.

namespace ist {

/// Sums over the parts of balls inside a shape, relative to the probing tree's unit-frame origin.
struct ProbeTotal {
  Overlap overlap;     ///< without the error, which the descent adds
  double area = 0;     ///< of the shape's surface inside the balls
  double crossed = 0;  ///< volume of the balls that the surface crosses

  void add(const ProbeTotal& other) noexcept {
    overlap.add(other.overlap);
    area += other.area;
    crossed += other.crossed;
  }
};

/// Adds a ball's part. `x`: the centre; `gradient` is by its motion, `moment` about it.
inline void add_part(const Eigen::Vector3d& x, double volume, const Eigen::Vector3d& gradient,
                     const Eigen::Vector3d& moment, Overlap& sum) noexcept {
  sum.volume += volume;
  sum.force += gradient;
  sum.torque += x.cross(gradient);
  sum.moment += volume * x + moment;
}

/// A bit for each ball with its centre inside. The surface inside a ball decides where its solid
/// angle is not 0, as the share of the sphere inside the solid, [centre inside] + angle / 4π, is in
/// [0, 1]; elsewhere `inside` does.
inline std::uint32_t sides_by_angles(const ProbeSums& sums, std::uint32_t inside) noexcept {
  for (const std::uint32_t i : set_bits(sums.met)) {
    if (!(std::abs(sums.angle[i]) > kLeastAngle)) continue;
    inside = sums.angle[i] < 0 ? inside | 1u << i : inside & ~(1u << i);
  }
  return inside;
}

/// The sums of a block of balls once every triangle that reaches them is added. `inside`: a bit for
/// each centre inside. `origin`: of the probing tree.
inline ProbeTotal total_of(const ProbeBalls& balls, const ProbeSums& sums, std::uint32_t inside,
                           const double (&origin)[3]) noexcept {
  ProbeTotal total;
  for (const std::uint32_t i : set_bits(inside | sums.met)) {
    const double r = balls.r[i];
    const double whole = ball_volume(r);
    const double contained = (inside >> i & 1) != 0 ? whole : 0;
    const Eigen::Vector3d x = balls.centre(i) - vector(origin);
    if ((sums.met >> i & 1) == 0) {
      total.overlap.volume += contained;
      total.overlap.moment += contained * x;
      continue;
    }
    const double volume = std::clamp(contained + sums.cones[i], 0.0, whole);
    add_part(x, volume, -Eigen::Vector3d(sums.pull[0][i], sums.pull[1][i], sums.pull[2][i]),
             -Eigen::Vector3d(sums.shift[0][i], sums.shift[1][i], sums.shift[2][i]), total.overlap);
    total.area += sums.area[i];
    total.crossed += whole;
  }
  return total;
}

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

/// Returns use(sampler) for the shape, or refuse() if its numbers are out of range.
template <class Use, class Refuse>
auto with_shape(const Shape& shape, const Use& use, const Refuse& refuse) noexcept {
  const auto run = [&](auto sampler) {
    if (!sampler.sound) return refuse();
    auto result = use(sampler);
    return sampler.sound ? result : refuse();
  };
  switch (shape.index()) {
    case 0:
      return run(HalfSpaceSampler(*std::get_if<0>(&shape)));
    case 1:
      return run(BoxSampler(*std::get_if<1>(&shape)));
    case 2:
      return run(BallSampler(*std::get_if<2>(&shape)));
    case 3:
      return run(CapsuleSampler(*std::get_if<3>(&shape)));
    case 4:
      return run(CylinderSampler(*std::get_if<4>(&shape)));
    case 5:
      return run(HeightSampler(*std::get_if<5>(&shape)));
    case 6:
      return run(GridSampler(*std::get_if<6>(&shape)));
    case 7:
      return run(FunctionSampler(*std::get_if<7>(&shape)));
    default:
      return refuse();
  }
}

}  // namespace ist
