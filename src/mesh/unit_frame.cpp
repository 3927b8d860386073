#include <ist/solid.h>
#include <ist/types.h>
#include <cmath>

namespace ist {

double UnitFrame::scale() const { return std::ldexp(1.0, exponent); }

UnitFrame unit_frame(const Eigen::AlignedBox3d& bounds) {
  if (bounds.isEmpty() || !bounds.min().allFinite() || !bounds.max().allFinite())
    throw Error("the bounding box is empty or not finite, so there is no solid");
  // Halves first: the sum of two large coordinates may overflow.
  const Eigen::Vector3d half = bounds.max() / 2 - bounds.min() / 2;
  const double half_extent = half.maxCoeff();
  if (!(half_extent > 0)) throw Error("the bounding box has size 0, so there is no solid");
  UnitFrame frame;
  frame.centre = bounds.min() / 2 + bounds.max() / 2;
  const double mantissa = std::frexp(half_extent, &frame.exponent);
  if (mantissa == 0.5) --frame.exponent;  // half-extent exactly 1, not ½
  return frame;
}

}  // namespace ist
