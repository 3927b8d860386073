#include "bake/surface/surface_error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <span>

#include "bake/surface/hull.h"
#include "mesh/exact_closest_point.h"
#include "mesh/exact_triangle.h"

namespace ist {
namespace {

constexpr double kSmallestPart = 0.2;  // of the target: smaller prisms are taken for their centres
constexpr double kSlack = 1.02;        // of a target over what is seen of its part
constexpr double kSquareRounding = 1e-15;  // of a squared distance, with room
constexpr double kInfinite = std::numeric_limits<double>::infinity();

std::vector<TriangleFrame<double>> frames_of(const MeshView& surface) {
  std::vector<TriangleFrame<double>> frames(surface.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, surface.triangle_count,
                    [&](std::uint32_t t) { frames[t] = frame_of(corners_of(surface, t)); });
  return frames;
}

constexpr double kDistanceRounding = 1e-12;  // of a distance in the unit frame, with room
constexpr double kTrialSlack = 1.25;  // of the bound that is tried over what is seen at samples
constexpr double kPartSlack = 1.02;   // likewise, of one part

using HullPoint = std::array<double, 3>;

/// A part of a surface's triangle.
struct HullPart {
  HullPoint corner[3];

  HullPoint centre() const {
    HullPoint c;
    for (std::size_t k = 0; k < 3; ++k) c[k] = (corner[0][k] + corner[1][k] + corner[2][k]) / 3;
    return c;
  }
  double radius(const HullPoint& centre) const {
    return std::max(
        {between(centre, corner[0]), between(centre, corner[1]), between(centre, corner[2])});
  }
};

/// The surface within a bound of the mesh's.
class SurfaceNearMesh {
 public:
  explicit SurfaceNearMesh(const MeshView& mesh) : mesh_(mesh), cuts_(mesh) {}

  /// A bound on the distance of all points of the part, at most `target` where that can be shown.
  /// `reach`: no point of the mesh nearest to the centre is further than this.
  double bound(const HullPart& part, double target, double reach) const {
    const HullPoint c = part.centre();
    const ClosestPoint closest =
        exact_closest_point(mesh_, {c[0], c[1], c[2]}, reach * (1 + 1e-9) + kDistanceRounding);
    const double radius = part.radius(c);
    if (closest.distance + radius <= target) return closest.distance + radius;
    if (closest.triangle != kNoTriangle) {
      const double whole = from_triangle(part, closest.triangle);
      if (whole <= target) return whole;
    }
    if (radius <= 0.1 * target) return closest.distance + radius;
    if (radius > target && cuts_.is_within(Hull(part.corner), {}, target, {c, closest.distance}))
      return target;
    // No bound is less than what is seen, and showing a little more takes far fewer parts.
    target = std::max(target, kPartSlack * closest.distance);
    for (const HullPoint& p : part.corner)
      target = std::max(
          target, kPartSlack * exact_closest_point(mesh_, {p[0], p[1], p[2]},
                                                   (closest.distance + between(c, p)) * (1 + 1e-9) +
                                                       kDistanceRounding)
                                   .distance);
    // Halved across the longest side.
    int from = 0;
    for (int k = 1; k < 3; ++k)
      if (side(part, k) > side(part, from)) from = k;
    const HullPoint middle = half_way(part.corner[from], part.corner[(from + 1) % 3]);
    HullPart first = part, second = part;
    first.corner[(from + 1) % 3] = middle;
    second.corner[from] = middle;
    double most = 0;
    for (const HullPart& half : {first, second})
      most = std::max(most, bound(half, target, closest.distance + between(c, half.centre())));
    return most;
  }

 private:
  static double side(const HullPart& part, int from) {
    return between(part.corner[from], part.corner[(from + 1) % 3]);
  }

  /// The distance to a triangle is convex: it is largest at a corner.
  double from_triangle(const HullPart& part, std::uint32_t triangle) const {
    const TriangleFrame<double> frame = frame_of(corners_of(mesh_, triangle));
    double most2 = 0;
    for (const HullPoint& p : part.corner)
      most2 = std::max(most2, closest_in_frame(frame, p.data()).distance2);
    return std::sqrt(most2);
  }

