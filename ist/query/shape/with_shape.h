#pragma once

#include <ist/shapes.h>

#include "query/shape/patch_shapes.h"
#include "query/shape/shapes.h"

namespace ist {

/// Runs `use(shape)` with the shape's shape; `refuse()` where its numbers are out of range.
template <class Use, class Refuse>
auto with_shape(const Shape& field, const Use& use, const Refuse& refuse) noexcept {
  const auto run = [&](auto shape) {
    if (!shape.sound) return refuse();
    auto result = use(shape);
    return shape.sound ? result : refuse();
  };
  switch (field.index()) {
    case 0:
      return run(HalfSpaceSampler(*std::get_if<0>(&field)));
    case 1:
      return run(BoxSampler(*std::get_if<1>(&field)));
    case 2:
      return run(BallSampler(*std::get_if<2>(&field)));
    case 3:
      return run(CapsuleSampler(*std::get_if<3>(&field)));
    case 4:
      return run(CylinderSampler(*std::get_if<4>(&field)));
    case 5:
      return run(HeightSampler(*std::get_if<5>(&field)));
    case 6:
      return run(GridSampler(*std::get_if<6>(&field)));
    case 7:
      return run(FunctionSampler(*std::get_if<7>(&field)));
    default:
      return refuse();
  }
}

}  // namespace ist
