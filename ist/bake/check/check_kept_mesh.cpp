#include <ist/asset.h>
#include <algorithm>
#include <cmath>

#include "bake/check/check_spheres.h"
#include "bake/mesh/kept_mesh.h"
#include "mesh/connectivity/disjoint_sets.h"

namespace ist {
namespace {

using CheckCorners = CheckedMesh::Corners;
using Point = Eigen::Vector3d;
using Edge = std::array<std::uint32_t, 2>;

class MeshOfAsset {
 public:
  MeshOfAsset(const AssetHeader& asset, const MeshHeader& mesh)
      : header(mesh),
        blocks(at<MeshBlock>(asset, mesh.level[0].blocks)),
        count(mesh.level[0].count),
        neighbours(at<std::uint32_t>(asset, mesh.neighbours)),
        shells(at<MeshShell>(asset, mesh.shells)),
        vertices_(at<double>(asset, mesh.vertices)) {}

  Point vertex(std::uint32_t v) const { return Point(vertices_ + 3 * std::size_t{v}); }
  std::uint32_t corner(std::size_t block, std::uint32_t lane, std::size_t k) const {
    return blocks[block].vertex[blocks[block].corner[k][lane]];
  }
  std::vector<CheckCorners> triangles() const {
    std::vector<CheckCorners> all;
    for (std::size_t b = 0; b < count; ++b)
      for (std::uint32_t l = 0; l < blocks[b].triangles; ++l)
        all.push_back({vertex(corner(b, l, 0)), vertex(corner(b, l, 1)), vertex(corner(b, l, 2))});
    return all;
  }

  const MeshHeader& header;
  const MeshBlock* const blocks;
  const std::size_t count;
  const std::uint32_t* const neighbours;
  const MeshShell* const shells;

