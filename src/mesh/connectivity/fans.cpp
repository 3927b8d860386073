#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <Eigen/Geometry>
#include <algorithm>

#include "mesh/connectivity/fan_slabs.h"
#include "mesh/connectivity/item_groups.h"
#include "mesh/connectivity/self_intersections.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {
namespace {

/// The fan of a vertex, and memory to search it.
struct Fan {
  std::vector<std::array<std::uint32_t, 2>> sides;  ///< opposite to the vertex: from, to
  std::vector<std::uint32_t> ring;
  std::vector<Eigen::Vector3d> spokes;
  std::vector<exact_sign::BoundedCross> faces;
};

/// Finds the sides opposite to a vertex as a ring. False if they do not form one closed ring.
bool find_ring(std::uint32_t v, std::span<const std::uint32_t> triangles_at,
               const std::vector<Triangle>& triangles, Fan& fan) {
  fan.sides.clear();
  for (const std::uint32_t at : triangles_at) {
    const Triangle& t = triangles[at];
    const std::size_t k = t[0] == v ? 0 : t[1] == v ? 1 : 2;
    fan.sides.push_back({t[(k + 1) % 3], t[(k + 2) % 3]});
  }
  std::sort(fan.sides.begin(), fan.sides.end());
  fan.ring.clear();
  if (fan.sides.size() < 3) return false;
  std::uint32_t from = fan.sides[0][0];
  do {
    const auto side = std::lower_bound(fan.sides.begin(), fan.sides.end(), std::array{from, 0u});
    if (side == fan.sides.end() || (*side)[0] != from) return false;
    fan.ring.push_back(from);
    from = (*side)[1];
  } while (from != fan.ring[0] && fan.ring.size() < fan.sides.size());
  return from == fan.ring[0] && fan.ring.size() == fan.sides.size();
}

bool is_spread(std::uint32_t v, const std::vector<Eigen::Vector3d>& vertices, Fan& fan) {
  const std::size_t count = fan.ring.size();
  std::vector<Eigen::Vector3d>& spokes = fan.spokes;
  std::vector<exact_sign::BoundedCross>& faces = fan.faces;
  spokes.resize(count);
  faces.resize(count);
  Eigen::Vector3d viewer = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < count; ++i) spokes[i] = vertices[fan.ring[i]] - vertices[v];
  for (std::size_t i = 0; i < count; ++i) {
    faces[i] = {spokes[i].data(), spokes[i + 1 < count ? i + 1 : 0].data()};
    viewer += Eigen::Map<const Eigen::Vector3d>(faces[i].value);
  }
  const double length = viewer.cwiseAbs().maxCoeff();
  if (!(length > 0)) return false;
  viewer /= length;
  for (std::size_t i = 0; i < count; ++i)
    if (faces[i].side_of(viewer.data()) <= 0) return false;
  // Each spoke is less than half a turn after the one before. They go around once if they are first
  // left of the first spoke, then perhaps one is opposite to it, then right of it.
  int last = 1;
  for (std::size_t i = 2; i + 1 < count; ++i) {
    const exact_sign::BoundedCross plane(spokes[0].data(), spokes[i].data());
    const int side = plane.side_of(viewer.data());
    if (side > last || (side == 0 && last == 0)) return false;
    last = side;
  }
  return true;
}

constexpr double kFullCone = 4;  ///< [rad] no angle is larger

/// Adds a cone from the owner around the group's other corners: less than half of all directions,
/// or all.
void add_cone(const RawArray<FloatPoint>& points, const std::vector<Triangle>& triangles,
              std::span<const std::uint32_t> group, Slab& slab) {
  const auto for_each_direction = [&](const auto& visit) {
    const FloatPoint& o = points[slab.owner];
    for (const std::uint32_t i : group)
      for (const std::uint32_t v : triangles[i]) {
        if (v == slab.owner) continue;
        const FloatPoint& p = points[v];
        const Eigen::Vector3d off(double{p[0]} - double{o[0]}, double{p[1]} - double{o[1]},
                                  double{p[2]} - double{o[2]});
        const double length = off.norm();
        constexpr double kShort = 1e-3;  // shorter vectors lose their direction in float
        visit(length > kShort ? Eigen::Vector3d(off / length) : Eigen::Vector3d::Zero());
      }
  };
  slab.direction.setZero();
  for_each_direction([&](const Eigen::Vector3d& to) { slab.direction += to; });
  const double length = slab.direction.norm();
  if (length > 0) slab.direction /= length;
  for_each_direction([&](const Eigen::Vector3d& to) {
    const double along = slab.direction.dot(to);
    slab.angle = along > 0 ? std::max(slab.angle, angle_of(slab.direction.cross(to).norm(), along))
                           : kFullCone;
  });
}

}  // namespace

