#include "mesh/repair.h"

#include <ist/types.h>
#include <algorithm>
#include <cmath>
#include <span>

#include "base/message_text.h"
#include "base/thread_arena.h"
#include "mesh/connectivity/border_vertices.h"
#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/connectivity/weld.h"
#include "mesh/import/polygon_mesh.h"
#include "mesh/outward_winding.h"

namespace ist {

std::vector<BorderLoop> border_loops(const EdgeTable& edges) {
  std::vector<std::uint32_t> open;  // odd edges
  std::uint32_t vertices = 0;
  for (std::uint32_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() % 2 == 0) continue;
    open.push_back(e);
    vertices = std::max(vertices, edges.high(e) + 1);
  }
  std::vector<std::vector<std::uint32_t>> at(vertices);  // edges still to walk
  for (auto e = open.rbegin(); e != open.rend(); ++e) {
    at[edges.low(*e)].push_back(*e);
    at[edges.high(*e)].push_back(*e);
  }
  std::vector<bool> walked(edges.size(), false);
  std::vector<std::uint32_t> place(vertices, kNoIndex);  // of a vertex on the path
  std::vector<BorderLoop> loops;
  for (const std::uint32_t start : open) {
    if (walked[start]) continue;
    std::vector<std::uint32_t> path{edges.low(start)};
    place[path[0]] = 0;
    while (!path.empty()) {
      auto& choices = at[path.back()];
      while (!choices.empty() && walked[choices.back()]) choices.pop_back();
      // Only the start of the walk has no next edge, once all its loops are closed.
      if (choices.empty()) {
        place[path.back()] = kNoIndex;
        path.pop_back();
        continue;
      }
      const std::uint32_t e = choices.back();
      walked[e] = true;
      const std::uint32_t next = edges.low(e) == path.back() ? edges.high(e) : edges.low(e);
      if (place[next] == kNoIndex) {
        place[next] = static_cast<std::uint32_t>(path.size());
        path.push_back(next);
        continue;
      }
      // Back on the path: cuts the loop off.
      const auto begin = path.begin() + place[next];
      loops.push_back({{begin, path.end()}, e});
      for (auto v = begin + 1; v != path.end(); ++v) place[*v] = kNoIndex;
      path.erase(begin + 1, path.end());
    }
  }
  return loops;
}

std::vector<Triangle> cap(const std::vector<Eigen::Vector3d>& vertices, const BorderLoop& loop) {
  std::vector<Triangle> triangles;
  triangulate_polygon(vertices, loop.vertices.data(), loop.vertices.size(), triangles);
  return triangles;
}

namespace {

constexpr double kWidestCrack = 1e-5;  ///< of the diagonal

std::vector<bool> border_vertices(const TriangleMesh& mesh, const EdgeTable& edges) {
  std::vector<bool> border(mesh.vertices.size(), false);
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (edges.sides(e).size() % 2 == 1) border[edges.low(e)] = border[edges.high(e)] = true;
  return border;
}

/// Splits border triangles at border vertices on their sides, one side a triangle. Of the triangles
/// in `asked`, which becomes those that were split and their pieces. Returns true if it split any.
bool split_once(Surface& surface, const BorderVertices& border, double tolerance,
                std::vector<bool>& asked) {
  TriangleMesh& mesh = surface.mesh;
  const EdgeTable& edges = surface.edges;
  const std::vector<bool> is_border = border_vertices(mesh, edges);
  std::vector<bool> split(asked.size(), false);
  std::vector<Triangle> pieces;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() != 1) continue;
    const std::uint32_t side = edges.sides(e)[0];
    if (!asked[side / 3]) continue;
    Triangle& t = mesh.triangles[side / 3];
    const std::uint32_t u = t[side % 3], v = t[(side + 1) % 3], tip = t[(side + 2) % 3];
    if (edges.edge_of(side) != e ||
        std::pair(std::min(u, v), std::max(u, v)) != std::pair(edges.low(e), edges.high(e)))
      continue;  // already split at another side
    std::vector<std::uint32_t> stops = border.on_segment(u, v, tolerance);
    std::erase_if(stops, [&](std::uint32_t w) { return w == tip || !is_border[w]; });
    if (stops.empty()) continue;
    stops.push_back(v);
    split[side / 3] = true;
    t = {u, stops[0], tip};
    for (std::size_t i = 0; i + 1 < stops.size(); ++i)
      pieces.push_back({stops[i], stops[i + 1], tip});
  }
  if (pieces.empty()) return false;
  mesh.triangles.insert(mesh.triangles.end(), pieces.begin(), pieces.end());
  surface.triangles_changed();
  asked = std::move(split);
  asked.resize(mesh.triangles.size(), true);
  return true;
}

