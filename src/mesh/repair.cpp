#include "mesh/repair.h"

#include <ist/types.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "mesh/import/polygon_mesh.h"
#include "mesh/message_text.h"
#include "mesh/outward_winding.h"
#include "mesh/shells.h"
#include "mesh/surface_reduction.h"
#include "mesh/usable_mesh.h"
#include "mesh/weld.h"
#include "stage/thread_arena.h"

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
      if (choices.empty()) {  // only the start of the walk, all its loops closed, has no way on
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
      // Back on the path: cut the loop off.
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

/// Border vertices in a k-d tree: the middle one of a range parts it, along x, y and z in turn.
class BorderVertices {
 public:
  BorderVertices(const TriangleMesh& mesh, const std::vector<bool>& border) : mesh_(mesh) {
    for (std::uint32_t v = 0; v < border.size(); ++v)
      if (border[v]) order_.push_back(v);
    part(0, order_.size(), 0);
  }

  /// Those within `tolerance` of the segment from u to v but not of its ends, in its order.
  std::vector<std::uint32_t> on_segment(const std::uint32_t u, const std::uint32_t v,
                                        const double tolerance) const {
    const Eigen::Vector3d& a = mesh_.vertices[u];
    const Eigen::Vector3d& b = mesh_.vertices[v];
    const double length = (b - a).norm();
    const Eigen::Vector3d along = (b - a) / length;
    std::vector<std::pair<double, std::uint32_t>> found;
    visit_near(
        Range{0, order_.size(), 0}, a, along, -tolerance, length + tolerance, tolerance,
        [&](const std::uint32_t w) {
          if (w == u || w == v) return;
          const Eigen::Vector3d p = mesh_.vertices[w] - a;
          const double at = p.dot(along);
          if (at > tolerance && at < length - tolerance && (p - at * along).norm() <= tolerance)
            found.emplace_back(at, w);
        });
    std::sort(found.begin(), found.end());
    std::vector<std::uint32_t> result;
    result.reserve(found.size());
    for (const auto& [at, w] : found) result.push_back(w);
    return result;
  }

 private:
  struct Range {
    std::size_t first, last;
    int axis;
  };

  double coordinate(const std::uint32_t v, const int axis) const { return mesh_.vertices[v][axis]; }

  void part(const std::size_t first, const std::size_t last, const int axis) {
    if (last - first < 2) return;
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [&](const std::size_t i) {
      return order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(at(first), at(middle), at(last), [&](const auto v, const auto w) {
      return std::pair(coordinate(v, axis), v) < std::pair(coordinate(w, axis), w);
    });
    part(first, middle, (axis + 1) % 3);
    part(middle + 1, last, (axis + 1) % 3);
  }

  /// The vertices near the part from `begin` to `end` of the line from a, and some others.
  template <class Visit>
  void visit_near(const Range range, const Eigen::Vector3d& a, const Eigen::Vector3d& along,
                  const double begin, const double end, const double tolerance,
                  const Visit& visit) const {
    if (range.first == range.last || !(begin <= end)) return;
    const std::size_t middle = range.first + (range.last - range.first) / 2;
    visit(order_[middle]);
    const double plane = coordinate(order_[middle], range.axis);
    const double slope = along[range.axis];
    const int next = (range.axis + 1) % 3;
    // Where the line is below `plane` + tolerance, and above `plane` − tolerance.
    for (const double side : {-1.0, 1.0}) {
      const double room = side * (a[range.axis] - plane) + 2 * tolerance;  // ≥ −side·slope·t
      double from = begin, to = end;
      if (side * slope > 0)
        from = std::max(from, -room / (side * slope));
      else if (side * slope < 0)
        to = std::min(to, -room / (side * slope));
      else if (room < 0)
        continue;
      visit_near(side < 0 ? Range{range.first, middle, next} : Range{middle + 1, range.last, next},
                 a, along, from, to, tolerance, visit);
    }
  }

  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> order_;
};

/// Splits border triangles at border vertices on their sides, one side a triangle. Returns whether
/// there was any to split.
bool split_once(TriangleMesh& mesh, const double tolerance) {
  const EdgeTable edges(mesh.triangles);
  const BorderVertices border(mesh, border_vertices(mesh, edges));
  std::vector<Triangle> pieces;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    if (edges.sides(e).size() != 1) continue;
    const std::uint32_t side = edges.sides(e)[0];
    Triangle& t = mesh.triangles[side / 3];
    const std::uint32_t u = t[side % 3], v = t[(side + 1) % 3], tip = t[(side + 2) % 3];
    if (edges.edge_of(side) != e ||
        std::pair(std::min(u, v), std::max(u, v)) != std::pair(edges.low(e), edges.high(e)))
      continue;  // already split at another side
    std::vector<std::uint32_t> stops = border.on_segment(u, v, tolerance);
    std::erase(stops, tip);
    if (stops.empty()) continue;
    stops.push_back(v);
    t = {u, stops[0], tip};
    for (std::size_t i = 0; i + 1 < stops.size(); ++i)
      pieces.push_back({stops[i], stops[i + 1], tip});
  }
  mesh.triangles.insert(mesh.triangles.end(), pieces.begin(), pieces.end());
  return !pieces.empty();
}

/// Closes cracks: joins border vertices that lie within `tolerance` [u] of each other, and splits
/// border triangles where a border vertex lies within it of their side (T-junctions). Interior
/// vertices stay. Border: edges with an odd number of sides.
TriangleMesh stitch(const TriangleMesh& mesh, const double tolerance) {
  TriangleMesh result =
      weld_among(mesh, tolerance, border_vertices(mesh, EdgeTable(mesh.triangles)));
  constexpr int kMostRounds = 8;  // each splits one side a triangle
  for (int round = 0; round < kMostRounds && split_once(result, tolerance); ++round) {
  }
  return result;
}

void tidy(TriangleMesh& mesh) {
  drop_degenerate(mesh.vertices, mesh.triangles, EdgeTable(mesh.triangles));
  reduce_coincident(mesh.triangles, EdgeTable(mesh.triangles));
}

std::size_t odd_edges(const TriangleMesh& mesh) {
  return count_odd_edges(EdgeTable(mesh.triangles));
}

/// Whether stitch() may change anything by a tolerance up to the widest crack. A vertex on a side
/// that is too near to its end for the widest tolerance is within twice that of the end.
bool may_have_cracks(const TriangleMesh& mesh, const EdgeTable& edges, const double tolerance) {
  return weld_among(mesh, 2 * tolerance, border_vertices(mesh, edges)).triangles !=
             mesh.triangles ||
         count_t_junctions(mesh, edges) > 0;
}

/// Of all tolerances up to 1e-5 of the diagonal, the smallest that leaves the fewest odd edges.
void close_cracks(TriangleMesh& mesh, MeshReport& report) {
  const EdgeTable edges(mesh.triangles);
  if (!may_have_cracks(mesh, edges, kWidestCrack * report.bounds.diagonal().norm())) return;
  const std::size_t before = count_odd_edges(edges);
  std::size_t fewest = before;
  double best_fraction = 0;
  TriangleMesh best;
  for (const double fraction : {1e-9, 1e-8, 1e-7, 1e-6, kWidestCrack}) {
    if (fewest == 0) break;
    TriangleMesh candidate = stitch(mesh, fraction * report.bounds.diagonal().norm());
    tidy(candidate);
    const std::size_t left = odd_edges(candidate);
    if (left >= fewest) continue;
    fewest = left;
    best_fraction = fraction;
    best = std::move(candidate);
  }
  if (best_fraction == 0) return;
  mesh = std::move(best);
  report.notes.push_back("repair: cracks up to " + shortest(best_fraction) +
                         " of the diagonal closed: " + counted(before - fewest, "open edge") +
                         " fewer");
}

/// How often each patch lies on an edge: patch, sides.
std::vector<std::pair<std::uint32_t, std::uint32_t>> patches_at(
    DisjointSets& patches, const std::span<const std::uint32_t> sides) {
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

/// Patches that hang together by edges of two faces, named by their first triangles, and what they
/// do to others.
struct HangingPatches {
  DisjointSets sets;
  std::vector<int> gain;  ///< odd edges fewer without this patch
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

/// Drops patches that hang on others and leave fewer odd edges when they go, best first. What is
/// right for one changes what is right for its neighbours, so those wait. Returns how many went.
std::size_t drop_fins_once(TriangleMesh& mesh) {
  const EdgeTable edges(mesh.triangles);
  HangingPatches hanging(mesh, edges);
  auto& [patches, gain, shared_edges] = hanging;
  std::vector<std::uint32_t> order;
  for (std::uint32_t patch = 0; patch < gain.size(); ++patch)
    if (gain[patch] > 0 && !shared_edges[patch].empty()) order.push_back(patch);
  std::stable_sort(order.begin(), order.end(),
                   [&](const std::uint32_t a, const std::uint32_t b) { return gain[a] > gain[b]; });
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
  mesh.triangles = std::move(kept);
  return count;
}

std::size_t drop_fins(TriangleMesh& mesh) {
  std::size_t total = 0;
  while (const std::size_t dropped = drop_fins_once(mesh)) total += dropped;
  return total;
}

double area(const std::vector<Eigen::Vector3d>& vertices, const Triangle& t) {
  return (vertices[t[1]] - vertices[t[0]]).cross(vertices[t[2]] - vertices[t[0]]).norm() / 2;
}

/// Gives each piece vertices of its own, so that no walk along a border leaves its piece.
void separate(TriangleMesh& mesh, DisjointSets& pieces) {
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
}

/// Caps every loop of odd edges; but a piece that would be capped with nearly as much surface as it
/// has is an open sheet, no solid with a hole, and is dropped.
void cap_holes(TriangleMesh& mesh, MeshReport& report) {
  constexpr double kSheet = 0.95;  // caps to own area
  DisjointSets pieces = connected_pieces(EdgeTable(mesh.triangles));
  separate(mesh, pieces);
  const EdgeTable edges(mesh.triangles);
  const auto loops = border_loops(edges);
  std::vector<std::vector<Triangle>> caps;
  std::vector<double> own_area(mesh.triangles.size(), 0), cap_area(mesh.triangles.size(), 0);
  std::vector<std::uint32_t> piece_of_loop;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    own_area[pieces.find(t)] += area(mesh.vertices, mesh.triangles[t]);
  for (const BorderLoop& loop : loops) {
    const std::uint32_t piece = pieces.find(edges.sides(loop.edge)[0] / 3);
    piece_of_loop.push_back(piece);
    caps.push_back(cap(mesh.vertices, loop));
    for (const Triangle& t : caps.back()) cap_area[piece] += area(mesh.vertices, t);
  }
  const auto is_sheet = [&](const std::uint32_t piece) {
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
  if (sheets > 0)
    report.notes.push_back("repair: " + counted(sheets, "open sheet") +
                           " removed: they enclose no volume");
  if (report.filled_holes > 0)
    report.notes.push_back("repair: " + counted(report.filled_holes, "hole") + " capped");
}

}  // namespace

void drop_inner_walls(TriangleMesh& mesh, MeshReport& report) {
  const EdgeTable edges(mesh.triangles);
  HangingPatches hanging(mesh, edges);
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
  if (walls == 0 || count_odd_edges(EdgeTable(kept)) >= count_odd_edges(edges)) return;
  mesh.triangles = std::move(kept);
  report.repaired = true;
  report.notes.push_back("repair: " + counted(walls, "inner wall") +
                         " removed: there is solid on both sides");
}

std::size_t count_t_junctions(const TriangleMesh& mesh, const EdgeTable& edges) {
  const BorderVertices border(mesh, border_vertices(mesh, edges));
  const double tolerance = kWidestCrack * bounds_of(mesh.vertices).diagonal().norm();
  return count_where(edges.size(), [&](const std::size_t e) {
    return edges.sides(e).size() == 1 &&
           !border.on_segment(edges.low(e), edges.high(e), tolerance).empty();
  });
}

TriangleMesh repair(TriangleMesh mesh, const std::string& name, MeshReport& report) {
  report.repaired = true;
  close_cracks(mesh, report);
  if (const std::size_t fins = drop_fins(mesh); fins > 0)
    report.notes.push_back("repair: " + counted(fins, "patch", "patches") +
                           " removed at edges with three or more faces");
  cap_holes(mesh, report);
  tidy(mesh);
  if (mesh.triangles.empty())
    throw OpenMeshError(name + ": cannot be repaired: no part of it encloses a volume. " + kWrapIt);
  if (const std::size_t left = odd_edges(mesh); left > 0)
    throw OpenMeshError(name + ": cannot be repaired: " +
                        counted(left, "edge remains open", "edges remain open") + ". " + kWrapIt);
  return mesh;
}

}  // namespace ist
