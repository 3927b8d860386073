#include "mesh/resolve/resolve.h"

#include <tbb/task_arena.h>
#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/message_text.h"
#include "base/stage.h"
#include "base/thread_arena.h"
#include "mesh/connectivity/disjoint_sets.h"
#include "mesh/connectivity/self_intersections.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/triangle_columns.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/connectivity/weld.h"
#include "mesh/resolve/arrangement.h"
#include "mesh/resolve/exact_points.h"
#include "mesh/resolve/press.h"

namespace ist {
namespace {

constexpr double kPatches = 0.1;  // approximate share of the whole work

class Rays {
 public:
  Rays(const std::vector<Triangle>& triangles, const Arrangement& arrangement)
      : triangles_(triangles), arrangement_(arrangement), points_(arrangement.points) {}

  /// The winding number in front of a piece, by an axis-parallel line that meets no edge.
  int in_front(std::uint32_t piece) {
    const Triangle& corners = arrangement_.pieces[piece];
    const Eigen::Vector3d a = points_.rounded(corners[0]);
    int axis = 0;
    (points_.rounded(corners[1]) - a)
        .cross(points_.rounded(corners[2]) - a)
        .cwiseAbs()
        .maxCoeff(&axis);
    int facing = 0;
    for (int tried = 0; facing == 0; ++tried, axis = (axis + 1) % 3) {
      if (tried == 3) throw Unresolvable{"a piece of a triangle is degenerate"};
      facing = points_.turn(axis, corners[0], corners[1], corners[2]);
      if (facing != 0) break;
    }
    std::uint32_t random = 1;
    for (int tried = 0; tried < 100; ++tried) {
      const ExactPoint inside = point_within(corners, random);
      const RoundedPoint rounded = points_.round(inside);
      if (const auto winding = count({&rounded, &inside}, piece, axis, facing)) return *winding;
    }
    throw Unresolvable{"every ray through a piece of a triangle hits an edge"};
  }

 private:
  ExactPoint point_within(const Triangle& corners, std::uint32_t& random) const {
    std::array<ExactPoint, 3> p;
    for (std::size_t k = 0; k < 3; ++k) p[k] = points_.exact(corners[k]);
    ExactPoint sum = {{0, 0, 0}, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      random = random * 1664525 + 1013904223;
      const Whole weight = 256 + (random >> 23);
      sum.w += weight;
      const Whole others = weight * p[(k + 1) % 3].w * p[(k + 2) % 3].w;
      for (std::size_t i = 0; i < 3; ++i) sum.x[i] += others * p[k].x[i];
    }
    sum.w *= p[0].w * p[1].w * p[2].w;
    return sum;
  }

  /// Nothing if the line meets an edge.
  std::optional<int> count(const PointView& from, std::uint32_t piece, int axis, int facing) {
    const std::uint32_t own = arrangement_.plane[arrangement_.source[piece]];
    int winding = 0;
    for (const std::uint32_t t : columns(axis).about(from.rounded->at)) {
      if (arrangement_.plane[t] == own) continue;
      const Triangle& corner = triangles_[t];
      int turns[3] = {0, 0, 0};
      bool left = false, right = false;
      for (std::size_t k = 0; k < 3 && !(left && right); ++k) {
        turns[k] =
            points_.turn(axis, points_.view(corner[k]), points_.view(corner[(k + 1) % 3]), from);
        left |= turns[k] > 0;
        right |= turns[k] < 0;
      }
      if (left && right) continue;
      if (turns[0] == 0 || turns[1] == 0 || turns[2] == 0) {
        if (points_.turn(axis, corner[0], corner[1], corner[2]) == 0) continue;
        return std::nullopt;
      }
      const int side = points_.side(corner, from), out = turns[0] * facing;
      if (side * out < 0) winding += out;  // a triangle in the piece's own plane has side 0
    }
    return winding;
  }

  const TriangleColumns& columns(int axis) {
    const auto k = static_cast<std::size_t>(axis);
    std::call_once(made_[k], [&] {
      columns_[k].emplace(triangles_, axis, [&](std::uint32_t v) { return points_.rounded(v); });
    });
    return *columns_[k];
  }

