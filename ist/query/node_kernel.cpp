#include "query/node_kernel.h"

#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "query/node_kernel.cpp"
#include <hwy/foreach_target.h>

#include "query/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {

/// Appends the pairs of the chosen lanes and y to two lists, whose room ends a vector later.
template <class T, class M>
HWY_INLINE std::size_t append(LaneTag<T> d, M chosen, std::uint32_t first, std::uint32_t y,
                              std::uint32_t* out_x, std::uint32_t* out_y) {
  const hn::CappedTag<std::uint32_t, kWidth> du;
  for (std::size_t i = 0; i < hn::Lanes(d); i += hn::Lanes(du))
    hn::StoreU(hn::Set(du, y), du, out_y + i);
  return append_lanes<T>(d, chosen, first, out_x);
}

/// With kHeld, children inside of y[i] go to `held`.
template <class T, bool kHeld>
HWY_INLINE std::size_t open_as(const NodeStage& stage, const std::uint32_t* x,
                               const std::uint32_t* y, std::size_t n, std::uint32_t* out_x,
                               std::uint32_t* out_y, HeldNodes* held) {
  const LaneTag<T> d;
  const std::size_t lanes = hn::Lanes(d);
  const SphereTree::Level& opened = stage.x->level[stage.level_x];
  const Similarity& x_from_y = *stage.x_from_y;
  const auto grow = hn::Set(d, static_cast<T>(1 + distance_error<T>(1)));

  std::uint32_t last_y = ~0u;
  double centre[3] = {};
  double radius = 0;
  std::size_t found = 0;
  const std::uint32_t below = stage.x->count(stage.level_x - 1);
  for (std::size_t i = 0; i < n; ++i) {
    if (y[i] != last_y) {
      last_y = y[i];
      const NodeBall ball = stage.y->ball(stage.level_y, last_y);
      x_from_y.apply(ball.centre, centre);
      radius = ball.r * x_from_y.scale;
    }
    const BallBlock& block = opened.blocks[x[i]];
    const Origin& origin = opened.origins[x[i]];
    const double q[3] = {centre[0] - origin.x, centre[1] - origin.y, centre[2] - origin.z};
    const double magnitude = std::abs(q[0]) + std::abs(q[1]) + std::abs(q[2]) + radius;
    const auto qx = hn::Set(d, static_cast<T>(q[0]));
    const auto qy = hn::Set(d, static_cast<T>(q[1]));
    const auto qz = hn::Set(d, static_cast<T>(q[2]));
    const auto reach = hn::Set(d, static_cast<T>(radius + distance_error<T>(2 * magnitude)));
    [[maybe_unused]] const auto within =
        hn::Set(d, static_cast<T>(radius - distance_error<T>(2 * magnitude)));
    const std::uint32_t first_child = kWidth * x[i];
    for (std::size_t lane = 0; lane < kWidth; lane += lanes) {
      const auto dx = load_as<T>(d, block.x + lane) - qx;
      const auto dy = load_as<T>(d, block.y + lane) - qy;
      const auto dz = load_as<T>(d, block.z + lane) - qz;
      const auto d2 = (dx * dx + dy * dy) + dz * dz;
      // Negative for an unused lane, whose square must not count.
      const auto r = load_as<T>(d, block.r + lane);
      const auto sum = hn::Max(r * grow + reach, hn::Zero(d));
      auto near = d2 < sum * sum;
      const std::uint32_t child = first_child + static_cast<std::uint32_t>(lane);
      if constexpr (kHeld) {
        // Zero but near: an unused lane's square is no float.
        const auto spare = hn::IfThenElseZero(near, hn::Max(within - r * grow, hn::Zero(d)));
        const auto inside = d2 < spare * spare;
        held->size +=
            append<T>(d, inside, child, last_y, held->x + held->size, held->y + held->size);
        near = hn::AndNot(inside, near);
      }
      found += append<T>(d, near, child, last_y, out_x + found, out_y + found);
    }
    // Unused lanes, which a large enough ball would reach all the same.
    while (found > 0 && out_x[found - 1] >= below) --found;
    if constexpr (kHeld)
      while (held->size > 0 && held->x[held->size - 1] >= below) --held->size;
  }
  return found;
}

std::size_t open_single(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                        std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y) {
  return open_as<float, false>(stage, x, y, n, out_x, out_y, nullptr);
}

std::size_t open_twice(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                       std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y) {
  return open_as<double, false>(stage, x, y, n, out_x, out_y, nullptr);
}

std::size_t hold_single(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                        std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y,
                        HeldNodes& held) {
  return open_as<float, true>(stage, x, y, n, out_x, out_y, &held);
}

std::size_t hold_twice(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                       std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y, HeldNodes& held) {
  return open_as<double, true>(stage, x, y, n, out_x, out_y, &held);
}

}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(open_single);
HWY_EXPORT(open_twice);
HWY_EXPORT(hold_single);
HWY_EXPORT(hold_twice);

std::size_t open_nodes(const NodeStage& stage, const std::uint32_t* x, const std::uint32_t* y,
                       std::size_t n, std::uint32_t* out_x, std::uint32_t* out_y) noexcept {
  return stage.precision == Precision::single
             ? HWY_DYNAMIC_DISPATCH(open_single)(stage, x, y, n, out_x, out_y)
             : HWY_DYNAMIC_DISPATCH(open_twice)(stage, x, y, n, out_x, out_y);
}

std::size_t open_under_spheres(const NodeStage& stage, const std::uint32_t* x,
                               const std::uint32_t* y, std::size_t n, std::uint32_t* out_x,
                               std::uint32_t* out_y, HeldNodes& held) noexcept {
  return stage.precision == Precision::single
             ? HWY_DYNAMIC_DISPATCH(hold_single)(stage, x, y, n, out_x, out_y, held)
             : HWY_DYNAMIC_DISPATCH(hold_twice)(stage, x, y, n, out_x, out_y, held);
}

}  // namespace ist
#endif
