#include <ist/time_of_impact.h>

#include "query/base/no_answer.h"
#include "query/exact/mesh_queries.h"
#include "query/impact/shape_search.h"
#include "query/shape/with_shape.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

TimeOfImpact overlap() noexcept {
  TimeOfImpact result;
  result.kind = ImpactKind::overlapping;
  return result;
}

/// In the frame's unit of length. `smaller`: the smaller solid's bounding radius; `errors`: of the
/// meshes, by which an impact's gap is uncertain.
double tolerance_of(const ImpactSettings& settings, double smaller, double errors,
                    double unit) noexcept {
  return settings.tolerance > 0 ? settings.tolerance / unit : std::max(1e-3 * smaller, 10 * errors);
}

double bounding_radius(const PlacedAsset& placed) noexcept {
  return placed.asset.header().inner_tree.root[3];
}

/// True if one solid contains a part of the other without an intersection of their surfaces.
bool one_contains_other(const ImpactSide& a, const ImpactSide& b,
                        const RelativePose& pose) noexcept {
  return (a.mesh() != nullptr && contains_part(*a.mesh(), b, pose.a_from_b)) ||
         (b.mesh() != nullptr && contains_part(*b.mesh(), a, pose.b_from_a));
}

}  // namespace

TimeOfImpact find_impact(const PlacedAsset& a, const PlacedAsset& b, const Motions& motions,
                         const ImpactSettings& settings, Workspace& workspace) noexcept {
  if (lack_spheres(a, b)) return missing_data<TimeOfImpact>();
  const std::optional<MovingFrame> frame = moving_frame(a, b, motions, settings.duration);
  if (!frame || workspace.impl() == nullptr) return invalid_input<TimeOfImpact>();
  const ImpactSide side_a(a.asset), side_b(b.asset);
  if (one_contains_other(side_a, side_b, frame->start)) return overlap();
  const double smaller =
      std::min(bounding_radius(a) * frame->a.unit, bounding_radius(b) * frame->b.unit);
  const double errors = side_a.mesh_error() * frame->a.unit + side_b.mesh_error() * frame->b.unit;
  ImpactLoop loop(*frame, tolerance_of(settings, smaller, errors, frame->unit), settings,
                  *workspace.impl());
  return search_pair(*frame, side_a, side_b, loop);
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
          // The whole shape is inside B if its centre is and the surfaces do not intersect.
          const Vec3 middle = vec3(frame->start.b_from_a.t);
          if (side.mesh() != nullptr && is_inside({*side.mesh()}, {middle.x, middle.y, middle.z}))
            return overlap();
        }
        ImpactLoop loop(*frame, tolerance, settings, *workspace.impl());
        return ShapeSearch<Sampler>(shape, *frame, side, loop).run();
      },
      invalid_input<TimeOfImpact>);
}

}  // namespace ist
