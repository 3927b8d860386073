#include "bake/field/spatial_order.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include <ist/asset_layout.h>

namespace ist {
namespace {

using FloatPoint = std::array<float, 3>;

std::size_t longest_axis(std::span<const FloatPoint> points, std::span<const std::uint32_t> order) {
  FloatPoint low = points[order.front()], high = low;
  for (const std::uint32_t i : order)
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], points[i][k]);
      high[k] = std::max(high[k], points[i][k]);
    }
  std::size_t longest = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (high[k] - low[k] > high[longest] - low[longest]) longest = k;
  return longest;
}

/// Of n > 16: about half, in whole groups of the largest size that leaves a choice.
std::size_t first_half(std::size_t n) {
  std::size_t group = kWidth;
  while (group * kWidth < n) group *= kWidth;
  return std::max<std::size_t>(1, (n + group) / (2 * group)) * group;
}

void halve(std::span<const FloatPoint> points, std::span<std::uint32_t> order) {
  if (order.size() <= kWidth) return;
  const std::size_t axis = longest_axis(points, order);
  const std::size_t half = first_half(order.size());
  std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(half), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(points[a][axis], a) < std::pair(points[b][axis], b);
                   });
  const std::span<std::uint32_t> first = order.first(half), second = order.subspan(half);
  if (order.size() < 4096) {
    halve(points, first);
    halve(points, second);
  } else {
    tbb::parallel_invoke([&] { halve(points, first); }, [&] { halve(points, second); });
  }
}

/// Sorts each last group by index: what nth_element leaves is no library's promise.
void settle(std::span<std::uint32_t> order) {
  for (std::size_t begin = 0; begin < order.size(); begin += kWidth)
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(begin),
              order.begin() +
                  static_cast<std::ptrdiff_t>(std::min<std::size_t>(begin + kWidth, order.size())));
}

}  // namespace

std::vector<std::uint32_t> spatial_order(std::span<const FloatPoint> points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  halve(points, order);
  settle(order);
  return order;
}

}  // namespace ist
