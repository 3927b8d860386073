#include <gtest/gtest.h>

#include <ist/solid.h>
#include <ist/types.h>

namespace {

using ist::unit_frame;

TEST(UnitFrame, HalfExtentLiesAboveOneHalfUpToOne) {
  for (double half : {1e-9, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 1e9}) {
    const Eigen::Vector3d corner(half, half / 3, 0);
    const ist::UnitFrame frame = unit_frame({-corner, corner});
    const double unit = half / frame.scale();
    EXPECT_GT(unit, 0.5) << half;
    EXPECT_LE(unit, 1.0) << half;
  }
}

TEST(UnitFrame, RefusesABoxWithoutSize) {
  const Eigen::Vector3d p(1, 2, 3);
  EXPECT_THROW(unit_frame({p, p}), ist::Error);
  EXPECT_THROW(unit_frame(Eigen::AlignedBox3d()), ist::Error);
}

}  // namespace
