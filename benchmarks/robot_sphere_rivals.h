#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include <ist/bake.h>

#include "bake/backend/make_backend.h"
#include "mesh/mesh_solid.h"
#include "packing/cover/cover.h"
#include "robots/covers/cover_proof.h"
#include "robots/covers/cover_search.h"
#include "robots/covers/offset_surface.h"

// Simpler ways to a few spheres around a solid, unit frame. All are made just so much larger that
// the same proof succeeds.

namespace ist::benchmark {

using Balls = std::vector<CoverSphere>;
using Points = std::vector<Eigen::Vector3d>;

/// The smallest ball of points, nearly: Bădoiu and Clarkson's walk towards the farthest.
inline CoverSphere ball_of(const Points& points) {
  CoverSphere ball;
  for (const auto& p : points) ball.centre += p / static_cast<double>(points.size());
  for (int step = 1; step <= 300; ++step) {
    const auto far =
        std::max_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
          return (a - ball.centre).squaredNorm() < (b - ball.centre).squaredNorm();
        });
    ball.radius = (*far - ball.centre).norm();
    ball.centre += (*far - ball.centre) / (step + 1);
  }
  ball.radius = 0;
  for (const auto& p : points) ball.radius = std::max(ball.radius, (p - ball.centre).norm());
  return ball;
}

/// The first spheres of the packing, with the library's own cover radii.
inline Balls packing_with_covers(const MeshSolid& solid, std::size_t count) {
  const auto backend = make_backend(solid, Device::cpu);
  PackingSettings settings;
  settings.max_spheres = count;
  const SpherePacking packing = backend->pack(settings, {});
  const std::vector<float> radii = cover_radii(solid, *backend, packing.spheres, {});
  Balls balls;
  for (std::size_t i = 0; i < radii.size(); ++i)
    balls.push_back({{packing.spheres[i].x, packing.spheres[i].y, packing.spheres[i].z}, radii[i]});
  return balls;
}

/// Balls around medial points, each the largest that protrudes by no more than a level, the one
/// that holds most of what is left first; the lowest level at which `count` are enough.
inline Balls greedy_medial(const MeshSolid& solid, const SampledSolid& sampled, std::size_t count) {
  const Points centres = OffsetSurface(solid, sampled, 0).medial_centres(3000);
  double low = 1e-4, high = 2;
  Balls best;
  for (int k = 0; k < 14; ++k) {
    const double level = std::sqrt(low * high);
    const OffsetSurface surface(solid, sampled, level);
    Balls balls, chosen;
    for (const auto& c : centres) balls.push_back({c, surface.radius(c)});
    for (const std::uint32_t j : choose_greedily(balls, sampled.targets))
      chosen.push_back(balls[j]);
    if (chosen.size() <= count) best = chosen;
    (chosen.size() <= count ? high : low) = level;
  }
  return best;
}

/// Parts of the points, halved over and over: always the part with the largest ball.
inline Balls halved(const Points& points, std::size_t count,
                    const std::function<std::vector<Points>(const Points&)>& halves) {
  std::vector<Points> parts = {points};
  Balls balls = {ball_of(points)};
  while (balls.size() < count) {
    std::size_t worst = 0;
    for (std::size_t i = 0; i < balls.size(); ++i)
      if (balls[i].radius > balls[worst].radius) worst = i;
    const std::vector<Points> two = halves(parts[worst]);
    if (two.size() < 2 || balls.size() + two.size() - 1 > count) break;
    parts.erase(parts.begin() + static_cast<std::ptrdiff_t>(worst));
    balls.erase(balls.begin() + static_cast<std::ptrdiff_t>(worst));
    for (const Points& part : two) {
      parts.push_back(part);
      balls.push_back(ball_of(part));
    }
  }
  return balls;
}

inline Eigen::AlignedBox3d box_of(const Points& points) {
  Eigen::AlignedBox3d box;
  for (const auto& p : points) box.extend(p);
  return box;
}

/// The smallest ball of what lies in each cell of an octree, the largest cell divided first.
inline Balls octree(const Points& points, std::size_t count) {
  struct Cell {
    Eigen::Vector3d middle;
    double half;
    Points points;
  };
  const Eigen::AlignedBox3d box = box_of(points);
  std::vector<Cell> cells = {{box.center(), box.sizes().maxCoeff() / 2, points}};
  for (;;) {
    std::vector<Cell> next;
    const double largest =
        std::max_element(cells.begin(), cells.end(), [](const auto& a, const auto& b) {
          return a.half < b.half;
        })->half;
    std::size_t divided = 0;
    for (; divided < cells.size() && cells[divided].half < largest; ++divided) {
    }
    const Cell parent = cells[divided];
    cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(divided));
    for (int k = 0; k < 8; ++k) {
      const double h = parent.half / 2;
      const Eigen::Vector3d side((k & 1) ? 1 : -1, (k & 2) ? 1 : -1, (k & 4) ? 1 : -1);
      Cell cell = {parent.middle + h * side, h, {}};
      for (const auto& p : parent.points)
        if (((p - parent.middle).array().sign() + 0.5).sign().matrix() == side)
          cell.points.push_back(p);
      if (!cell.points.empty()) next.push_back(cell);
    }
    if (cells.size() + next.size() > count) {
      cells.push_back(parent);
      break;
    }
    cells.insert(cells.end(), next.begin(), next.end());
  }
  Balls balls;
  for (const Cell& cell : cells) balls.push_back(ball_of(cell.points));
  return balls;
}

/// One ball a part: parts are cut in two across the longest side of their box, through its middle.
inline Balls box_parts(const Points& points, std::size_t count) {
  return halved(points, count, [](const Points& part) {
    const Eigen::AlignedBox3d box = box_of(part);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    std::vector<Points> two(2);
    for (const auto& p : part) two[p[axis] < box.center()[axis] ? 0 : 1].push_back(p);
    if (two[0].empty() || two[1].empty()) two.clear();
    return two;
  });
}

}  // namespace ist::benchmark
