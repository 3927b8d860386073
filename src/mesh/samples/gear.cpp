#include <algorithm>

#include "mesh/samples/mesh_builder.h"
#include "mesh/samples/shapes.h"

namespace ist::shapes {

/// A toothed disc: both faces are flat rings between the bore and the teeth, so every vertex of the
/// outline has a partner on the bore at the same angle.
TriangleMesh gear() {
  constexpr std::size_t kTeeth = 16, kSteps = 12;  // vertices a tooth
  constexpr double kRoot = 4.0, kTip = 5.0, kBore = 1.5, kHalfWidth = 0.8;
  // A trapezium: root, flank up, tip, flank down, by fractions of the tooth's angle.
  const auto outline = [](std::size_t i) {
    const double u = static_cast<double>(i % kSteps) / kSteps;
    const double height =
        std::min({1.0, std::max(0.0, (u - 0.25) * 6), std::max(0.0, (1 - u) * 6)});
    return kRoot + (kTip - kRoot) * height;
  };
  const auto bore = [](std::size_t) { return kBore; };
  constexpr std::size_t kCount = kTeeth * kSteps;

  MeshBuilder builder;
  const Ring inner_low = builder.ring(kCount, -kHalfWidth, bore);
  const Ring outer_low = builder.ring(kCount, -kHalfWidth, outline);
  const Ring outer_high = builder.ring(kCount, kHalfWidth, outline);
  const Ring inner_high = builder.ring(kCount, kHalfWidth, bore);
  builder.wall(inner_low, outer_low);
  builder.wall(outer_low, outer_high);
  builder.wall(outer_high, inner_high);
  builder.wall(inner_high, inner_low);
  return builder.take();
}

}  // namespace ist::shapes