  const MeshView& mesh_;
  const HullCuts cuts_;
};

HullPart part_of(const FloatMesh& surface, std::size_t triangle) {
  HullPart part;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      part.corner[i][k] = surface.vertices[surface.triangles[triangle][i]][k];
  return part;
}

void raise(const std::atomic_ref<double>& value, double to) {
  double was = value.load(std::memory_order_relaxed);
  while (to > was && !value.compare_exchange_weak(was, to, std::memory_order_relaxed)) {
  }
}

}  // namespace

double farthest_from(const SurfaceHierarchy& surface, const FloatMesh& triangles) {
  const SurfaceNearMesh near_surface(surface.view());
  double most = 0, target = 1e-8;
  for (std::size_t t = 0; t < triangles.triangles.size(); ++t) {
    most = std::max(most, near_surface.bound(part_of(triangles, t), target, kFar));
    target = std::max(target, most);
  }
  return most + kDistanceRounding;
}

SweptError::Point SweptError::Prism::centre() const {
  Point c = {};
  for (const Point& p : corner)
    for (std::size_t k = 0; k < 3; ++k) c[k] += p[k] / 6;
  return c;
}

double SweptError::Prism::radius(const Point& centre) const {
  double most = 0;
  for (const Point& p : corner) most = std::max(most, between(centre, p));
  return most;
}

std::array<SweptError::Prism, 2> SweptError::Prism::halves() const {
  double way = 0, longest = 0;
  std::size_t from = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    way = std::max(way, between(corner[k], corner[k + 3]));
    const std::size_t next = (k + 1) % 3;
    const double side =
        std::max(between(corner[k], corner[next]), between(corner[k + 3], corner[next + 3]));
    if (side > longest) {
      longest = side;
      from = k;
    }
  }
  std::array<Prism, 2> out = {*this, *this};
  if (way > longest) {
    for (std::size_t k = 0; k < 3; ++k)
      out[0].corner[k + 3] = out[1].corner[k] = half_way(corner[k], corner[k + 3]);
    return out;
  }
  const std::size_t to = (from + 1) % 3;
  for (const std::size_t at : {std::size_t{0}, std::size_t{3}})
    out[0].corner[to + at] = out[1].corner[from + at] =
        half_way(corner[from + at], corner[to + at]);
  return out;
}

SweptError::SweptError(const MeshView& mesh, const Clustered& surface,
                       const SurfaceHierarchy& hierarchy)
    : mesh_(mesh),
      surface_(surface),
      hierarchy_(hierarchy),
      cuts_(hierarchy.view(), frames_of(hierarchy.view())),
      stars_(triangles_at_vertices(surface.mesh.vertices.size(), surface.mesh.triangles)),
      near_(mesh.vertex_count, kNoTriangle),
      last_near_(surface.vertex_of.size(), kNoTriangle) {}

double SweptError::at_vertex(std::uint32_t vertex, double known, double enough) {
  const double* x = mesh_.vertices + 3 * std::size_t{vertex};
  const double known2 = known * known * (1 - kSquareRounding);
  double least2 = kFar * kFar;
  const auto is_near = [&](std::uint32_t t) {
    const double d2 = distance2(t, {x[0], x[1], x[2]});
    if (d2 >= least2) return false;
    least2 = d2;
    near_[vertex] = t;
    return d2 <= known2;
  };
  // What was near to the vertex before is, more often than not.
  const std::atomic_ref<std::uint32_t> last(last_near_[surface_.cluster_of[vertex]]);
  const std::uint32_t first = last.load(std::memory_order_relaxed);
  if (first != kNoTriangle && is_near(first)) return known;
  for (const std::uint32_t t : stars_[surface_.image(vertex)])
    if (t != first && is_near(t)) {
      last.store(t, std::memory_order_relaxed);
      return known;
    }
  const double least = std::sqrt(least2);
  if (least <= enough) return least;
  return exact_closest_point(hierarchy_.view(), {x[0], x[1], x[2]}, least).distance;
}