std::vector<std::uint32_t> spread_fans(const std::vector<Eigen::Vector3d>& vertices,
                                       const std::vector<Triangle>& triangles,
                                       const std::vector<std::uint8_t>& left_out) {
  const auto is_asked = [&](std::uint32_t triangle) {
    return left_out.empty() || left_out[triangle] == 0;
  };
  const ItemGroups<> fans = triangles_at_vertices(vertices.size(), triangles);
  std::vector<std::uint32_t> spread(vertices.size(), 0);
  tbb::enumerable_thread_specific<Fan> of_threads;
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(vertices.size()),
                    [&](std::uint32_t v) {
                      if (std::ranges::none_of(fans[v], is_asked)) return;
                      Fan& fan = of_threads.local();
                      if (find_ring(v, fans[v], triangles, fan) && is_spread(v, vertices, fan))
                        spread[v] = static_cast<std::uint32_t>(fan.ring.size());
                    });
  return spread;
}

std::vector<std::uint32_t> owners_of(const std::vector<Triangle>& triangles, std::size_t vertices) {
  constexpr std::uint32_t kMany = 64;
  std::vector<std::uint32_t> count(vertices, 0), owners;
  for (const Triangle& t : triangles)
    for (const std::uint32_t v : t) ++count[v];
  if (std::none_of(count.begin(), count.end(), [](const auto n) { return n >= kMany; }))
    return owners;
  owners.resize(triangles.size());
  tbb::parallel_for(std::size_t{0}, triangles.size(), [&](std::size_t t) {
    const auto corner =
        *std::max_element(triangles[t].begin(), triangles[t].end(),
                          [&](std::uint32_t a, std::uint32_t b) { return count[a] < count[b]; });
    owners[t] = count[corner] >= kMany ? corner : kNoIndex;
  });
  return owners;
}

Slab slab_of(const RawArray<FloatPoint>& points, const std::vector<Triangle>& triangles,
             std::span<const std::uint32_t> group, const std::vector<std::uint32_t>& owners,
             const std::vector<std::uint32_t>& spread, double margin) {
  Slab slab;
  slab.owner = owners[group[0]];
  const auto point = [&](std::uint32_t v) {
    return Eigen::Vector3d(double{points[v][0]}, double{points[v][1]}, double{points[v][2]});
  };
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), longest = Eigen::Vector3d::UnitX();
  double length = 0;
  for (const std::uint32_t i : group) {
    if (owners[i] != slab.owner) slab.owner = kNoIndex;
    const Triangle& t = triangles[i];
    normal += (point(t[1]) - point(t[0])).cross(point(t[2]) - point(t[0]));
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d side = point(t[(k + 1) % 3]) - point(t[k]);
      if (side.squaredNorm() <= length) continue;
      length = side.squaredNorm();
      longest = side;
    }
  }
  if (slab.owner != kNoIndex) {
    slab.spread = spread[slab.owner] != 0;
    add_cone(points, triangles, group, slab);
  }
  longest.normalize();
  normal -= longest * longest.dot(normal);
  if (!(normal.squaredNorm() > 1e-30)) normal = longest.unitOrthogonal();
  slab.axes << longest, normal.normalized(), longest.cross(normal.normalized());
  Eigen::AlignedBox3d box;
  for (const std::uint32_t i : group)
    for (const std::uint32_t v : triangles[i]) box.extend(slab.axes.transpose() * point(v));
  slab.half = box.sizes() / 2 + Eigen::Vector3d::Constant(margin);
  slab.centre = slab.axes * box.center();
  return slab;
}

Slice slice_of(const RawArray<FloatPoint>& points, const std::vector<Triangle>& triangles,
               std::span<const std::uint32_t> group, double margin) {
  Slice slice;
  Eigen::Matrix<double, 3, Slice::kCorners> corners;
  for (std::size_t c = 0; c < Slice::kCorners; ++c)
    for (std::size_t k = 0; k < 3; ++k) {
      slice.corner[k][c] = points[triangles[group[c / 3 % group.size()]][c % 3]][k];
      corners(Eigen::Index(k), Eigen::Index(c)) = double{slice.corner[k][c]};
    }
  struct Plane {
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double reach = HUGE_VAL, beyond = HUGE_VAL;  ///< of the group; beyond the triangle
  };
  std::vector<Plane> planes;
  for (Eigen::Index t = 0; t < Eigen::Index(group.size()); ++t) {
    const Eigen::Vector3d a = corners.col(3 * t);
    const Eigen::Vector3d n = (corners.col(3 * t + 1) - a).cross(corners.col(3 * t + 2) - a);
    if (!(n.squaredNorm() > 0)) continue;
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector3d normal = side * n.normalized();
      const double reach = (normal.transpose() * corners).maxCoeff();
      planes.push_back({normal, reach, reach - normal.dot(a)});
    }
  }
  const auto nearest = [&](const Eigen::Vector3d& against) {
    Plane best;
    for (const Plane& plane : planes)
      if (plane.normal.dot(against) <= 0 && plane.beyond < best.beyond) best = plane;
    return best;
  };
  const Plane first = nearest(Eigen::Vector3d::Zero()), second = nearest(first.normal);
  for (const int i : {0, 1}) {
    const Plane& plane = i == 0 ? first : second;
    for (int k = 0; k < 3; ++k) slice.normal[i][k] = static_cast<float>(plane.normal[k]);
    slice.reach[i] = static_cast<float>(plane.reach + margin);
  }
  return slice;
}

}  // namespace ist
