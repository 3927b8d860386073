#include <ist/mesh.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <algorithm>
#include <atomic>

#include "base/message_text.h"
#include "base/thread_arena.h"
#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/self_intersections.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/connectivity/weld.h"
#include "mesh/judge.h"
#include "mesh/repair.h"

namespace ist {
namespace {

std::size_t count_components(const TriangleMesh& mesh, const EdgeTable& edges) {
  DisjointSets sets = connected_pieces(edges);
  return count_where(mesh.triangles.size(), [&](std::size_t t) {
    return sets.find(static_cast<std::uint32_t>(t)) == t && !has_repeated_corner(mesh.triangles[t]);
  });
}

/// Vertices whose triangles are not all connected by edges at the vertex.
std::size_t count_nonmanifold_vertices(const TriangleMesh& mesh, const EdgeTable& edges) {
  DisjointSets corners(3 * mesh.triangles.size());
  const auto corner_at = [&](std::uint32_t side, std::uint32_t vertex) {
    const std::uint32_t next = side - side % 3 + (side + 1) % 3;
    return mesh.triangles[side / 3][side % 3] == vertex ? side : next;
  };
  tbb::parallel_for(std::size_t{0}, edges.size(), [&](std::size_t e) {
    const auto sides = edges.sides(e);
    for (const std::uint32_t v : {edges.low(e), edges.high(e)})
      for (const std::uint32_t side : sides.subspan(1))
        corners.unite(corner_at(sides[0], v), corner_at(side, v));
  });
  // Each fan is identified by one of its corners.
  std::vector<std::uint32_t> fans(mesh.vertices.size(), 0);
  tbb::parallel_for(std::size_t{0}, mesh.triangles.size(), [&](std::size_t t) {
    if (has_repeated_corner(mesh.triangles[t])) return;
    for (std::size_t c = 3 * t; c < 3 * t + 3; ++c)
      if (corners.find(static_cast<std::uint32_t>(c)) == c)
        std::atomic_ref<std::uint32_t>(fans[mesh.triangles[t][c % 3]]).fetch_add(1);
  });
  return count_where(fans.size(), [&](std::size_t v) { return fans[v] > 1; });
}

/// Everything except self-intersections.
MeshReport survey(const TriangleMesh& mesh, const EdgeTable& edges) {
  MeshReport report;
  report.vertices = mesh.vertices.size();
  report.triangles = mesh.triangles.size();
  report.bounds = bounds_of(mesh.vertices);
  report.degenerate_triangles = count_where(mesh.triangles.size(), [&](std::size_t t) {
    return is_degenerate(mesh.vertices, mesh.triangles[t]);
  });
  report.components = count_components(mesh, edges);
  report.nonmanifold_vertices = count_nonmanifold_vertices(mesh, edges);
  report.boundary_edges =
      count_where(edges.size(), [&](std::size_t e) { return edges.sides(e).size() == 1; });
  report.nonmanifold_edges =
      count_where(edges.size(), [&](std::size_t e) { return edges.sides(e).size() >= 3; });
  report.inconsistent_edges = count_where(edges.size(), [&](std::size_t e) {
    const auto sides = edges.sides(e);
    return sides.size() == 2 &&
           runs_up(mesh.triangles, sides[0]) == runs_up(mesh.triangles, sides[1]);
  });
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
  const std::size_t junctions = count_t_junctions(mesh, edges);
  const std::string on_them = junctions == 0
                                  ? ""
                                  : ". " + std::to_string(junctions) + " of them " +
                                        (junctions == 1 ? "is a T-junction" : "are T-junctions") +
                                        ": a vertex of other faces lies on the edge";
  throw OpenMeshError(
      name + ": " + counted(odd, kind) + ", first at vertex " + std::to_string(edges.low(first)) +
      " " + position_text(mesh.vertices[edges.low(first)]) + ": the mesh is not closed" + on_them +
      ". Close it, or have it repaired: --repair, in Python repair=True, in a "
      "manifest repair = true, in C repair = 1, in C++ OpenMeshPolicy::repair");
}

/// Refuses coordinates that were rounded until the shape was lost.
void refuse_unusable_coordinates(const std::string& name, MeshReport& report) {
  const double size = report.bounds.sizes().maxCoeff();
  const double offset = largest_coordinate(report.bounds);
  const bool far_off = offset > 1e3 * size;
  if (report.degenerate_triangles == report.triangles ||
      (far_off && report.degenerate_triangles > report.triangles / 10))
    throw Error(name + ": " + std::to_string(report.degenerate_triangles) + " of " +
                counted(report.triangles, "triangle") +
                " are degenerate: the coordinates have too few digits for a size of " +
                shortest(size) + " at an offset of " + shortest(offset) +
                ". Export it nearer to the origin, or in a format with more digits");
  if (size < 1e-9 || size > 1e10)
    report.notes.push_back("a size of " + shortest(size) +
                           " is unusual: check the unit (sizes of 1e-9 to 1e9 are supported)");
}

void note_findings(MeshReport& report) {
  if (report.self_intersections > 0)
    report.notes.push_back(
        counted(report.self_intersections, "pair") +
        " of triangles intersect: a point is inside if its winding number is 1 or more");
  if (!report.self_intersections_counted)
    report.notes.push_back(
        "self-intersections were not searched: too many triangles, or too close together");
  if (report.nonmanifold_edges > 0)
    report.notes.push_back(counted(report.nonmanifold_edges, "edge") + " with three or more faces");
  if (report.nonmanifold_vertices > 0)
    report.notes.push_back(counted(report.nonmanifold_vertices, "vertex", "vertices") +
                           " where sheets only touch");
}

using Pairs = std::vector<std::array<std::uint32_t, 2>>;

/// Renumbers pairs for the triangles that remain after dropping others, which are in no pair.
void rename_triangles(const std::vector<std::uint32_t>& dropped, Pairs& pairs) {
  for (auto& pair : pairs)
    for (std::uint32_t& t : pair)
      t -= static_cast<std::uint32_t>(std::lower_bound(dropped.begin(), dropped.end(), t) -
                                      dropped.begin());
}

/// Removes degenerate and coincident triangles (docs/design.md 3.6).
void reduce(Surface& surface, std::optional<SelfIntersections>& met, MeshReport& report) {
  TriangleMesh& mesh = surface.mesh;
  if (report.degenerate_triangles > 0) {
    const std::vector<std::uint32_t> dropped =
        drop_degenerate(mesh.vertices, mesh.triangles, surface.edges);
    if (!dropped.empty()) {
      report.notes.push_back(counted(dropped.size(), "degenerate triangle") + " dropped");
      if (met && met->pairs) rename_triangles(dropped, *met->pairs);
      surface.triangles_changed();
    }
  }
  report.coincident_triangles = reduce_coincident(mesh.triangles, surface.edges);
  if (report.coincident_triangles == 0) return;
  report.notes.push_back(counted(report.coincident_triangles, "coincident triangle") +
                         " removed (copies or cancelling pairs)");
  surface.triangles_changed();
}

/// Orients the faces at every edge consistently.
void orient_faces(Surface& surface, const std::string& name, MeshReport& report) {
  TriangleMesh& mesh = surface.mesh;
  const auto corner = [&](std::uint32_t side) {
    const std::uint32_t v = mesh.triangles[side / 3][side % 3];
    return "vertex " + std::to_string(v) + " " + position_text(mesh.vertices[v]);
  };
  if (!find_unbalanced_edge(mesh.triangles, surface.edges)) return;
  report.notes.emplace_back("neighbouring faces had opposite orientations: made consistent");
  auto conflict = make_consistent(mesh.triangles, manifold_partners(surface.edges));
  if (!conflict) {
    surface.triangles_changed();
    if (!find_unbalanced_edge(mesh.triangles, surface.edges)) return;
    conflict =
        make_consistent(mesh.triangles, all_partners(mesh.vertices, mesh.triangles, surface.edges));
    if (!conflict) return surface.triangles_changed();
  }
  throw Error(name + ": not orientable: neither side of the surface is the outside (at " +
              corner(*conflict) + "). Remodel it as a closed solid");
}

void orient_outward(Surface& surface, const std::string& name, MeshReport& report) {
  TriangleMesh& mesh = surface.mesh;
  const Shells shells = find_shells(mesh.triangles, surface.edges);
  const Nesting nesting = orient_shells(mesh.vertices, mesh.triangles, shells);
  report.shells = shells.count;
  if (nesting.volume.is_flat())
    throw Error(name + ": flat: it encloses no volume. Give it thickness");
  report.volume = nesting.volume.volume;
  report.flipped_components = nesting.flipped;
  report.cavities = nesting.cavities;
  if (nesting.flipped > 0)
    report.notes.push_back(counted(nesting.flipped, "shell") + " turned outward");
  if (nesting.cavities > 0) report.notes.push_back(counted(nesting.cavities, "cavity", "cavities"));
  if (nesting.flat > 0) report.notes.push_back(counted(nesting.flat, "shell") + " without volume");
  if (nesting.nested_solids > 0)
    report.notes.push_back(
        counted(nesting.nested_solids, "outward shell") +
        " inside another: solid, not a cavity, because the winding number inside it is 1 or more");
}

/// Reports for correctly oriented shells the same as orient_outward() for others.
void keep_facing(const Surface& surface, MeshReport& report) {
  const TriangleMesh& mesh = surface.mesh;
  const Shells shells = find_shells(mesh.triangles, surface.edges);
  std::vector<double> volumes(shells.count, 0);
  const Eigen::Vector3d from = mesh.vertices[mesh.triangles[0][0]];
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) { return mesh.vertices[mesh.triangles[t][k]] - from; };
    volumes[shells.of_triangle[t]] += corner(0).dot(corner(1).cross(corner(2))) / 6;
  }
  report.shells = shells.count;
  for (const double volume : volumes) {
    report.volume += volume;
    report.cavities += volume < 0 ? 1 : 0;
  }
}

