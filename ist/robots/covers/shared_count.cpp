#include "robots/covers/cover_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include <ist/cover_spheres.h>

namespace ist {

double estimated_protrusion(const TriedCounts& tried, std::size_t count) {
  const auto above = tried.upper_bound(count);
  double least = std::numeric_limits<double>::infinity();
  for (auto one = tried.begin(); one != above; ++one) least = std::min(least, one->second);
  const auto n = static_cast<double>(count);
  // If balls of level E contain a curved surface, their number is proportional to 1 / E.
  if (above == tried.begin()) return above->second * static_cast<double>(above->first) / n;
  const auto below = std::prev(above);
  if (below->first == count) return least;
  const auto from = static_cast<double>(below->first);
  double power = 1;
  if (above != tried.end() && least > 0 && above->second > 0)
    power = std::max(
        0.0, std::log(least / above->second) / std::log(static_cast<double>(above->first) / from));
  return least * std::pow(from / n, power);
}

std::vector<std::size_t> share_out(std::span<const TriedCounts> tried,
                                   std::span<const std::size_t> copies, std::size_t total) {
  std::vector<std::size_t> counts(tried.size(), 1);
  std::size_t left = total - std::accumulate(copies.begin(), copies.end(), std::size_t{0});
  std::priority_queue<std::pair<double, std::size_t>> needy;  // the lower index yields at a tie
  for (std::size_t i = 0; i < tried.size(); ++i)
    needy.emplace(estimated_protrusion(tried[i], 1), i);
  while (!needy.empty()) {
    const std::size_t i = needy.top().second;
    needy.pop();
    if (copies[i] > left || counts[i] == kMostCoverSpheres) continue;
    left -= copies[i];
    needy.emplace(estimated_protrusion(tried[i], ++counts[i]), i);
  }
  return counts;
}

}  // namespace ist
