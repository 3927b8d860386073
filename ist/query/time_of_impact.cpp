#include <ist/time_of_impact.h>

#include "query/base/no_answer.h"
#include "query/exact/mesh_queries.h"
#include "query/impact/pair_search.h"
#include "query/impact/shape_search.h"
#include "query/shape/with_shape.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

// Where no tolerance is asked for: of the smaller solid's bounding radius, and of the meshes'
// errors, which may be what is left of an impact's gap at either end.
constexpr double kTolerance = 1e-3;
constexpr double kErrors = 10;

TimeOfImpact overlap() noexcept {
  TimeOfImpact result;
  result.kind = ImpactKind::overlapping;
  return result;
}

/// In lengths of the frame.
double tolerance_of(const ImpactSettings& settings, double smaller, double errors,
                    double unit) noexcept {
  return settings.tolerance > 0 ? settings.tolerance / unit
                                : std::max(kTolerance * smaller, kErrors * errors);
}

double bounding_radius(const PlacedAsset& placed) noexcept {
  return placed.asset.header().inner_tree.root[3];
}

/// Whether one solid contains a part of the other without their meshes meeting there.
bool hold(const ImpactSide& a, const ImpactSide& b, const RelativePose& pose) noexcept {
  return (a.mesh() != nullptr && holds_part(*a.mesh(), b, pose.a_from_b)) ||
         (b.mesh() != nullptr && holds_part(*b.mesh(), a, pose.b_from_a));
}

}  // namespace

TimeOfImpact find_impact(const PlacedAsset& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return missing_data<TimeOfImpact>();
  const std::optional<MovingFrame> frame = moving_frame(a, b, motions, settings.duration);
  if (!frame || workspace.impl() == nullptr) return invalid_input<TimeOfImpact>();
  const ImpactSide side_a(a.asset), side_b(b.asset);
  if (hold(side_a, side_b, frame->start)) return overlap();
  const double smaller =
      std::min(bounding_radius(a) * frame->a.unit, bounding_radius(b) * frame->b.unit);
  const double errors = side_a.mesh_error() * frame->a.unit + side_b.mesh_error() * frame->b.unit;
  ImpactLoop loop(*frame, tolerance_of(settings, smaller, errors, frame->unit), settings,
                  *workspace.impl());
  return PairSearch(*frame, side_a, side_b, loop).run();
}

TimeOfImpact find_impact(const PlacedShape& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return missing_data<TimeOfImpact>();
  const std::optional<MovingFrame> frame = moving_frame(a, b, motions, settings.duration);
  if (!frame || workspace.impl() == nullptr) return invalid_input<TimeOfImpact>();
  const ImpactSide side(b.asset);
  const double tolerance = tolerance_of(settings, bounding_radius(b) * frame->b.unit,
                                        side.mesh_error() * frame->b.unit, frame->unit);
  return with_shape(
      a.shape,
      [&]<class Sampler>(Sampler& shape) {
        if constexpr (kConvex<Sampler> && !std::is_same_v<Sampler, HalfSpaceSampler>) {
          // All of it is inside B, if its middle is and the surfaces do not meet.
          double middle[3];
          frame->start.b_from_a.apply({0, 0, 0}, middle);
          if (side.mesh() != nullptr &&
              is_inside({*side.mesh()}, {middle[0], middle[1], middle[2]}))
            return overlap();
        }
        ImpactLoop loop(*frame, tolerance, settings, *workspace.impl());
        return ShapeSearch<Sampler>(shape, *frame, side, loop).run();
      },
      invalid_input<TimeOfImpact>);
}

}  // namespace ist
