#pragma once

#include <ist/field.h>

#include "query/field/patch_shapes.h"
#include "query/field/shapes.h"

namespace ist {

/// Runs `use(shape)` with the field's shape; `refuse()` where its numbers are out of range.
template <class Use, class Refuse>
auto with_shape(const Field& field, const Use& use, const Refuse& refuse) noexcept {
  const auto run = [&](auto shape) {
    if (!shape.sound) return refuse();
    auto result = use(shape);
    return shape.sound ? result : refuse();
  };
  switch (field.index()) {
    case 0:
      return run(HalfSpaceShape(*std::get_if<0>(&field)));
    case 1:
      return run(BoxShape(*std::get_if<1>(&field)));
    case 2:
      return run(BallShape(*std::get_if<2>(&field)));
    case 3:
      return run(CapsuleShape(*std::get_if<3>(&field)));
    case 4:
      return run(CylinderShape(*std::get_if<4>(&field)));
    case 5:
      return run(HeightShape(*std::get_if<5>(&field)));
    case 6:
      return run(GridShape(*std::get_if<6>(&field)));
    case 7:
      return run(FunctionShape(*std::get_if<7>(&field)));
    default:
      return refuse();
  }
}

}  // namespace ist
