#include "mesh/self_intersections.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <span>
#include <utility>

#include "mesh/exact_sign.h"
#include "mesh/item_groups.h"

namespace ist {
namespace {

constexpr std::size_t kMostSpokes = 32;

/// The sides opposite to a vertex, in the order in which they follow one another. 0: they are no
/// closed ring, or too many.
std::size_t ring_about(const std::uint32_t v, const std::span<const std::uint32_t> fan,
                       const std::vector<Triangle>& triangles,
                       std::array<std::uint32_t, kMostSpokes>& ring) {
  const std::size_t count = fan.size();
  if (count < 3 || count > kMostSpokes) return 0;
  std::array<std::uint32_t, kMostSpokes> from, to;
  for (std::size_t i = 0; i < count; ++i) {
    const Triangle& t = triangles[fan[i]];
    const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
    from[i] = t[(k + 1) % 3];
    to[i] = t[(k + 2) % 3];
  }
  // Sides are brought to the front as they follow one another.
  for (std::size_t i = 0; i < count; ++i) {
    ring[i] = from[i];
    std::size_t next = i + 1;
    while (next < count && from[next] != to[i]) ++next;
    if (next == count) return i + 1 == count && to[i] == from[0] ? count : 0;
    std::swap(from[next], from[i + 1]);
    std::swap(to[next], to[i + 1]);
  }
  return 0;
}

bool is_spread(const std::uint32_t v, const std::vector<Eigen::Vector3d>& vertices,
               const std::array<std::uint32_t, kMostSpokes>& ring, const std::size_t count) {
  std::array<Eigen::Vector3d, kMostSpokes> spokes;
  std::array<exact_sign::BoundedCross, kMostSpokes> faces;
  for (std::size_t i = 0; i < count; ++i) spokes[i] = vertices[ring[i]] - vertices[v];
  Eigen::Vector3d viewer = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    faces[i] = {spokes[i].data(), spokes[i + 1 < count ? i + 1 : 0].data()};
    viewer += Eigen::Map<const Eigen::Vector3d>(faces[i].value);
  }
  const double length = viewer.cwiseAbs().maxCoeff();
  if (!(length > 0)) return false;
  viewer /= length;
  for (std::size_t i = 0; i < count; ++i)
    if (faces[i].side_of(viewer.data()) <= 0) return false;
  // Each spoke is less than half a turn on from the one before. They go around once if they are
  // left of the first spoke, then perhaps one opposite to it, then right of it.
  int last = 1;
  for (std::size_t i = 2; i + 1 < count; ++i) {
    const exact_sign::BoundedCross plane(spokes[0].data(), spokes[i].data());
    const int side = plane.side_of(viewer.data());
    if (side > last || (side == 0 && last == 0)) return false;
    last = side;
  }
  return true;
}

}  // namespace

std::vector<std::uint8_t> spread_fans(const std::vector<Eigen::Vector3d>& vertices,
                                      const std::vector<Triangle>& triangles) {
  const ItemGroups<> fans = triangles_at_vertices(vertices.size(), triangles);
  std::vector<std::uint8_t> spread(vertices.size(), 0);
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(vertices.size()),
                    [&](const std::uint32_t v) {
                      std::array<std::uint32_t, kMostSpokes> ring;
                      const std::size_t count = ring_about(v, fans[v], triangles, ring);
                      spread[v] = count > 0 && is_spread(v, vertices, ring, count) ? 1 : 0;
                    });
  return spread;
}

}  // namespace ist