 private:
  const double* const vertices_;
};

double count_of(DisjointSets& sets, std::uint32_t members) {
  std::uint32_t count = 0;
  for (std::uint32_t i = 0; i < members; ++i) count += sets.find(i) == i ? 1 : 0;
  return count;
}

using Key = std::array<double, 9>;

/// Triangles by their corners, the smallest corner first, sorted.
std::vector<Key> keys_of(const std::vector<CheckCorners>& triangles) {
  std::vector<Key> keys;
  for (const CheckCorners& t : triangles) {
    const auto less = [&](std::size_t a, std::size_t b) {
      return std::lexicographical_compare(t[a].begin(), t[a].end(), t[b].begin(), t[b].end());
    };
    std::size_t first = less(1, 0) ? 1 : 0;
    if (less(2, first)) first = 2;
    Key& key = keys.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      for (int x = 0; x < 3; ++x) key[3 * k + static_cast<std::size_t>(x)] = t[(first + k) % 3][x];
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

Invariant same_triangles(const std::vector<CheckCorners>& kept,
                         const std::vector<CheckCorners>& baked) {
  const std::vector<Key> ours = keys_of(kept), theirs = keys_of(baked);
  std::vector<Key> missing, added;
  std::set_difference(theirs.begin(), theirs.end(), ours.begin(), ours.end(),
                      std::back_inserter(missing));
  std::set_difference(ours.begin(), ours.end(), theirs.begin(), theirs.end(),
                      std::back_inserter(added));
  Tally tally;
  tally.checked = theirs.size();
  tally.violations = missing.size() + added.size();
  tally.worst = static_cast<double>(tally.violations);
  return tally.named("mesh triangles",
                     "triangles that only the asset's mesh or only the baked mesh has");
}

/// Moving the vertices into the unit frame displaced them by no more than `rounding`.
Invariant rounding(const ClosedMesh& closed, const UnitFrame& frame, double rounding) {
  const double scale = frame.scale();
  const std::vector<Point>& vertices = closed.mesh.vertices;
  std::vector<char> used(vertices.size());
  for (const auto& triangle : closed.mesh.triangles)
    for (const std::uint32_t v : triangle) used[v] = 1;
  return tally_all(vertices.size(),
                   [&](std::size_t v, Tally& tally) {
                     if (used[v] == 0) return;
                     const Point there = frame.to_unit(vertices[v]);
                     Point off;
                     for (int k = 0; k < 3; ++k) {
                       // x − c as two numbers without rounding; the error is relative to the
                       // larger.
                       const double x = vertices[v][k], c = frame.centre[k];
                       const double sum = x - c, part = sum - x;
                       const double rest = (x - (sum - part)) - (c + part);
                       off[k] = ((sum - there[k] * scale) + rest) / scale;
                     }
                     tally.add(off.norm() * (1 - 1e-14) - rounding, v);
                   })
      .named("mesh rounding",
             "displacement of a vertex by the unit frame's rounding − its bound, unit frame");
}

Invariant closed(const MeshOfAsset& mesh) {
  std::vector<std::pair<Edge, int>> runs;
  for (std::size_t b = 0; b < mesh.count; ++b)
    for (std::uint32_t l = 0; l < mesh.blocks[b].triangles; ++l)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = mesh.corner(b, l, k), to = mesh.corner(b, l, (k + 1) % 3);
        runs.push_back({{std::min(from, to), std::max(from, to)}, from < to ? 1 : -1});
      }
  std::sort(runs.begin(), runs.end());
  Tally tally;
  for (std::size_t i = 0; i < runs.size();) {
    int sum = 0;
    const std::size_t first = i;
    for (; i < runs.size() && runs[i].first == runs[first].first; ++i) sum += runs[i].second;
    tally.add(std::abs(sum), first);
  }
  return tally.named("mesh closed", "uses of an edge in one direction − uses in the other");
}

Invariant blocks(const MeshOfAsset& mesh) {
  Tally tally;
  for (std::size_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& block = mesh.blocks[b];
    DisjointSets groups(block.vertices);
    for (std::uint32_t l = 0; l < block.triangles; ++l)
      for (std::size_t k = 1; k < 3; ++k) groups.unite(block.corner[0][l], block.corner[k][l]);
    tally.add(count_of(groups, block.vertices) - 1, b);
  }
  return tally.named("mesh blocks", "parts of a block that share no vertex − 1");
}

/// A block's list contains all blocks that share a vertex with it, and no other; at a vertex of
/// more than kMostAround blocks, enough of them to connect all.
Invariant neighbours(const MeshOfAsset& mesh) {
  std::vector<std::vector<std::uint32_t>> around(mesh.header.vertex_count);
  for (std::uint32_t b = 0; b < mesh.count; ++b)
    for (std::uint32_t i = 0; i < mesh.blocks[b].vertices; ++i)
      around[mesh.blocks[b].vertex[i]].push_back(b);
  const auto is_large = [&](std::uint32_t v) { return around[v].size() > kMostAround; };
  const auto named_by = [&](std::size_t b) {
    std::vector<std::uint32_t> named;
    for (std::uint32_t k = 0; k < mesh.blocks[b].neighbours; ++k)
      named.push_back(mesh.neighbours[mesh.blocks[b].first_neighbour + k] / kWidth);
    std::sort(named.begin(), named.end());
    return named;
  };
  const auto has = [&](std::size_t b, std::uint32_t v) {
    const MeshBlock& block = mesh.blocks[b];
    return std::find(block.vertex, block.vertex + kWidth, v) != block.vertex + kWidth;
  };
  Tally all = tally_all(mesh.count, [&](std::size_t b, Tally& tally) {
    const MeshBlock& block = mesh.blocks[b];
    const std::vector<std::uint32_t> named = named_by(b);
    std::vector<std::uint32_t> wanted, wrong;
    for (std::uint32_t i = 0; i < block.vertices; ++i)
      for (const std::uint32_t other : around[block.vertex[i]])
        if (other != b && !is_large(block.vertex[i])) wanted.push_back(other);
    for (const std::uint32_t other : named)
      if (std::any_of(block.vertex, block.vertex + block.vertices,
                      [&](std::uint32_t v) { return is_large(v) && has(other, v); }))
        wanted.push_back(other);
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    std::set_symmetric_difference(wanted.begin(), wanted.end(), named.begin(), named.end(),
                                  std::back_inserter(wrong));
    tally.add(static_cast<double>(wrong.size()), b);
  });
  for (std::uint32_t v = 0; v < around.size(); ++v) {
    if (!is_large(v)) continue;
    DisjointSets groups(mesh.count);
    for (const std::uint32_t b : around[v])
      for (const std::uint32_t other : named_by(b))
        if (has(other, v)) groups.unite(b, other);
    for (const std::uint32_t b : around[v])
      all.add(groups.find(b) == groups.find(around[v][0]) ? 0 : 1, b);
  }
  return all.named("mesh neighbours",
                   "blocks that share a vertex but are not listed, or are listed but share none");
}

/// How far a block's vertices protrude from a box; ≤ 0: not at all.
double out_of(const MeshOfAsset& mesh, std::size_t b, const Point& low, const Point& high) {
  double most = -HUGE_VAL;
  for (std::uint32_t i = 0; i < mesh.blocks[b].vertices; ++i) {
    const Point p = mesh.vertex(mesh.blocks[b].vertex[i]);
    most = std::max({most, (low - p).maxCoeff(), (p - high).maxCoeff()});
  }
  return most;
}

Invariant boxes(const AssetHeader& asset, const MeshOfAsset& mesh) {
  Tally sum;
  std::size_t number = 0;
  for (std::uint32_t k = 1; k < mesh.header.level_count; ++k) {
    const std::size_t below = mesh.header.level[k - 1].count;
    const BoxBlock* const level = at<BoxBlock>(asset, mesh.header.level[k].blocks);
    sum.add(tally_all(below, [&](std::size_t i, Tally& tally) {
      Point low, high;
      for (int x = 0; x < 3; ++x) {
        low[x] = level[i / kWidth].low[x][i % kWidth];
        high[x] = level[i / kWidth].high[x][i % kWidth];
      }
      double most = -HUGE_VAL;
      const std::size_t end = std::min(mesh.count, (i + 1) << (4 * (k - 1)));
      for (std::size_t b = i << (4 * (k - 1)); b < end; ++b)
        most = std::max(most, out_of(mesh, b, low, high));
      tally.add(most, number + i);
    }));
    number += below;
  }
  return sum.named("mesh boxes", "protrusion of a box's content out of the box, unit frame");
}

/// Connected blocks form one shell, and there are no other shells.
Invariant shells(const MeshOfAsset& mesh) {
  DisjointSets groups(mesh.header.vertex_count);
  for (std::size_t b = 0; b < mesh.count; ++b)
    for (std::uint32_t i = 1; i < mesh.blocks[b].vertices; ++i)
      groups.unite(mesh.blocks[b].vertex[0], mesh.blocks[b].vertex[i]);
  Tally together;
  for (std::size_t b = 0; b < mesh.count; ++b) {
    const MeshBlock& first = mesh.blocks[mesh.shells[mesh.blocks[b].shell].block];
    const bool hang_together =
        groups.find(mesh.blocks[b].vertex[0]) == groups.find(first.vertex[0]);
    together.add(hang_together ? 0 : 1, b);
  }
  together.add(std::abs(count_of(groups, mesh.header.vertex_count) - mesh.header.shell_count),
               mesh.count);
  return together.named("mesh shells",
                        "1 for a block not connected to its shell; connected parts − shells");
}

}  // namespace

std::vector<Invariant> check_kept_mesh(const AssetHeader& asset, const ClosedMesh& baked,
                                       const UnitFrame& frame, const CheckedMesh& checked) {
  if (asset.mesh == 0) return {};
  const MeshOfAsset mesh(asset, *at<MeshHeader>(asset, asset.mesh));
  Tally error;
  error.add(std::fabs(mesh.header.error - asset.polygonise_error), 0);
  return {same_triangles(mesh.triangles(), checked.triangles()),
          rounding(baked, frame, mesh.header.rounding),
          error.named("mesh error",
                      "difference of the mesh's error and the solid's polygonisation, unit frame"),
          closed(mesh),
          blocks(mesh),
          neighbours(mesh),
          boxes(asset, mesh),
          shells(mesh)};
}

}  // namespace ist