bool SweptError::is_within(std::uint32_t triangle, double distance) const {
  const double limit2 = distance * distance;
  const std::uint32_t* const vertices = mesh_.triangles + 3 * std::size_t{triangle};
  std::uint32_t to[3];
  for (int i = 0; i < 3; ++i) to[i] = surface_.image(vertices[i]);
  const auto holds_all = [&](std::uint32_t t) {
    const FloatMesh::Triangle& corners = surface_.mesh.triangles[t];
    for (int i = 0; i < 3; ++i) {
      const double* x = mesh_.vertices + 3 * std::size_t{vertices[i]};
      if (distance2(t, {x[0], x[1], x[2]}) > limit2) return false;
    }
    for (const std::uint32_t v : to)  // its own corners need no look
      if (v != corners[0] && v != corners[1] && v != corners[2] &&
          distance2(t, place_of(v)) > limit2)
        return false;
    return true;
  };
  for (int i = 0; i < 3; ++i) {
    const std::uint32_t t = near_[vertices[i]];
    bool tried = t == kNoTriangle;
    for (int j = 0; j < i; ++j) tried |= near_[vertices[j]] == t;
    if (!tried && holds_all(t)) return true;
  }
  for (int i = 0; i < 3; ++i) {
    bool tried = false;
    for (int j = 0; j < i; ++j) tried |= to[j] == to[i];
    if (tried) continue;
    for (const std::uint32_t t : stars_[to[i]])
      if (holds_all(t)) return true;
  }
  return false;
}

double SweptError::farthest2(std::uint32_t surface_triangle, const Prism& prism,
                             double limit2) const {
  double most2 = 0;
  for (const Point& p : prism.corner) {
    most2 = std::max(most2, distance2(surface_triangle, p));
    if (most2 > limit2) break;
  }
  return most2;
}

double SweptError::bound(const Prism& prism, std::span<const std::uint32_t> candidates,
                         double target, bool one_may_do) const {
  const Point c = prism.centre();
  double least2 = kInfinite;
  std::uint32_t nearest = kNoTriangle;
  for (const std::uint32_t t : candidates) {
    const double d2 = distance2(t, c);
    if (d2 < least2) {
      least2 = d2;
      nearest = t;
    }
  }
  const double radius = prism.radius(c);
  const double target2 = target * target;
  if (nearest != kNoTriangle) {
    if (std::sqrt(least2) + radius <= target) return std::sqrt(least2) + radius;
    if (one_may_do) {
      double whole2 = farthest2(nearest, prism, target2);
      for (const std::uint32_t t : candidates) {
        if (whole2 <= target2) return std::sqrt(whole2);
        if (t != nearest) whole2 = farthest2(t, prism, target2);
      }
      if (whole2 <= target2) return std::sqrt(whole2);
    }
    if (radius > target &&
        cuts_.is_within(Hull(prism.corner), candidates, target, {c, std::sqrt(least2)}))
      return target;
  }
  // The surface may have another triangle that is nearer.
  const ClosestPoint closest = exact_closest_point(
      hierarchy_.view(), {c[0], c[1], c[2]}, nearest != kNoTriangle ? std::sqrt(least2) : kFar);
  const double distance = closest.distance;
  if (distance + radius <= target) return distance + radius;
  if (closest.triangle != kNoTriangle) {
    const double whole2 = farthest2(closest.triangle, prism, target2);
    if (whole2 <= target2) return std::sqrt(whole2);
  }
  if (radius <= kSmallestPart * target) return distance + radius;
  // No bound is less than what is seen, and showing a little more takes far fewer parts.
  target = std::max(target, kSlack * distance);
  for (const Point& p : prism.corner)
    target = std::max(target, kSlack * exact_closest_point(hierarchy_.view(), {p[0], p[1], p[2]},
                                                           distance + between(c, p))
                                           .distance);
  double most = 0;
  for (const Prism& half : prism.halves())
    most = std::max(most, bound(half, candidates, target, true));
  return most;
}

double SweptError::bound(std::uint32_t triangle, double target, bool one_may_do) const {
  Prism prism;
  std::vector<std::uint32_t> candidates;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t v = mesh_.triangles[3 * std::size_t{triangle} + i];
    const std::uint32_t to = surface_.image(v);
    std::copy_n(mesh_.vertices + 3 * std::size_t{v}, 3, prism.corner[i].begin());
    prism.corner[i + 3] = place_of(to);
    bool seen = false;
    for (std::size_t j = 0; j < i; ++j)
      seen |= surface_.image(mesh_.triangles[3 * std::size_t{triangle} + j]) == to;
    if (!seen) candidates.insert(candidates.end(), stars_[to].begin(), stars_[to].end());
  }
  return bound(prism, candidates, target, one_may_do);
}

