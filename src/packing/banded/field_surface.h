#pragma once

#include "packing/banded/sample.h"
#include "packing/base/unit_field.h"

namespace ist::packing {

/// The surface of any Solid with a signed distance. Features are balls: a value s at q bounds the
/// field by s − |x − q| everywhere (it is 1-Lipschitz), which is the ball {q, s}; at the foot of
/// the gradient it is a surface point.
class FieldSurface {
 public:
  /// A search finds only one feature, so an ascent must take more steps to find them all.
  static constexpr int kAscentSteps = 8;

  struct Feature {
    Float3 centre;
    float radius = 0;
  };

  FieldSurface(const Solid& solid, const UnitFrame& frame) : field_{solid, frame} {}

  /// Unsigned distance to the surface, and the feature there, if it is less than `limit`.
  template <class Team>
  NearestFeature<Feature> nearest(const Team&, Float3 x, float limit) const {
    const double s = value(x);
    if (!(std::fabs(s) < limit)) return {{}, limit, false};
    const Eigen::Vector3d q = field_.foot(exact(x), s);
    Feature feature;
    feature.centre = {static_cast<float>(q.x()), static_cast<float>(q.y()),
                      static_cast<float>(q.z())};
    feature.radius = static_cast<float>(value(feature.centre));
    return {feature, static_cast<float>(std::fabs(s)), true};
  }

  FeatureOffset offset(const Feature& feature, Float3 x) const {
    return ball_offset(feature.centre, feature.radius, kSurfaceTag, x);
  }

  /// A field has no known faces.
  template <class Team>
  int convex_planes(const Team&, Float3, float, bool, Feature*, int, SampleMemory*, int) const {
    return 0;
  }

  template <class Team>
  bool inside(const Team&, Float3 x) const {
    return value(x) < 0;
  }
  template <class Team>
  double clearance(const Team&, Float3 x, double) const {
    return -value(x);
  }

 private:
  static Eigen::Vector3d exact(Float3 x) { return {x.x, x.y, x.z}; }
  double value(Float3 x) const { return field_.value(exact(x)); }

  UnitField field_;
};

}  // namespace ist::packing