/// Closes cracks: joins border vertices that lie within `tolerance` [u] of each other, and splits
/// border triangles if a border vertex lies within it of their side (T-junctions). Interior
/// vertices stay. Border: edges with an odd number of sides.
Surface stitch(const Surface& surface, double tolerance) {
  Surface result{weld_among(surface.mesh, tolerance, border_vertices(surface.mesh, surface.edges))};
  const BorderVertices border(result.mesh, border_vertices(result.mesh, result.edges));
  std::vector<bool> asked(result.mesh.triangles.size(), true);
  constexpr int kMostRounds = 8;  // each splits one side a triangle
  for (int round = 0; round < kMostRounds && split_once(result, border, tolerance, asked);
       ++round) {
  }
  return result;
}

void tidy(Surface& surface) {
  TriangleMesh& mesh = surface.mesh;
  if (!drop_degenerate(mesh.vertices, mesh.triangles, surface.edges).empty())
    surface.triangles_changed();
  if (reduce_coincident(mesh.triangles, surface.edges) > 0) surface.triangles_changed();
}

/// The least tolerance up to `most` with which stitch() changes anything; infinity if none does.
double least_crack(const Surface& surface, double most) {
  const EdgeTable& edges = surface.edges;
  const BorderVertices border(surface.mesh, border_vertices(surface.mesh, edges));
  double least = HUGE_VAL;
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (edges.sides(e).size() % 2 == 1)
      least = std::min(least,
                       border.least_tolerance(edges.low(e), edges.high(e), std::min(least, most)));
  return least;
}

/// Uses the smallest tolerance up to 1e-5 of the diagonal that leaves the fewest odd edges.
void close_cracks(Surface& surface, MeshReport& report) {
  const double diagonal = report.bounds.diagonal().norm();
  const double least = least_crack(surface, kWidestCrack * diagonal);
  const std::size_t before = count_odd_edges(surface.edges);
  std::size_t fewest = before;
  double best_fraction = 0;
  std::optional<Surface> best;
  for (const double fraction : {1e-9, 1e-8, 1e-7, 1e-6, kWidestCrack}) {
    if (fewest == 0 || fraction * diagonal < least) continue;
    Surface candidate = stitch(surface, fraction * diagonal);
    tidy(candidate);
    const std::size_t left = count_odd_edges(candidate.edges);
    if (left >= fewest) continue;
    fewest = left;
    best_fraction = fraction;
    best = std::move(candidate);
  }
  if (!best) return;
  surface = std::move(*best);
  report.notes.push_back("repair: cracks up to " + shortest(best_fraction) +
                         " of the diagonal closed: " + counted(before - fewest, "open edge") +
                         " fewer");
}

/// The number of each patch's sides at an edge: patch, sides.
std::vector<std::pair<std::uint32_t, std::uint32_t>> patches_at(
    DisjointSets& patches, std::span<const std::uint32_t> sides) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> counts;
  for (const std::uint32_t side : sides) counts.emplace_back(patches.find(side / 3), 1);
  std::sort(counts.begin(), counts.end());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (kept > 0 && counts[kept - 1].first == counts[i].first)
      ++counts[kept - 1].second;
    else
      counts[kept++] = counts[i];
  }
  counts.resize(kept);
  return counts;
}

/// Patches connected by edges of two faces, identified by their first triangles.
struct HangingPatches {
  DisjointSets sets;
  std::vector<int> gain;  ///< reduction of odd edges without this patch
  std::vector<std::vector<std::uint32_t>> shared_edges;

