#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <ist/error.h>
#include <ist/mesh.h>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "mesh/message_text.h"
#include "mesh/repair.h"
#include "mesh/self_intersections.h"
#include "mesh/shells.h"
#include "mesh/surface_reduction.h"
#include "mesh/weld.h"

namespace ist {
namespace {

void check_indices_and_coordinates(const TriangleMesh& mesh, const std::string& name) {
  if (mesh.triangles.empty())
    throw Error(name + ": no triangles. There is nothing to bound a solid");
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t v : mesh.triangles[t]) {
      if (v >= mesh.vertices.size())
        throw Error(name + ": triangle " + std::to_string(t) + " names vertex " +
                    std::to_string(v) + " of " + std::to_string(mesh.vertices.size()));
      if (!mesh.vertices[v].allFinite())
        throw Error(name + ": vertex " + std::to_string(v) +
                    " has a coordinate that is infinite or not a number. Correct it");
    }
}

std::size_t count_components(const TriangleMesh& mesh, const EdgeTable& edges) {
  DisjointSets sets(mesh.triangles.size());
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (const std::uint32_t side : edges.sides(e)) sets.unite(edges.sides(e)[0] / 3, side / 3);
  std::size_t count = 0;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    count += sets.find(t) == t && !has_repeated_corner(mesh.triangles[t]) ? 1 : 0;
  return count;
}

/// Vertices whose triangles do not all hang together by the edges there.
std::size_t count_nonmanifold_vertices(const TriangleMesh& mesh, const EdgeTable& edges) {
  DisjointSets corners(3 * mesh.triangles.size());
  const auto corner_at = [&](const std::uint32_t side, const std::uint32_t vertex) {
    const std::uint32_t next = side - side % 3 + (side + 1) % 3;
    return mesh.triangles[side / 3][side % 3] == vertex ? side : next;
  };
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    for (const std::uint32_t v : {edges.low(e), edges.high(e)})
      for (const std::uint32_t side : sides)
        corners.unite(corner_at(sides[0], v), corner_at(side, v));
  }
  std::vector<std::uint32_t> fan_of(mesh.vertices.size(), kNoIndex);
  std::vector<bool> split(mesh.vertices.size(), false);
  for (std::uint32_t c = 0; c < 3 * mesh.triangles.size(); ++c) {
    if (has_repeated_corner(mesh.triangles[c / 3])) continue;
    const std::uint32_t v = mesh.triangles[c / 3][c % 3];
    if (fan_of[v] == kNoIndex) fan_of[v] = corners.find(c);
    if (fan_of[v] != corners.find(c)) split[v] = true;
  }
  return static_cast<std::size_t>(std::count(split.begin(), split.end(), true));
}

MeshReport survey(const TriangleMesh& mesh) {
  MeshReport report;
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  for (const Eigen::Vector3d& v : mesh.vertices) report.bounds.extend(v);
  for (const Triangle& t : mesh.triangles)
    report.degenerate_triangles += is_degenerate(mesh.vertices, t) ? 1 : 0;
  const EdgeTable edges(mesh.triangles);
  report.components = count_components(mesh, edges);
  report.nonmanifold_vertices = count_nonmanifold_vertices(mesh, edges);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() == 1) ++report.boundary_edges;
    if (sides.size() >= 3) ++report.nonmanifold_edges;
    if (sides.size() == 2 && runs_up(mesh.triangles, sides[0]) == runs_up(mesh.triangles, sides[1]))
      ++report.inconsistent_edges;
  }
  const auto found = find_self_intersections(mesh.vertices, mesh.triangles);
  report.self_intersections = found ? found->count : 0;
  report.self_intersections_counted = found.has_value();
  return report;
}

[[noreturn]] void refuse_open(const TriangleMesh& mesh, const EdgeTable& edges,
                              const std::string& name) {
  std::size_t boundary = 0, odd = 0, first = edges.size();
  for (std::size_t e = edges.size(); e-- > 0;) {
    const std::size_t sides = edges.sides(e).size();
    if (sides % 2 == 0) continue;
    ++odd;
    boundary += sides == 1 ? 1 : 0;
    first = e;
  }
  const std::string kind = boundary == odd ? "boundary edge" : "boundary or odd edge";
  throw OpenMeshError(
      name + ": " + counted(odd, kind) + ", first at vertex " + std::to_string(edges.low(first)) +
      " " + position_text(mesh.vertices[edges.low(first)]) + ": not closed. Repair or close it");
}

double largest_coordinate(const Eigen::AlignedBox3d& bounds) {
  return std::max(bounds.min().cwiseAbs().maxCoeff(), bounds.max().cwiseAbs().maxCoeff());
}

/// What double cannot cube. Before anything is computed with it: exact signs of infinite products
/// have no end. A mesh of one point has its own message.
void refuse_unusable_size(const TriangleMesh& mesh, const std::string& name) {
  constexpr double kSmallest = 1e-90, kLargest = 1e90, kFarthest = 1e100;
  Eigen::AlignedBox3d bounds;
  for (const Eigen::Vector3d& v : mesh.vertices) bounds.extend(v);
  const double size = bounds.sizes().maxCoeff(), offset = largest_coordinate(bounds);
  if (!(size == 0 || size > kSmallest) || !(size < kLargest && offset < kFarthest))
    throw Error(name + ": a size of " + shortest(size) + " at an offset of " + shortest(offset) +
                " cannot be computed with. Scale it");
}

