#include "mesh/connectivity/shells.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include "base/thread_arena.h"

namespace ist {

SidePartners manifold_partners(const EdgeTable& edges) {
  SidePartners partners(edges.side_count(), kNoIndex);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() != 2) continue;
    partners[sides[0]] = sides[1];
    partners[sides[1]] = sides[0];
  }
  return partners;
}

DisjointSets connected_pieces(const EdgeTable& edges, std::size_t most) {
  DisjointSets pieces(edges.side_count() / 3);
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t e) {
    const auto sides = edges.sides(e);
    if (sides.size() > most) return;
    for (const std::uint32_t side : sides) pieces.unite(sides[0] / 3, side / 3);
  });
  return pieces;
}

namespace {

/// A monotone substitute in [0, 4) for the angle of p about the axis through `origin`, from 0 at
/// `zero`: the perimeter of a diamond instead of a circle.
double diamond_angle(const Eigen::Vector3d& p, const Eigen::Vector3d& origin,
                     const Eigen::Vector3d& axis, const Eigen::Vector3d& zero) {
  const Eigen::Vector3d right = (zero - origin) - axis * (axis.dot(zero - origin));
  const double x = right.dot(p - origin), y = axis.cross(right).dot(p - origin);
  const double sum = std::abs(x) + std::abs(y);
  if (sum == 0) return 0;
  if (y >= 0) return x >= 0 ? y / sum : 1 - x / sum;
  return x < 0 ? 2 - y / sum : 3 + x / sum;
}

/// The sides at an edge, sorted by their angle about it.
std::vector<std::pair<double, std::uint32_t>> around_edge(
    const std::vector<Eigen::Vector3d>& vertices, const std::vector<Triangle>& triangles,
    const EdgeTable& edges, std::size_t edge) {
  const auto sides = edges.sides(edge);
  const Eigen::Vector3d& origin = vertices[edges.low(edge)];
  const Eigen::Vector3d axis = (vertices[edges.high(edge)] - origin).normalized();
  const auto opposite = [&](std::uint32_t side) {
    return vertices[triangles[side / 3][(side + 2) % 3]];
  };
  std::vector<std::pair<double, std::uint32_t>> order;
  for (const std::uint32_t side : sides)
    order.emplace_back(diamond_angle(opposite(side), origin, axis, opposite(sides[0])), side);
  std::sort(order.begin(), order.end());
  return order;
}

int balance(const std::vector<Triangle>& triangles, std::span<const std::uint32_t> sides) {
  int sum = 0;
  for (const std::uint32_t side : sides) sum += runs_up(triangles, side) ? 1 : -1;
  return sum;
}

}  // namespace

SidePartners all_partners(const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  SidePartners partners = manifold_partners(edges);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const std::size_t count = edges.sides(e).size();
    if (count <= 2 || count % 2 != 0) continue;
    const auto order = around_edge(vertices, triangles, edges, e);
    // Compares two pairings: the first with the second …, or the second with the third ….
    std::array<int, 2> agreeing{0, 0};
    std::array<double, 2> angle{0, 0};
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [from, side] = order[i];
      const auto& [to, next] = order[(i + 1) % count];
      agreeing[i % 2] += runs_up(triangles, side) != runs_up(triangles, next) ? 1 : 0;
      angle[i % 2] += i + 1 < count ? to - from : to + 4 - from;
    }
    const bool shifted =
        agreeing[0] != agreeing[1] ? agreeing[1] > agreeing[0] : angle[1] < angle[0];
    for (std::size_t i = shifted ? 1 : 0; i < count; i += 2) {
      const std::uint32_t a = order[i].second, b = order[(i + 1) % count].second;
      partners[a] = b;
      partners[b] = a;
    }
  }
  return partners;
}

SidePartners nearest_partners(const std::vector<Eigen::Vector3d>& vertices,
                              const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  SidePartners partners = manifold_partners(edges);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() <= 2) continue;
    auto order = around_edge(vertices, triangles, edges, e);
    while (order.size() >= 2) {
      std::size_t first = order.size();
      double least = HUGE_VAL;
      for (std::size_t i = 0; i < order.size(); ++i) {
        const auto& [from, side] = order[i];
        const auto& [to, next] = order[(i + 1) % order.size()];
        const double angle = i + 1 < order.size() ? to - from : to + 4 - from;
        if (runs_up(triangles, side) == runs_up(triangles, next) || !(angle < least)) continue;
        least = angle;
        first = i;
      }
      if (first == order.size()) break;  // unbalanced
      const std::size_t second = (first + 1) % order.size();
      partners[order[first].second] = order[second].second;
      partners[order[second].second] = order[first].second;
      order.erase(order.begin() + static_cast<std::ptrdiff_t>(std::max(first, second)));
      order.erase(order.begin() + static_cast<std::ptrdiff_t>(std::min(first, second)));
    }
  }
  return partners;
}

