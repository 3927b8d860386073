#include "mesh/shells.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "mesh/disjoint_sets.h"

namespace ist {

std::optional<std::uint32_t> make_consistent(std::vector<Triangle>& triangles,
                                             const EdgeTable& edges) {
  const std::size_t n = triangles.size();
  std::vector<bool> seen(n, false), turned(n, false);
  std::vector<std::uint32_t> piece;
  std::optional<std::uint32_t> conflict;
  for (std::uint32_t seed = 0; seed < n; ++seed) {
    if (seen[seed]) continue;
    seen[seed] = true;
    piece.assign(1, seed);
    std::size_t turns = 0;
    for (std::size_t next = 0; next < piece.size(); ++next) {
      const std::uint32_t t = piece[next];
      for (std::uint32_t side = 3 * t; side < 3 * t + 3; ++side) {
        const std::uint32_t edge = edges.edge_of(side);
        if (edge == kNoIndex) continue;
        const auto sides = edges.sides(edge);
        if (sides.size() != 2) continue;
        const std::uint32_t other_side = sides[0] == side ? sides[1] : sides[0];
        const std::uint32_t other = other_side / 3;
        const bool disagree = runs_up(triangles, side) == runs_up(triangles, other_side);
        const bool other_turned = turned[t] != disagree;
        if (!seen[other]) {
          seen[other] = true;
          turned[other] = other_turned;
          turns += other_turned ? 1 : 0;
          piece.push_back(other);
        } else if (turned[other] != other_turned && !conflict) {
          conflict = edge;
        }
      }
    }
    if (2 * turns > piece.size())
      for (const std::uint32_t t : piece) turned[t] = !turned[t];
  }
  if (conflict) return conflict;
  for (std::size_t t = 0; t < n; ++t)
    if (turned[t]) std::swap(triangles[t][1], triangles[t][2]);
  return std::nullopt;
}

namespace {

int balance(const std::vector<Triangle>& triangles, const std::span<const std::uint32_t> sides) {
  int sum = 0;
  for (const std::uint32_t side : sides) sum += runs_up(triangles, side) ? 1 : -1;
  return sum;
}

}  // namespace

std::optional<std::uint32_t> find_unbalanced_edge(const std::vector<Triangle>& triangles,
                                                  const EdgeTable& edges) {
  for (std::uint32_t e = 0; e < edges.size(); ++e)
    if (balance(triangles, edges.sides(e)) != 0) return e;
  return std::nullopt;
}

Shells find_shells(const std::vector<Triangle>& triangles, const EdgeTable& edges) {
  DisjointSets pieces(triangles.size());
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() == 2) pieces.unite(sides[0] / 3, sides[1] / 3);
  }
  std::vector<std::pair<std::uint32_t, int>> sums;  // piece, balance at this edge
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() <= 2) continue;
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
  std::vector<std::uint32_t> number(triangles.size(), kNoIndex);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    std::uint32_t& shell = number[pieces.find(t)];
    if (shell == kNoIndex) shell = shells.count++;
    shells.of_triangle[t] = shell;
  }
  return shells;
}

bool SignedVolume::is_flat() const {
  constexpr double kRounding = 1e-12;  // of the terms that cancel
  return !(std::abs(volume) > kRounding * magnitude);
}

}  // namespace ist
