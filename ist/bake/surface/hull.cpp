#include "bake/surface/hull.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "mesh/triangle_frame.h"

namespace ist {
namespace {

constexpr double kOnPlane = 1e-13;  // unit frame

/// A point of a plane.
struct Flat {
  double u, v;
  Hull::Point at;
};

double turn(const Flat& a, const Flat& b, const Flat& c) {
  return (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
}

/// Moves the corners of the points' convex hull to the front: how many. Nearly straight corners go:
/// what they add is less than rounding.
std::size_t corners_first(std::span<Flat> points, std::span<Flat> work) {
  std::sort(points.begin(), points.end(),
            [](const Flat& a, const Flat& b) { return std::tie(a.u, a.v) < std::tie(b.u, b.v); });
  if (points.size() < 3) return points.size();
  std::size_t count = 0;
  const auto add = [&](const Flat& p, std::size_t least) {
    while (count >= least && turn(work[count - 2], work[count - 1], p) <= 0) --count;
    work[count++] = p;
  };
  for (const Flat& p : points) add(p, 2);
  const std::size_t upper = count + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], upper);
  count -= 1;  // the first again
  std::copy_n(work.begin(), count, points.begin());
  return count;
}

}  // namespace

Hull::Hull(std::span<const Point> corners) : count_(corners.size()) {
  std::copy(corners.begin(), corners.end(), corner_.begin());
}

// Of all segments from one side to the other those that are no edges meet the plane inside of the
// section: its corners are the ends that count.
bool Hull::cut(const Plane& plane, Hull& above) {
  double height[kMost];
  std::size_t over = 0, under = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    height[i] = dot3(plane.normal, corner_[i].data()) - plane.offset;
    if (std::fabs(height[i]) <= kOnPlane) height[i] = 0;  // in both parts
    over += height[i] > 0 ? 1 : 0;
    under += height[i] < 0 ? 1 : 0;
  }
  above = Hull();
  if (over == 0) return true;
  if (under == 0) {
    std::swap(above, *this);
    return true;
  }
  constexpr std::size_t kSection = kMost * kMost / 4 + kMost;
  std::array<Flat, kSection> section;
  std::array<Flat, 2 * kSection> work;
  std::size_t count = 0;
  const auto in_section = [&](const Point& x) {
    section[count++] = {dot3(plane.u, x.data()), dot3(plane.v, x.data()), x};
  };
  for (std::size_t i = 0; i < count_; ++i) {
    if (height[i] == 0) in_section(corner_[i]);
    if (!(height[i] > 0)) continue;
    for (std::size_t j = 0; j < count_; ++j) {
      if (!(height[j] < 0)) continue;
      const double share = height[i] / (height[i] - height[j]);
      Point x;
      for (std::size_t k = 0; k < 3; ++k)
        x[k] = corner_[i][k] + share * (corner_[j][k] - corner_[i][k]);
      in_section(x);
    }
  }
  count = corners_first(std::span(section).first(count), work);
  if (std::max(over, under) + count > kMost) return false;
  Hull below;
  for (std::size_t i = 0; i < count_; ++i) {
    if (height[i] > 0) above.add(corner_[i]);
    if (height[i] < 0) below.add(corner_[i]);
  }
  for (Hull* part : {&above, &below})
    for (std::size_t i = 0; i < count; ++i) part->add(section[i].at);
  *this = below;
  return true;
}

}  // namespace ist