/// Coordinates that were rounded until the shape was lost.
void refuse_unusable_coordinates(const std::string& name, MeshReport& report) {
  const double size = report.bounds.sizes().maxCoeff();
  const double offset = largest_coordinate(report.bounds);
  const bool far_off = offset > 1e3 * size;
  if (report.degenerate_triangles == report.triangles ||
      (far_off && report.degenerate_triangles > report.triangles / 10))
    throw Error(name + ": " + std::to_string(report.degenerate_triangles) + " of " +
                counted(report.triangles, "triangle") +
                " collapse to points or lines: the coordinates have too few digits for a size of " +
                shortest(size) + " at an offset of " + shortest(offset) +
                ". Export it nearer to the origin, or in a format with more digits");
  if (size < 1e-9 || size > 1e10)
    report.notes.push_back("a size of " + shortest(size) +
                           " is unusual: is the unit right? (1e-9 to 1e9 is promised to work)");
}

void note_findings(MeshReport& report) {
  if (report.self_intersections > 0)
    report.notes.push_back(counted(report.self_intersections, "pair") +
                           " of triangles intersect: inside is where the winding number is 1 or "
                           "more");
  if (!report.self_intersections_counted)
    report.notes.push_back(
        "self-intersections were not looked for: too many triangles, or too close together");
  if (report.nonmanifold_edges > 0)
    report.notes.push_back(counted(report.nonmanifold_edges, "edge") + " of three or more faces");
  if (report.nonmanifold_vertices > 0)
    report.notes.push_back(counted(report.nonmanifold_vertices, "vertex", "vertices") +
                           " in which sheets only touch");
}

/// Degenerate and coincident triangles (docs/design.md 3.6).
void reduce(TriangleMesh& mesh, MeshReport& report) {
  const std::size_t dropped = drop_degenerate(mesh.vertices, mesh.triangles);
  if (dropped > 0) report.notes.push_back(counted(dropped, "degenerate triangle") + " dropped");
  report.coincident_triangles = reduce_coincident(mesh.triangles);
  if (report.coincident_triangles > 0)
    report.notes.push_back(counted(report.coincident_triangles, "coincident triangle") +
                           " removed as copies or cancelling pairs");
}

/// Makes the faces at every edge agree about the outside.
void orient_faces(TriangleMesh& mesh, const std::string& name, MeshReport& report) {
  const auto corner = [&](const std::uint32_t side) {
    const std::uint32_t v = mesh.triangles[side / 3][side % 3];
    return "vertex " + std::to_string(v) + " " + position_text(mesh.vertices[v]);
  };
  const EdgeTable edges(mesh.triangles);
  if (!find_unbalanced_edge(mesh.triangles, edges)) return;
  report.notes.push_back("neighbouring faces disagreed about the outside: turned to agree");
  auto conflict = make_consistent(mesh.triangles, manifold_partners(edges));
  if (!conflict) {
    const EdgeTable turned(mesh.triangles);
    if (!find_unbalanced_edge(mesh.triangles, turned)) return;
    conflict = make_consistent(mesh.triangles, all_partners(mesh.vertices, mesh.triangles, turned));
    if (!conflict) return;
  }
  throw Error(name + ": not orientable, neither side of it is the outside (seen at " +
              corner(*conflict) + "). Remodel it as a closed solid");
}

void orient_outward(TriangleMesh& mesh, const std::string& name, MeshReport& report) {
  const Shells shells = find_shells(mesh.triangles, EdgeTable(mesh.triangles));
  const Nesting nesting = orient_shells(mesh.vertices, mesh.triangles, shells);
  report.shells = shells.count;
  if (nesting.volume.is_flat())
    throw Error(name + ": flat, it encloses no volume. Give it thickness");
  report.volume = nesting.volume.volume;
  report.flipped_components = nesting.flipped;
  report.cavities = nesting.cavities;
  if (nesting.flipped > 0)
    report.notes.push_back(counted(nesting.flipped, "shell") + " turned to face outward");
  if (nesting.cavities > 0) report.notes.push_back(counted(nesting.cavities, "cavity", "cavities"));
  if (nesting.flat > 0) report.notes.push_back(counted(nesting.flat, "shell") + " without volume");
  if (nesting.nested_solids > 0)
    report.notes.push_back(counted(nesting.nested_solids, "outward shell") +
                           " within another: solid, not a cavity, because inside is where the "
                           "winding number is 1 or more");
}

}  // namespace

ClosedMesh close_mesh(TriangleMesh input, const std::string& name, const OpenMeshPolicy policy) {
  check_indices_and_coordinates(input, name);
  TriangleMesh mesh = weld(std::exchange(input, {}), 0);
  refuse_unusable_size(mesh, name);
  MeshReport report = survey(mesh);
  refuse_unusable_coordinates(name, report);
  note_findings(report);
  reduce(mesh, report);
  if (mesh.triangles.empty())
    throw Error(name + ": every face is doubled back to back: flat, it encloses no volume");
  if (const EdgeTable edges(mesh.triangles); count_odd_edges(edges) > 0) {
    if (policy == OpenMeshPolicy::refuse) refuse_open(mesh, edges, name);
    mesh = repair(std::move(mesh), name, report);
  }
  orient_faces(mesh, name, report);
  orient_outward(mesh, name, report);
  // Dropped degenerate triangles never counted; other changes may add or remove intersections.
  report.meets_itself = !report.self_intersections_counted || report.self_intersections > 0;
  if (report.repaired || report.coincident_triangles > 0)
  {
    const auto found = find_self_intersections(mesh.vertices, mesh.triangles);
    report.meets_itself = !found || found->count > 0;
  }
  report.closed = true;
  return {weld(mesh, 0), std::move(report), name};
}

}  // namespace ist