void judge_repair(const TriangleMesh& unrepaired, const TwoMeshes& both, ClosedMesh& closed) {
  const RepairQuality judged = judge(unrepaired, closed, both, kKept);
  if (judged.confidence < kLeastConfidence)
    throw OpenMeshError(closed.name + ": repaired with a confidence below " +
                        shortest(kLeastConfidence) + " (" + describe(judged) +
                        "), which is not reliable. " + kWrapIt);
  closed.report.judged = judged;
  closed.report.notes.push_back("repair: " + describe(judged));
}

enum class Facing { any, outward };

ClosedMesh close(TriangleMesh input, const std::string& name, OpenMeshPolicy policy,
                 Facing facing) {
  weld_usable(input, name);
  Surface surface{std::move(input)};
  TriangleMesh& mesh = surface.mesh;
  std::optional<SelfIntersections> met;
  const auto look_for_intersections = [&] {
    if (facing == Facing::any) met = find_self_intersections(mesh.vertices, mesh.triangles);
  };
  MeshReport report;
  tbb::parallel_invoke(look_for_intersections, [&] { report = survey(mesh, surface.edges); });
  report.notes = std::move(mesh.notes);
  report.self_intersections = met ? met->count : 0;
  report.self_intersections_counted = met.has_value();
  if (facing == Facing::any) refuse_unusable_coordinates(name, report);
  note_findings(report);
  reduce(surface, met, report);
  if (mesh.triangles.empty())
    throw Error(name +
                ": flat: every face has a second one back to back, and they enclose no volume. "
                "Give it thickness");
  TriangleMesh unrepaired;
  if (count_odd_edges(surface.edges) > 0) {
    if (policy == OpenMeshPolicy::refuse) refuse_open(mesh, surface.edges, name);
    drop_inner_walls(surface, report);
    unrepaired = mesh;
    repair(surface, name, report);
  }
  if (facing == Facing::any) {
    orient_faces(surface, name, report);
    orient_outward(surface, name, report);
  } else {
    keep_facing(surface, report);
  }
  if (report.repaired || mesh.triangles.size() != report.triangles) drop_unused(mesh);
  // Dropped degenerate triangles were never counted; other changes may add or remove intersections.
  std::optional<TwoMeshes> both;
  if (report.repaired) both.emplace(unrepaired, mesh);
  if (report.repaired && met && met->count == 0)
    met = find_self_intersections(mesh.vertices, mesh.triangles, both->shared_of_b());
  else if (report.repaired || report.coincident_triangles > 0)
    look_for_intersections();
  report.meets_itself = !met || met->count > 0;
  report.closed = true;
  ClosedMesh closed = {std::move(mesh), std::move(report), name,
                       met ? std::move(met->pairs) : std::nullopt};
  if (both) judge_repair(unrepaired, *both, closed);
  return closed;
}

}  // namespace

ClosedMesh close_mesh(TriangleMesh mesh, const std::string& name, OpenMeshPolicy policy) {
  return close(std::move(mesh), name, policy, Facing::any);
}

ClosedMesh close_oriented(TriangleMesh mesh, const std::string& name) {
  return close(std::move(mesh), name, OpenMeshPolicy::refuse, Facing::outward);
}

}  // namespace ist