std::size_t KnownDistances::Hash::operator()(const HullPoint& p) const {
  std::uint64_t hash = 0;
  for (const double x : p) {
    hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9E3779B97F4A7C15u;
    hash ^= hash >> 32;
  }
  return hash;
}

double KnownDistances::of(const HullPoint& p) {
  if (const auto known = known_.find(p); known != known_.end()) return known->second;
  const double distance = exact_closest_point(mesh_, {p[0], p[1], p[2]}, kFar).distance;
  known_.emplace(p, distance);
  return distance;
}

SurfaceError::SurfaceError(const MeshView& mesh, KnownDistances& from_mesh,
                           const Clustered& surface, const SurfaceHierarchy& hierarchy,
                           const WorkStop& stop)
    : mesh_(mesh),
      surface_(surface),
      stop_(stop),
      swept_(mesh, surface, hierarchy),
      middle_(surface.mesh.triangles.size()) {
  tbb::parallel_for(std::size_t{0}, middle_.size(), [&](std::size_t t) {
    stop_.look();
    middle_[t] = from_mesh.of(part_of(surface.mesh, t).centre());
  });
}

std::vector<double> SurfaceError::by_cluster(const std::vector<double>& of_triangle) const {
  std::vector<double> around(surface_.mesh.vertices.size());
  for (std::size_t t = 0; t < of_triangle.size(); ++t)
    for (const std::uint32_t v : surface_.mesh.triangles[t])
      around[v] = std::max(around[v], of_triangle[t]);
  std::vector<double> out(surface_.vertex_of.size());
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = around[surface_.vertex_of[c]];
  return out;
}

std::vector<double> SurfaceError::seen(double enough) {
  std::vector<double> seen = by_cluster(middle_);
  tbb::parallel_for(std::uint32_t{0}, mesh_.vertex_count, [&](std::uint32_t v) {
    stop_.look();
    const std::atomic_ref<double> most(seen[surface_.cluster_of[v]]);
    raise(most, swept_.at_vertex(v, most.load(std::memory_order_relaxed), enough));
  });
  return seen;
}

SurfaceError::Proven SurfaceError::proven(double seen, double enough) const {
  const SurfaceNearMesh near_mesh(mesh_);
  const double target = kTrialSlack * seen + kDistanceRounding;
  // What lies within the target at first sight is passed over where something else does not.
  std::vector<std::uint8_t> passed_over(mesh_.triangle_count);
  std::vector<double> of_surface(middle_.size());
  tbb::parallel_for(std::size_t{0}, of_surface.size(), [&](std::size_t t) {
    stop_.look();
    of_surface[t] = near_mesh.bound(part_of(surface_.mesh, t), target, middle_[t]);
  });
  Proven out;
  out.at_cluster = by_cluster(of_surface);
  const auto bound_swept = [&](std::uint32_t t, bool one_may_do) {
    const double bound = swept_.bound(t, target, one_may_do);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t v = mesh_.triangles[3 * std::size_t{t} + k];
      raise(std::atomic_ref<double>(out.at_cluster[surface_.cluster_of[v]]), bound);
    }
  };
  const auto most = [&] { return *std::max_element(out.at_cluster.begin(), out.at_cluster.end()); };
  tbb::parallel_for(std::uint32_t{0}, mesh_.triangle_count, [&](std::uint32_t t) {
    stop_.look();
    passed_over[t] = swept_.is_within(t, target) ? 1 : 0;
    if (passed_over[t] == 0) bound_swept(t, false);
  });
  if (most() < target || target > enough)
    tbb::parallel_for(std::uint32_t{0}, mesh_.triangle_count, [&](std::uint32_t t) {
      stop_.look();
      if (passed_over[t] != 0) bound_swept(t, true);
    });
  out.most = most() + kDistanceRounding;
  return out;
}

}  // namespace ist