  const std::vector<Triangle>& triangles_;
  const Arrangement& arrangement_;
  const ExactPoints& points_;
  std::array<std::once_flag, 3> made_;
  std::array<std::optional<TriangleColumns>, 3> columns_;
};

/// Connected pieces that nothing else meets in between: the winding numbers on their two sides are
/// constant.
struct Patches {
  std::vector<std::uint32_t> of_piece;
  std::vector<int> in_front;  ///< [patch] the winding number there
};

/// Exact. Runs on the caller's TBB threads; the answer does not depend on their number. Throws
/// Unresolvable, and as `work` does.
Patches find_patches(const std::vector<Triangle>& triangles, const Arrangement& arrangement,
                     WatchedWork& work) {
  const std::vector<Triangle>& pieces = arrangement.pieces;
  const EdgeTable edges(pieces);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    int balance = 0;
    for (const std::uint32_t side : edges.sides(e))
      balance += (runs_up(pieces, side) ? 1 : -1) * arrangement.winding_step[side / 3];
    if (balance != 0) throw Unresolvable{"the pieces of the surface do not form a closed surface"};
  }
  DisjointSets sets = connected_pieces(edges, 2);
  Patches patches;
  patches.of_piece.resize(pieces.size());
  std::vector<std::uint32_t> largest;  // [patch] a piece
  std::vector<double> size;
  for (std::uint32_t p = 0; p < pieces.size(); ++p) {
    const Eigen::Vector3d& a = arrangement.points.rounded(pieces[p][0]);
    const double area = (arrangement.points.rounded(pieces[p][1]) - a)
                            .cross(arrangement.points.rounded(pieces[p][2]) - a)
                            .squaredNorm();
    const std::uint32_t first = sets.find(p);  // the smallest
    if (first == p) {
      patches.of_piece[p] = static_cast<std::uint32_t>(largest.size());
      largest.push_back(p);
      size.push_back(area);
      continue;
    }
    const std::uint32_t patch = patches.of_piece[p] = patches.of_piece[first];
    if (area > size[patch]) {
      largest[patch] = p;
      size[patch] = area;
    }
  }
  patches.in_front.resize(largest.size());
  Rays rays(triangles, arrangement);
  work.for_each(largest.size(), kPatches, [&](std::size_t patch) {
    patches.in_front[patch] = rays.in_front(largest[patch]);
  });
  return patches;
}

using Pairs = std::vector<std::array<std::uint32_t, 2>>;
using How = Resolution::How;

constexpr std::size_t kMostResolvedPairs = 2'000'000;

const Pairs& pairs_of(ClosedMesh& closed) {
  if (!closed.meeting_pairs) {
    auto met = find_self_intersections(closed.mesh.vertices, closed.mesh.triangles);
    if (met) closed.meeting_pairs = std::move(met->pairs);
  }
  if (!closed.meeting_pairs || closed.meeting_pairs->size() > kMostResolvedPairs)
    throw Unresolvable{"too many triangles or intersecting pairs"};
  return *closed.meeting_pairs;
}

/// Six times the volume of the tetrahedron of a triangle and a point.
double volume_of(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                 const Eigen::Vector3d& from) {
  return (a - from).dot((b - from).cross(c - from));
}

/// Volume, and the sum of its terms' magnitudes.
struct Volume {
  double sum = 0, size = 0, area = 0;

  Volume(const TriangleMesh& mesh, const Eigen::Vector3d& from) {
    for (const Triangle& t : mesh.triangles) {
      const auto &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
      const double part = volume_of(a, b, c, from) / 6;
      sum += part;
      size += std::abs(part);
      area += (b - a).cross(c - a).norm() / 2;
    }
  }
};

/// Numbers the triangles of a mesh; those connected by edges or meetings have the same number.
std::vector<std::uint32_t> groups_of(const std::vector<Triangle>& triangles, const Pairs& pairs) {
  DisjointSets sets = connected_pieces(EdgeTable(triangles));
  for (const auto& [a, b] : pairs) sets.unite(a, b);
  std::vector<std::uint32_t> groups(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) groups[t] = sets.find(t);
  return groups;
}

/// Rounds to multiples of a power of two.
Eigen::Vector3d snapped(const Eigen::Vector3d& p, double step) {
  return (p / step).array().rint() * step;
}

/// Drops pieces of a closed surface that are thinner than rounding: gaps between faces with common
/// corners, and remainders of pressing.
void drop_flat_pieces(TriangleMesh& mesh, double thinnest, const Eigen::Vector3d& from) {
  const SidePartners partners =
      nearest_partners(mesh.vertices, mesh.triangles, EdgeTable(mesh.triangles));
  DisjointSets pieces(mesh.triangles.size());
  for (std::uint32_t side = 0; side < partners.size(); ++side)
    if (partners[side] != kNoIndex) pieces.unite(side / 3, partners[side] / 3);
  std::vector<double> volume(mesh.triangles.size(), 0), area(mesh.triangles.size(), 0);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) { return mesh.vertices[mesh.triangles[t][k]]; };
    volume[pieces.find(t)] += volume_of(corner(0), corner(1), corner(2), from) / 6;
    area[pieces.find(t)] += (corner(1) - corner(0)).cross(corner(2) - corner(0)).norm() / 2;
  }
  std::vector<Triangle> kept;
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t piece = pieces.find(t);
    if (std::abs(volume[piece]) > thinnest * area[piece]) kept.push_back(mesh.triangles[t]);
  }
  if (!kept.empty()) mesh.triangles = std::move(kept);
}

