#include "mesh/self_intersections.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <utility>

#include "mesh/exact_sign.h"

namespace ist {
namespace {

constexpr std::size_t kMostSpokes = 32;

/// Triangles by their corners: those at vertex v are listed[begin[v]] … listed[begin[v + 1] − 1].
struct Incidence {
  std::vector<std::uint32_t> begin, listed;

  Incidence(const std::size_t vertices, const std::vector<Triangle>& triangles)
      : begin(vertices + 2, 0), listed(3 * triangles.size()) {
    const auto for_each_corner = [&](const auto& visit) {
      tbb::parallel_for(std::size_t{0}, triangles.size(), [&](const std::size_t t) {
        for (const std::uint32_t v : triangles[t]) visit(static_cast<std::uint32_t>(t), v);
      });
    };
    const auto one_more = [](std::uint32_t& count) {
      return std::atomic_ref<std::uint32_t>(count).fetch_add(1, std::memory_order_relaxed);
    };
    for_each_corner([&](std::uint32_t, const std::uint32_t v) { one_more(begin[v + 2]); });
    for (std::size_t v = 2; v < begin.size(); ++v) begin[v] += begin[v - 1];
    for_each_corner(
        [&](const std::uint32_t t, const std::uint32_t v) { listed[one_more(begin[v + 1])] = t; });
    // In whichever order the threads came.
    tbb::parallel_for(std::size_t{0}, vertices, [&](const std::size_t v) {
      std::sort(listed.begin() + begin[v], listed.begin() + begin[v + 1]);
    });
  }
};

/// The sides opposite to a vertex, in the order in which they follow one another. 0: they are no
/// closed ring, or too many.
std::size_t ring_about(const std::uint32_t v, const Incidence& incidence,
                       const std::vector<Triangle>& triangles,
                       std::array<std::uint32_t, kMostSpokes>& ring) {
  const std::size_t count = incidence.begin[v + 1] - incidence.begin[v];
  if (count < 3 || count > kMostSpokes) return 0;
  std::array<std::uint32_t, kMostSpokes> from, to;
  for (std::size_t i = 0; i < count; ++i) {
    const Triangle& t = triangles[incidence.listed[incidence.begin[v] + i]];
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
  const Incidence incidence(vertices.size(), triangles);
  std::vector<std::uint8_t> spread(vertices.size(), 0);
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(vertices.size()),
                    [&](const std::uint32_t v) {
                      std::array<std::uint32_t, kMostSpokes> ring;
                      const std::size_t count = ring_about(v, incidence, triangles, ring);
                      spread[v] = count > 0 && is_spread(v, vertices, ring, count) ? 1 : 0;
                    });
  return spread;
}

}  // namespace ist