  HangingPatches(const TriangleMesh& mesh, const EdgeTable& edges)
      : sets(connected_pieces(edges, 2)),
        gain(mesh.triangles.size(), 0),
        shared_edges(mesh.triangles.size()) {
    for (std::uint32_t e = 0; e < edges.size(); ++e) {
      const auto sides = edges.sides(e);
      if (sides.size() == 2) continue;  // inside a patch
      for (const auto& [patch, count] : patches_at(sets, sides)) {
        if (count % 2 == 1) gain[patch] += sides.size() % 2 == 1 ? 1 : -1;
        if (count < sides.size()) shared_edges[patch].push_back(e);
      }
    }
  }
};

/// True if there are edges of three and more faces: otherwise no patch is attached to another.
bool any_crowded(const EdgeTable& edges) {
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (edges.sides(e).size() > 2) return true;
  return false;
}

/// Drops patches attached to others if fewer odd edges are left without them, starting with those
/// that leave the fewest for their area: a body with holes has many itself. Dropping one changes
/// the decision for its neighbours, so those wait. Returns how many were dropped.
std::size_t drop_fins_once(Surface& surface) {
  TriangleMesh& mesh = surface.mesh;
  const EdgeTable& edges = surface.edges;
  if (!any_crowded(edges)) return 0;
  HangingPatches hanging(mesh, edges);
  DisjointSets& patches = hanging.sets;
  const std::vector<int>& gain = hanging.gain;
  const auto& shared_edges = hanging.shared_edges;
  std::vector<std::uint32_t> order;
  for (std::uint32_t patch = 0; patch < gain.size(); ++patch)
    if (gain[patch] > 0 && !shared_edges[patch].empty()) order.push_back(patch);
  std::vector<double> size(gain.size(), 0);
  for (std::uint32_t t = 0; t < size.size(); ++t)
    size[patches.find(t)] += area_of(mesh.vertices, mesh.triangles[t]);
  std::stable_sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return gain[a] * size[b] > gain[b] * size[a];
  });
  std::vector<bool> changed(edges.size(), false), dropped(mesh.triangles.size(), false);
  std::size_t count = 0;
  for (const std::uint32_t patch : order) {
    const auto& shared = shared_edges[patch];
    if (std::any_of(shared.begin(), shared.end(), [&](std::uint32_t e) { return changed[e]; }))
      continue;
    for (const std::uint32_t e : shared) changed[e] = true;
    dropped[patch] = true;
    ++count;
  }
  std::vector<Triangle> kept;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    if (!dropped[patches.find(t)]) kept.push_back(mesh.triangles[t]);
  if (count == 0) return 0;
  mesh.triangles = std::move(kept);
  surface.triangles_changed();
  return count;
}

std::size_t drop_fins(Surface& surface) {
  std::size_t total = 0;
  while (const std::size_t dropped = drop_fins_once(surface)) total += dropped;
  return total;
}

/// Duplicates vertices so that each piece has its own, and no walk along a border leaves its piece.
void separate(Surface& surface, DisjointSets& pieces) {
  TriangleMesh& mesh = surface.mesh;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> copies;  // vertex, piece
  std::vector<std::uint32_t> owner(mesh.vertices.size(), kNoIndex);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t piece = pieces.find(t);
    for (std::uint32_t& v : mesh.triangles[t]) {
      if (owner[v] == kNoIndex) owner[v] = piece;
      if (owner[v] == piece) continue;
      const auto [copy, is_new] =
          copies.try_emplace({v, piece}, static_cast<std::uint32_t>(mesh.vertices.size()));
      if (is_new) {
        const Eigen::Vector3d position = mesh.vertices[v];
        mesh.vertices.push_back(position);
      }
      v = copy->second;
    }
  }
  if (!copies.empty()) surface.triangles_changed();
}