std::optional<std::uint32_t> make_consistent(std::vector<Triangle>& triangles,
                                             const SidePartners& partners) {
  const std::size_t n = triangles.size();
  std::vector<bool> seen(n, false), turned(n, false);
  std::vector<std::uint32_t> piece;
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (seen[seed]) continue;
    seen[seed] = true;
    piece.assign(1, seed);
    std::size_t turns = 0;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const std::uint32_t t = piece[next];
      for (std::uint32_t side = 3 * t; side < 3 * t + 3; ++side) {
        if (partners[side] == kNoIndex) continue;
        const std::uint32_t other = partners[side] / 3;
        const bool disagree = runs_up(triangles, side) == runs_up(triangles, partners[side]);
        const bool other_turned = turned[t] != disagree;
        if (!seen[other]) {
          seen[other] = true;
          turned[other] = other_turned;
          turns += other_turned ? 1 : 0;
          piece.push_back(other);
        } else if (turned[other] != other_turned) {
          return side;
        }
      }
    }
    if (2 * turns > piece.size())
      for (const std::uint32_t t : piece) turned[t] = !turned[t];
  }
  for (std::size_t t = 0; t < n; ++t)
    if (turned[t]) std::swap(triangles[t][1], triangles[t][2]);
  return std::nullopt;
}

std::optional<std::uint32_t> find_unbalanced_edge(const std::vector<Triangle>& triangles,
                                                  const EdgeTable& edges) {
  const std::uint32_t first = tbb::parallel_reduce(
      tbb::blocked_range<std::uint32_t>(0, static_cast<std::uint32_t>(edges.size())), kNoIndex,
      [&](const tbb::blocked_range<std::uint32_t>& range, std::uint32_t found) {
        for (std::uint32_t e = range.begin(); e < range.end() && found == kNoIndex; ++e)
          if (balance(triangles, edges.sides(e)) != 0) found = e;
        return found;
      },
      [](std::uint32_t a, std::uint32_t b) { return std::min(a, b); });
  return first == kNoIndex ? std::nullopt : std::optional(first);
}

Shells find_shells(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  DisjointSets pieces = connected_pieces(edges, 2);
  std::vector<std::pair<std::uint32_t, int>> sums;  // piece, balance at this edge
  const std::vector<std::uint32_t> crowded =
      indices_where(edges.size(), [&](std::size_t e) { return edges.sides(e).size() > 2; });
  for (const std::uint32_t e : crowded) {
    const auto sides = edges.sides(e);
    sums.clear();
    for (const std::uint32_t side : sides) {
      const std::uint32_t piece = pieces.find(side / 3);
      const auto found = std::find_if(sums.begin(), sums.end(),
                                      [&](const auto& entry) { return entry.first == piece; });
      const int direction = runs_up(triangles, side) ? 1 : -1;
      if (found == sums.end())
        sums.emplace_back(piece, direction);
      else
        found->second += direction;
    }
    std::uint32_t first = kNoIndex;
    for (const auto& [piece, sum] : sums) {
      if (sum == 0) continue;
      if (first == kNoIndex) first = piece;
      pieces.unite(first, piece);
    }
  }
  Shells shells;
  shells.of_triangle.resize(triangles.size());
  std::atomic<bool> one{true};
  tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(triangles.size()),
                    [&](std::uint32_t t) {
                      shells.of_triangle[t] = pieces.find(t);
                      if (shells.of_triangle[t] != 0) one.store(false, std::memory_order_relaxed);
                    });
  if (one && !triangles.empty()) {
    shells.count = 1;
    return shells;
  }
  std::vector<std::uint32_t> number(triangles.size(), kNoIndex);
  for (std::uint32_t& of : shells.of_triangle) {
    std::uint32_t& shell = number[of];
    if (shell == kNoIndex) shell = shells.count++;
    of = shell;
  }
  return shells;
}

bool SignedVolume::is_flat() const {
  constexpr double kRounding = 1e-12;  // of the terms that cancel
  return !(std::abs(volume) > kRounding * magnitude);
}

}  // namespace ist