class Resolver {
 public:
  /// `closed`: with pressed vertices, if any.
  Resolver(const ClosedMesh& as_it_came, const Pressed& pressed, ClosedMesh& closed,
           WatchedWork& work)
      : closed_(as_it_came),
        pressed_(pressed),
        vertices_(pressed.moved > 0 ? pressed.mesh.vertices : closed.mesh.vertices),
        triangles_(closed.mesh.triangles),
        pairs_(pairs_of(closed)),
        arrangement_(arrange(closed.mesh.vertices, triangles_, pairs_, work)),
        patches_(find_patches(triangles_, arrangement_, work)) {
    if (triangles_.empty()) throw Unresolvable{"the mesh has no triangles"};
    from_ = closed.mesh.vertices[triangles_[0][0]];
  }

  /// The resolved surface; nothing if the mesh needs no change.
  std::optional<TriangleMesh> surface(Resolution& resolution) const {
    std::vector<bool> changed(triangles_.size(), false);  // by group
    const std::vector<std::uint32_t> groups = groups_of(triangles_, pairs_);
    const auto group_of_piece = [&](std::size_t p) { return groups[arrangement_.source[p]]; };
    bool any = false;
    for (std::size_t p = 0; p < arrangement_.pieces.size(); ++p) {
      const int front = in_front(p), back = behind(p);
      if (front == 0 && back == 1) continue;
      any = changed[group_of_piece(p)] = true;
      const double volume = volume_of(p) / 6;
      resolution.counted_twice += (std::max(back - 1, 0) - std::max(front - 1, 0)) * volume;
      resolution.counted_against += (std::max(-back, 0) - std::max(-front, 0)) * volume;
    }
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
      if (std::binary_search(arrangement_.walls.begin(), arrangement_.walls.end(),
                             arrangement_.plane[t]))
        any = changed[groups[t]] = true;
    // Points that differ by less become one vertex, near the origin too.
    const double step = spacing_at(largest_coordinate(bounds_of(vertices_)));
    TriangleMesh made;
    if (!any && pressed_.moved == 0) {
      made = closed_.mesh;
      drop_flat_pieces(made, kNearSteps * step, from_);
      if (made.triangles.size() == triangles_.size()) return std::nullopt;
      return made;
    }
    for (std::uint32_t v = 0; v < arrangement_.points.size(); ++v)
      made.vertices.push_back(arrangement_.points.is_given(v)
                                  ? vertices_[v]
                                  : snapped(arrangement_.points.rounded(v), step));
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (!changed[groups[t]]) made.triangles.push_back(triangles_[t]);
    std::vector<bool> used(made.vertices.size(), false);
    for (std::size_t p = 0; p < arrangement_.pieces.size(); ++p) {
      if (!changed[group_of_piece(p)] || in_front(p) > 0 || behind(p) < 1) continue;
      made.triangles.push_back(arrangement_.pieces[p]);
      for (const std::uint32_t v : arrangement_.pieces[p]) {
        used[v] = true;
        if (!arrangement_.points.is_given(v)) resolution.moved = 1.7321 * step;  // √3
      }
    }
    if (made.triangles.empty()) throw Unresolvable{"the winding number is nowhere 1 or more"};
    if (pressed_.moved > 0) {
      resolution.moved += pressed_.moved + pressed_.apart;
      made = weld_among(made, pressed_.apart, used);
      std::erase_if(made.triangles, has_repeated_corner);
    }
    drop_flat_pieces(made, kNearSteps * step, from_);
    return made;
  }

