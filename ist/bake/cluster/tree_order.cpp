#include "bake/cluster/tree_order.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include <ist/asset_layout.h>
#include "bake/cluster/neural_gas.h"
#include "bake/cluster/tree_swaps.h"

namespace ist {
namespace {

std::vector<std::uint32_t> group_order(std::span<const Ball> balls, bool last_stays, bool swaps) {
  std::vector<std::uint32_t> order = neural_gas_order(balls, last_stays);
  if (swaps) improve_groups(balls, last_stays, order);
  return order;
}

/// Balls around each 16 consecutive entries of `order`.
std::vector<Ball> group_balls(std::span<const Ball> balls, std::span<const std::uint32_t> order) {
  std::vector<Ball> groups((order.size() + kWidth - 1) / kWidth);
  tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
    std::vector<Ball> members;
    for (std::size_t i = g * kWidth; i < std::min((g + 1) * kWidth, order.size()); ++i)
      members.push_back(balls[order[i]]);
    groups[g] = bounding_ball(members);
  });
  return groups;
}

std::vector<std::uint32_t> order_of(std::span<const Ball> balls, bool last_stays, bool swaps);

/// The order of balls whose groups of 16 follow one another in `order`: groups of their balls, and
/// so on up.
std::vector<std::uint32_t> order_groups(std::span<const Ball> balls,
                                        std::vector<std::uint32_t> order, bool last_stays,
                                        bool swaps) {
  if (order.size() <= std::size_t{kWidth} * kWidth) return order;
  // A group that is not full comes last, and so does any that holds one that is not.
  const std::vector<std::uint32_t> groups =
      order_of(group_balls(balls, order), last_stays || order.size() % kWidth != 0, swaps);
  std::vector<std::uint32_t> sorted;
  sorted.reserve(order.size());
  for (const std::uint32_t g : groups)
    for (std::size_t i = std::size_t{g} * kWidth;
         i < std::min<std::size_t>((std::size_t{g} + 1) * kWidth, order.size()); ++i)
      sorted.push_back(order[i]);
  return sorted;
}

std::vector<std::uint32_t> order_of(std::span<const Ball> balls, bool last_stays, bool swaps) {
  return order_groups(balls, group_order(balls, last_stays, swaps), last_stays, swaps);
}

}  // namespace

std::vector<std::uint32_t> tree_order(std::span<const Ball> spheres, bool swaps) {
  return order_of(spheres, false, swaps);
}

std::vector<std::uint32_t> refined_order(std::span<const Ball> spheres,
                                         std::vector<std::uint32_t> order) {
  improve_groups(spheres, false, order);
  return order_groups(spheres, std::move(order), false, true);
}

}  // namespace ist