/// Caps every loop of odd edges. But a piece that would be capped with nearly as much surface as it
/// has is an open sheet, not a solid with a hole, and is dropped.
void cap_holes(Surface& surface, MeshReport& report) {
  constexpr double kSheet = 0.95;  // caps to own area
  TriangleMesh& mesh = surface.mesh;
  const EdgeTable& edges = surface.edges;
  DisjointSets pieces = connected_pieces(edges);
  separate(surface, pieces);
  const auto loops = border_loops(edges);
  std::vector<std::vector<Triangle>> caps;
  std::vector<double> own_area(mesh.triangles.size(), 0), cap_area(mesh.triangles.size(), 0);
  std::vector<std::uint32_t> piece_of_loop;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    own_area[pieces.find(t)] += area_of(mesh.vertices, mesh.triangles[t]);
  for (const BorderLoop& loop : loops) {
    const std::uint32_t piece = pieces.find(edges.sides(loop.edge)[0] / 3);
    piece_of_loop.push_back(piece);
    caps.push_back(cap(mesh.vertices, loop));
    for (const Triangle& t : caps.back()) cap_area[piece] += area_of(mesh.vertices, t);
  }
  const auto is_sheet = [&](std::uint32_t piece) {
    return cap_area[piece] > kSheet * own_area[piece];
  };
  std::vector<Triangle> result;
  std::size_t sheets = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t piece = pieces.find(t);
    if (!is_sheet(piece)) result.push_back(mesh.triangles[t]);
    sheets += is_sheet(piece) && piece == t ? 1 : 0;
  }
  for (std::size_t i = 0; i < caps.size(); ++i) {
    if (is_sheet(piece_of_loop[i])) continue;
    result.insert(result.end(), caps[i].begin(), caps[i].end());
    ++report.filled_holes;
  }
  mesh.triangles = std::move(result);
  mesh = weld(std::move(mesh), 0);
  surface.triangles_changed();
  if (sheets > 0)
    report.notes.push_back("repair: " + counted(sheets, "open sheet") +
                           " removed: they enclose no volume");
  if (report.filled_holes > 0)
    report.notes.push_back("repair: " + counted(report.filled_holes, "hole") + " capped");
}

}  // namespace

void drop_inner_walls(Surface& surface, MeshReport& report) {
  TriangleMesh& mesh = surface.mesh;
  if (!any_crowded(surface.edges)) return;
  HangingPatches hanging(mesh, surface.edges);
  std::vector<bool> asked(mesh.triangles.size());
  for (std::uint32_t patch = 0; patch < asked.size(); ++patch)
    asked[patch] = !hanging.shared_edges[patch].empty();
  if (std::find(asked.begin(), asked.end(), true) == asked.end()) return;
  const std::vector<bool> inner = inner_walls(mesh, hanging.sets, asked);
  std::vector<Triangle> kept;
  std::size_t walls = 0;
  for (std::uint32_t t = 0; t < inner.size(); ++t) {
    if (!inner[t]) kept.push_back(mesh.triangles[t]);
    walls += inner[t] && hanging.sets.find(t) == t ? 1 : 0;
  }
  if (walls == 0) return;
  EdgeTable edges(kept);
  if (count_odd_edges(edges) >= count_odd_edges(surface.edges)) return;
  mesh.triangles = std::move(kept);
  surface.edges = std::move(edges);
  report.repaired = true;
  report.notes.push_back("repair: " + counted(walls, "inner wall") +
                         " removed: there is solid on both sides");
}

std::size_t count_t_junctions(const TriangleMesh& mesh, const EdgeTable& edges) {
  const BorderVertices border(mesh, border_vertices(mesh, edges));
  const double tolerance = kWidestCrack * bounds_of(mesh.vertices).diagonal().norm();
  return count_where(edges.size(), [&](std::size_t e) {
    return edges.sides(e).size() == 1 &&
           !border.on_segment(edges.low(e), edges.high(e), tolerance).empty();
  });
}

void repair(Surface& surface, const std::string& name, MeshReport& report) {
  if (report.repaired) {  // dropped walls may have left copies
    Surface tidied{surface.mesh};
    tidy(tidied);
    if (count_odd_edges(tidied.edges) < count_odd_edges(surface.edges)) surface = std::move(tidied);
  }
  report.repaired = true;
  close_cracks(surface, report);
  if (const std::size_t fins = drop_fins(surface); fins > 0)
    report.notes.push_back("repair: " + counted(fins, "patch", "patches") +
                           " removed at edges with three or more faces");
  cap_holes(surface, report);
  tidy(surface);
  if (surface.mesh.triangles.empty())
    throw OpenMeshError(name + ": cannot be repaired: no part of it encloses a volume. " + kWrapIt);
  if (const std::size_t left = count_odd_edges(surface.edges); left > 0)
    throw OpenMeshError(name + ": cannot be repaired: " +
                        counted(left, "edge remains open", "edges remain open") + ". " + kWrapIt);
}

}  // namespace ist