  /// Closes the surface and compares its volume with that of the mesh.
  ClosedMesh close(TriangleMesh surface, Resolution& resolution) const {
    ClosedMesh result = close_oriented(std::move(surface), closed_.name);
    if (find_unbalanced_edge(result.mesh.triangles, EdgeTable(result.mesh.triangles)))
      throw Unresolvable{"the resolved surface is not closed"};
    const Volume before(closed_.mesh, from_), after(result.mesh, from_);
    const double expected = before.sum - resolution.counted_twice + resolution.counted_against;
    const double off = std::abs(after.sum - expected);
    const double rounding = 2 * resolution.moved * after.area;
    if (!(off <= rounding + 1e-12 * (before.size + after.size)))
      throw Unresolvable{"the volume of the resolved surface is " + shortest(after.sum) + ", not " +
                         shortest(expected)};
    for (double* const counted : {&resolution.counted_twice, &resolution.counted_against})
      if (*counted <= rounding + 1e-15 * before.size) *counted = 0;  // negative values too
    MeshReport& report = result.report;
    report.filled_holes = closed_.report.filled_holes;
    report.repaired = closed_.report.repaired;
    report.wrapped = closed_.report.wrapped;
    report.judged = closed_.report.judged;
    report.notes = closed_.report.notes;
    return result;
  }

 private:
  int in_front(std::size_t piece) const { return patches_.in_front[patches_.of_piece[piece]]; }
  int behind(std::size_t piece) const { return in_front(piece) + arrangement_.winding_step[piece]; }
  double volume_of(std::size_t piece) const {
    const Triangle& t = arrangement_.pieces[piece];
    const ExactPoints& points = arrangement_.points;
    return ist::volume_of(points.rounded(t[0]), points.rounded(t[1]), points.rounded(t[2]), from_);
  }

  const ClosedMesh& closed_;
  const Pressed& pressed_;
  const std::vector<Eigen::Vector3d>& vertices_;  ///< before pressing
  const std::vector<Triangle>& triangles_;
  const Pairs& pairs_;
  Arrangement arrangement_;
  Patches patches_;
  Eigen::Vector3d from_;
};

std::string percent(double part, double of) {
  return shortest(std::round(part / of * 1e6) / 1e4) + " %";
}

std::string describe(const Resolution& resolution, double volume) {
  if (resolution.counted_twice == 0 && resolution.counted_against == 0)
    return "parts of the mesh touch: the walls between them are no boundary and were removed";
  std::string text = "parts of the mesh overlap: " + percent(resolution.counted_twice, volume) +
                     " of the solid's volume was counted twice and is now counted once";
  if (resolution.counted_against > 0)
    text += "; inside-out regions of " + percent(resolution.counted_against, volume) +
            " are now outside";
  return text;
}

ResolvedMesh as_it_is(ClosedMesh closed) {
  return {std::move(closed), {How::as_it_is, 0, 0, 0, "no volume is counted twice"}};
}

ResolvedMesh resolve_watched(ClosedMesh closed, WatchedWork& work) {
  ResolvedMesh result{std::move(closed), {}};
  try {
    Resolution resolution;
    resolution.how = How::resolved;
    const Pressed pressed = press_together(result.mesh.mesh);
    ClosedMesh moved;
    if (pressed.moved > 0) moved.mesh = {pressed.vertices, pressed.mesh.triangles, {}};
    const Resolver resolver(result.mesh, pressed, pressed.moved > 0 ? moved : result.mesh, work);
    auto surface = resolver.surface(resolution);
    if (!surface) return as_it_is(std::move(result.mesh));
    ClosedMesh made = resolver.close(std::move(*surface), resolution);
    resolution.reason = describe(resolution, made.report.volume);
    made.report.notes.push_back(resolution.reason);
    return {std::move(made), std::move(resolution)};
  } catch (const Unresolvable& failure) {
    result.resolution = {How::unresolved, 0, 0, 0, failure.reason};
  } catch (const Error& failure) {
    result.resolution = {How::unresolved, 0, 0, 0, failure.what()};
  }
  return result;
}

}  // namespace

ResolvedMesh resolve(ClosedMesh closed, const ProgressCallback& progress) {
  // Requires a single shell without self-intersections. (Touching faces belong to several shells,
  // share edges, or were merged.)
  const MeshReport& report = closed.report;
  if (closed.meeting_pairs && closed.meeting_pairs->empty() && report.shells == 1 &&
      report.nonmanifold_edges == 0 && report.coincident_triangles == 0)
    return as_it_is(std::move(closed));
  WatchedWork work;
  if (!progress) return resolve_watched(std::move(closed), work);
  Stage stage("resolve", progress);
  stage.step(0, 0);
  const auto threads = static_cast<unsigned>(tbb::this_task_arena::max_concurrency());
  auto made = do_aside(threads, [&] { return resolve_watched(std::move(closed), work); });
  try {
    wait_for(made, [&] { stage.step(0, work.done()); });
    stage.step(0, 1);
  } catch (...) {
    work.stop();
    throw;
  }
  return made.get();
}

}  // namespace ist
