#pragma once

#include <cstdint>

#include "numerics/host_device.h"
#include "packing/backend/tasks.h"

namespace ist {

IST_HD inline double power(const PowerSite& site, double x, double y, double z) {
  const double dx = x - site.x, dy = y - site.y, dz = z - site.z;
  return dx * dx + dy * dy + dz * dz - site.weight;
}

/// Cuts the segment [x0, x1] of the line (·, y, z) at the power cells of the listed sites and calls
/// add(site, from, to) for each piece, from left to right. Exact: along a line all powers share the
/// term x², so their lower envelope is one of straight lines, and its sites follow each other by
/// rising x. The order of the list does not matter: among sites with equal power the one that wins
/// further on is taken, and of twins the one of smaller index.
template <class Add>
IST_HD void cut_by_power_cells(const PowerSite* sites, const std::uint32_t* list, std::uint32_t n,
                               double y, double z, double x0, double x1, Add&& add) {
  std::uint32_t current = list[0];
  double least = power(sites[current], x0, y, z);
  const auto ahead_of = [sites](std::uint32_t a, std::uint32_t b) {
    return sites[a].x != sites[b].x ? sites[a].x > sites[b].x : a < b;
  };
  for (std::uint32_t k = 1; k < n; ++k) {
    const double p = power(sites[list[k]], x0, y, z);
    if (p > least || (p == least && !ahead_of(list[k], current))) continue;
    least = p;
    current = list[k];
  }
  for (double x = x0;;) {
    const PowerSite& here = sites[current];
    const double here_power = power(here, x, y, z);
    double end = x1;
    std::uint32_t next = current;
    for (std::uint32_t k = 0; k < n; ++k) {
      const PowerSite& other = sites[list[k]];
      const double ahead = other.x - here.x;
      if (!(ahead > 0)) continue;
      // Where the powers are equal; measured from x, so that digits are kept.
      const double t = x + (power(other, x, y, z) - here_power) / (2 * ahead);
      if (t > end || (t == end && (next == current || !ahead_of(list[k], next)))) continue;
      end = t;
      next = list[k];
    }
    if (end > x) add(current, x, end);
    if (next == current) return;
    if (end > x) x = end;
    current = next;
  }
}

}  // namespace ist
