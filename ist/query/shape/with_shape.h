#pragma once

#include <ist/shapes.h>

#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"

namespace ist {

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
