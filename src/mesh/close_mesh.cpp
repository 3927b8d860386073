#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>
#include <utility>

#include <ist/error.h>
#include <ist/mesh.h>

#include "mesh/disjoint_sets.h"
#include "mesh/edge_table.h"
#include "mesh/self_intersections.h"
#include "mesh/shells.h"
#include "mesh/surface_reduction.h"
#include "mesh/weld.h"

namespace ist {
namespace {

std::string shortest(const double value) {
  char text[32];
  const auto [end, error] = std::to_chars(text, text + sizeof text, value);
  return {text, end};
}

std::string position(const Eigen::Vector3d& p) {
  return std::string("(") + shortest(p[0]) + " " + shortest(p[1]) + " " + shortest(p[2]) + ")";
}

/// "1 boundary edge", "3 boundary edges".
std::string counted(const std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

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

MeshReport survey(const TriangleMesh& mesh) {
  MeshReport report;
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  for (const Eigen::Vector3d& v : mesh.vertices) report.bounds.extend(v);
  for (const Triangle& t : mesh.triangles)
    report.degenerate_triangles += is_degenerate(mesh.vertices, t) ? 1 : 0;
  const EdgeTable edges(mesh.triangles);
  report.components = count_components(mesh, edges);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    const auto sides = edges.sides(e);
    if (sides.size() == 1) ++report.boundary_edges;
    if (sides.size() >= 3) ++report.nonmanifold_edges;
    if (sides.size() == 2 && runs_up(mesh.triangles, sides[0]) == runs_up(mesh.triangles, sides[1]))
      ++report.inconsistent_edges;
  }
  const auto self_intersections = count_self_intersections(mesh.vertices, mesh.triangles);
  report.self_intersections = self_intersections.value_or(0);
  report.self_intersections_counted = self_intersections.has_value();
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
  throw Error(name + ": " + counted(odd, kind) + ", first at vertex " +
              std::to_string(edges.low(first)) + " " + position(mesh.vertices[edges.low(first)]) +
              ": not closed. Bake with --repair, or close it");
}

}  // namespace

ClosedMesh close_mesh(TriangleMesh input, const std::string& name, const OpenMeshPolicy) {
  check_indices_and_coordinates(input, name);
  TriangleMesh mesh = weld(input, 0);
  MeshReport report = survey(mesh);
  auto& notes = report.notes;
  if (report.degenerate_triangles == mesh.triangles.size())
    throw Error(name + ": all " + counted(mesh.triangles.size(), "triangle") +
                " collapse to points or lines: the coordinates have too few digits for this size " +
                "and offset. Export nearer to the origin, or in a format with more digits");

  if (report.self_intersections > 0)
    notes.push_back(counted(report.self_intersections, "pair") +
                    " of triangles intersect: inside is where the winding number is 1 or more");
  if (!report.self_intersections_counted)
    notes.push_back(
        "self-intersections were not looked for: too many triangles too close together");

  const std::size_t dropped = drop_degenerate(mesh.vertices, mesh.triangles);
  if (dropped > 0) notes.push_back(counted(dropped, "degenerate triangle") + " dropped");
  report.coincident_triangles = reduce_coincident(mesh.triangles);
  if (report.coincident_triangles > 0)
    notes.push_back(counted(report.coincident_triangles, "coincident triangle") +
                    " removed as copies or cancelling pairs");
  if (mesh.triangles.empty())
    throw Error(name + ": every face is doubled back to back: flat, no volume to fill");

  EdgeTable edges(mesh.triangles);
  if (count_odd_edges(edges) > 0) refuse_open(mesh, edges, name);
  if (const auto edge = make_consistent(mesh.triangles, edges))
    throw Error(name + ": not orientable, no side of it is outside (seen at vertex " +
                std::to_string(edges.low(*edge)) + " " + position(mesh.vertices[edges.low(*edge)]) +
                "). Remodel it as a closed solid");
  edges = EdgeTable(mesh.triangles);  // turned triangles have new sides
  if (const auto edge = find_unbalanced_edge(mesh.triangles, edges))
    throw Error(name + ": the faces at the edge from vertex " + std::to_string(edges.low(*edge)) +
                " " + position(mesh.vertices[edges.low(*edge)]) +
                " disagree about the outside. Orient them, or bake with --repair");
  if (report.inconsistent_edges > 0)
    notes.push_back(counted(report.inconsistent_edges, "edge") +
                    " with faces of opposite orientation: faces turned to agree");

  const Nesting nesting =
      orient_shells(mesh.vertices, mesh.triangles, find_shells(mesh.triangles, edges));
  if (nesting.volume.is_flat())
    throw Error(name + ": flat, it encloses no volume. Give it thickness");
  report.flipped_components = nesting.flipped;
  report.cavities = nesting.cavities;
  if (nesting.flipped > 0)
    notes.push_back(counted(nesting.flipped, "shell") + " turned inside out to face outward");
  if (nesting.cavities > 0) notes.push_back(counted(nesting.cavities, "cavity shell"));
  if (nesting.nested_solids > 0)
    notes.push_back(counted(nesting.nested_solids, "outward shell") +
                    " within another one: inside is where the winding number is 1 or more, so "
                    "they are solid, not cavities");
  report.volume = nesting.volume.volume;
  report.closed = true;
  return {weld(mesh, 0), std::move(report), name};
}

}  // namespace ist
