#include "mesh/outward_winding.h"

#include <ist/solid.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/shells.h"
#include "mesh/connectivity/surface_reduction.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/geometry/closest_point.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/hierarchy/line_lattice.h"

namespace ist {
namespace {

constexpr double kFar = 3;  ///< distance of a group that is expanded, over its radius

/// Lines of sight along each side of a view: some eight for the smallest patch, but at most two for
/// each of many equal triangles.
std::uint32_t lines_to_see(const TriangleMesh& soup, DisjointSets& patches) {
  std::vector<double> area(soup.triangles.size(), 0);
  double all = 0, least = HUGE_VAL;
  for (std::uint32_t t = 0; t < area.size(); ++t) {
    const auto& [a, b, c] = soup.triangles[t];
    const Eigen::Vector3d& p = soup.vertices[a];
    const double size = (soup.vertices[b] - p).cross(soup.vertices[c] - p).norm();
    area[patches.find(t)] += size;
    all += size;
  }
  for (const double size : area)
    if (size > 0) least = std::min(least, size);
  const double most = 2 * std::sqrt(static_cast<double>(area.size()));
  return static_cast<std::uint32_t>(
      std::clamp(std::min(most, 4 * std::sqrt(all) / std::sqrt(least)), 64.0, 200.0));
}

/// The first triangle along a line, seen from one of its ends.
struct Seen {
  double x = std::numeric_limits<double>::infinity();  ///< distance along the line
  std::uint32_t triangle = kNoIndex;
  bool front = false;

  void offer(const Seen& other) {
    if (other.x < x) *this = other;
  }
};

/// Lines of sight that end on a patch.
struct Votes {
  std::int64_t fronts = 0, backs = 0;
};

/// Adds what is visible of each patch along one axis, which comes first in `points` (unit frame).
void look_along(const std::vector<std::array<double, 3>>& points,
                const std::vector<Triangle>& triangles, std::uint32_t lines, DisjointSets& patches,
                std::vector<Votes>& votes) {
  LineLattice lattice;
  lattice.y0 = lattice.z0 = -1;
  lattice.ny = lattice.nz = lines;
  lattice.step_y = lattice.step_z = 2.0 / lattice.ny;
  lattice.offset = kGoldenRatio;
  std::vector<Seen> low(lattice.lines()), high(lattice.lines());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const auto corner = [&](std::size_t k) { return points[triangles[t][k]].data(); };
    const Corners corners = {{corner(0), corner(1), corner(2)}};
    const LatticeRange rows = rows_of(lattice, corners);
    for (std::uint32_t j = rows.first; j < rows.last; ++j)
      for_row(lattice, corners, j, [&](std::size_t line, const Crossing& crossing) {
        low[line].offer({crossing.x, t, crossing.sign > 0});
        high[line].offer({-crossing.x, t, crossing.sign < 0});
      });
  }
  for (const std::vector<Seen>* const end : {&low, &high})
    for (const Seen& seen : *end)
      if (seen.triangle != kNoIndex) {
        Votes& patch = votes[patches.find(seen.triangle)];
        ++(seen.front ? patch.fronts : patch.backs);
      }
}

std::vector<Eigen::Vector3d> unit_vertices(const TriangleMesh& soup) {
  const UnitFrame frame = unit_frame(bounds_of(soup.vertices, soup.triangles));
  const double scale = frame.scale();
  std::vector<Eigen::Vector3d> unit(soup.vertices.size());
  for (std::size_t v = 0; v < unit.size(); ++v) unit[v] = (soup.vertices[v] - frame.centre) / scale;
  return unit;
}

/// Counts how often distant viewers along the three axes see each patch.
std::vector<Votes> look(const TriangleMesh& soup, DisjointSets& patches,
                        const std::vector<Eigen::Vector3d>& unit) {
  const std::uint32_t lines = lines_to_see(soup, patches);
  std::array<std::vector<Votes>, 3> along;
  tbb::parallel_for(0, 3, [&](int axis) {
    std::vector<std::array<double, 3>> points(soup.vertices.size());
    for (std::size_t v = 0; v < points.size(); ++v) {
      const Eigen::Vector3d& x = unit[v];
      points[v] = {x[axis], x[(axis + 1) % 3], x[(axis + 2) % 3]};
    }
    std::vector<Votes>& votes = along[static_cast<std::size_t>(axis)];
    votes.resize(soup.triangles.size());
    look_along(points, soup.triangles, lines, patches, votes);
  });
  std::vector<Votes>& votes = along[0];
  for (const std::size_t axis : {1, 2})
    for (std::size_t t = 0; t < votes.size(); ++t) {
      votes[t].fronts += along[axis][t].fronts;
      votes[t].backs += along[axis][t].backs;
    }
  return std::move(votes);
}

/// For each patch, the volume between it and the middle of its area: > 0 if it bulges to its front.
/// 0 if only rounding is left, as of a flat one.
std::vector<double> bulges(const TriangleMesh& soup, DisjointSets& patches,
                           const std::vector<Eigen::Vector3d>& unit) {
  struct Sum {
    double area = 0, volume = 0, magnitude = 0;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  };
  std::vector<Sum> sums(soup.triangles.size());
  const auto corner = [&](std::uint32_t t, std::size_t k) -> const Eigen::Vector3d& {
    return unit[soup.triangles[t][k]];
  };
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    const Eigen::Vector3d &a = corner(t, 0), &b = corner(t, 1), &c = corner(t, 2);
    const double area = (b - a).cross(c - a).norm();
    Sum& sum = sums[patches.find(t)];
    sum.area += area;
    sum.middle += area / 3 * (a + b + c);
  }
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    Sum& sum = sums[patches.find(t)];
    if (!(sum.area > 0)) continue;
    const Eigen::Vector3d middle = sum.middle / sum.area;
    const Eigen::Vector3d a = corner(t, 0) - middle, b = corner(t, 1) - middle,
                          c = corner(t, 2) - middle;
    const double volume = a.dot(b.cross(c));
    sum.volume += volume;
    sum.magnitude += a.norm() * b.cross(c).norm();
  }
  constexpr double kRounding = 1e-9;
  std::vector<double> result(sums.size());
  for (std::size_t p = 0; p < sums.size(); ++p)
    result[p] = std::abs(sums[p].volume) > kRounding * sums[p].magnitude ? sums[p].volume : 0;
  return result;
}

/// Flips the triangles of a soup so that as many as possible face outward. Neighbours across edges
/// of two triangles are made consistent, as far as the surface is orientable. A connected patch is
/// then flipped if distant viewers along the three axes see its back at least twice as often as its
/// front. If neither prevails, as for a bowl, the front is the convex side. Invisible patches
/// follow the majority: they stay as authored unless most of the visible surface was flipped.
/// Independent of the number of threads.
void orient_soup(TriangleMesh& soup, const EdgeTable& edges) {
  make_consistent(soup.triangles, manifold_partners(edges));
  DisjointSets patches = connected_pieces(edges, 2);
  const std::vector<Eigen::Vector3d> unit = unit_vertices(soup);
  const std::vector<Votes> votes = look(soup, patches, unit);
  const std::vector<double> bulge = bulges(soup, patches, unit);
  // Lines that see more of a patch's front than of its back, or its bulge.
  const auto in_favour = [&](std::uint32_t patch) {
    const auto [fronts, backs] = votes[patch];
    if (fronts > 2 * backs || backs > 2 * fronts || bulge[patch] == 0) return fronts - backs;
    return bulge[patch] > 0 ? fronts + backs : -(fronts + backs);
  };
  std::int64_t majority = 0;
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t)
    if (patches.find(t) == t) majority += in_favour(t);
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t) {
    const std::int64_t favour = in_favour(patches.find(t));
    if (favour < 0 || (favour == 0 && majority < 0))
      std::swap(soup.triangles[t][1], soup.triangles[t][2]);
  }
}

}  // namespace

double SoupWinding::at(const Eigen::Vector3d& x) const {
  return at_each(WindingPlaces(x.transpose().replicate<kWindingPoints, 1>()))[0];
}

WindingNumbers SoupWinding::at_each(const WindingPlaces& x) const {
  WindingNumbers numbers;
  double points[3][kWindingPoints];
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < x.rows(); ++i) points[k][i] = x(i, k);
  wind_about(mesh_, of_children_.data(), points, numbers.data());
  return numbers;
}

SoupWinding::SoupWinding(const MeshView& mesh) : mesh_(mesh) {
  if (mesh.root == kBvhEmpty || (mesh.root & kBvhLeaf) != 0) return;
  BvhNode around = {};
  far_of(mesh.root, around, 0);
}

FarTriangles SoupWinding::far_of_block(std::uint32_t block) const {
  FarTriangles far;
  double centroid[kBvhWidth][3], normal[kBvhWidth][3];
  int count = 0;
  for (const std::uint32_t triangle : mesh_.blocks[block].triangle) {
    if (triangle == kNoTriangle) continue;
    const Corners t = corners_of(mesh_, triangle);
    area_normal(t.p[0], t.p[1], t.p[2], normal[count]);
    double squares = 0;
    for (int k = 0; k < 3; ++k) {
      centroid[count][k] = (t.p[0][k] + t.p[1][k] + t.p[2][k]) / 3;
      normal[count][k] /= 2;
      squares += normal[count][k] * normal[count][k];
    }
    const double area = std::sqrt(squares);
    far.area += area;
    for (int k = 0; k < 3; ++k) far.centre[k] += area * centroid[count][k];
    ++count;
  }
  for (double& x : far.centre) x = far.area > 0 ? x / far.area : 0;
  for (int t = 0; t < count; ++t)
    for (int i = 0; i < 3; ++i) {
      far.dipole[i] += normal[t][i];
      for (int j = 0; j < 3; ++j)
        far.second[3 * i + j] += normal[t][i] * (centroid[t][j] - far.centre[j]);
    }
  return far;
}

/// `place`: the child's index in `parent`, whose box bounds it.
FarTriangles SoupWinding::far_of(std::uint32_t child, const BvhNode& parent, int place) {
  FarTriangles far;
  if ((child & kBvhLeaf) != 0) {
    far = far_of_block(child & ~kBvhLeaf);
  } else {
    const BvhNode& node = mesh_.nodes[child];
    FarChildren below;
    for (int i = 0; i < kBvhWidth; ++i) {
      if (node.child[i] == kBvhEmpty) continue;
      const FarTriangles& part = below[static_cast<std::size_t>(i)] =
          far_of(node.child[i], node, i);
      far.area += part.area;
      for (int k = 0; k < 3; ++k) far.centre[k] += part.area * part.centre[k];
    }
    for (double& x : far.centre) x = far.area > 0 ? x / far.area : 0;
    for (const FarTriangles& part : below)
      for (int i = 0; i < 3; ++i) {
        far.dipole[i] += part.dipole[i];
        for (int j = 0; j < 3; ++j)
          far.second[3 * i + j] +=
              part.second[3 * i + j] + part.dipole[i] * (part.centre[j] - far.centre[j]);
      }
    if (of_children_.size() <= child) of_children_.resize(child + 1);
    of_children_[child] = below;
  }
  double squares = 0;
  for (int k = 0; k < 3; ++k) {
    const double reach = std::max(far.centre[k] - double{parent.lower[k][place]},
                                  double{parent.upper[k][place]} - far.centre[k]);
    squares += reach * reach;
  }
  far.reach2 = kFar * kFar * squares;
  return far;
}

std::unique_ptr<MeshSolid> triangles_as_solid(TriangleMesh mesh) {
  ClosedMesh surface;
  surface.mesh = std::move(mesh);
  surface.name = "triangles";
  return std::make_unique<MeshSolid>(surface);
}

std::vector<bool> inner_walls(const TriangleMesh& soup, DisjointSets& patches,
                              const std::vector<bool>& asked) {
  constexpr double kSolid = 0.75;
  const std::vector<Votes> votes = look(soup, patches, unit_vertices(soup));
  std::vector<bool> inner(soup.triangles.size(), false);
  TriangleMesh rest = {soup.vertices, {}, {}};
  for (std::uint32_t t = 0; t < inner.size(); ++t) {
    const std::uint32_t patch = patches.find(t);
    inner[t] = asked[patch] && votes[patch].fronts + votes[patch].backs == 0;
    if (!inner[t]) rest.triangles.push_back(soup.triangles[t]);
  }
  if (rest.triangles.size() == inner.size()) return inner;
  const OutwardWinding winding(std::move(rest));
  std::vector<double> area(inner.size(), 0), solid(inner.size(), 0);  // by patch
  for (std::uint32_t t = 0; t < inner.size(); ++t) {
    if (!inner[t]) continue;
    const auto& [a, b, c] = soup.triangles[t];
    const Eigen::Vector3d &p = soup.vertices[a], &q = soup.vertices[b], &r = soup.vertices[c];
    const double size = (q - p).cross(r - p).norm();
    area[patches.find(t)] += size;
    if (winding.at((p + q + r) / 3) > kSolid) solid[patches.find(t)] += size;
  }
  for (std::uint32_t t = 0; t < inner.size(); ++t) {
    const std::uint32_t patch = patches.find(t);
    inner[t] = inner[t] && solid[patch] > kSolid * area[patch];
  }
  return inner;
}

TriangleMesh turned_outward(TriangleMesh mesh) {
  EdgeTable edges(mesh.triangles);
  if (reduce_coincident(mesh.triangles, edges) > 0) edges = EdgeTable(mesh.triangles);
  if (!mesh.triangles.empty()) orient_soup(mesh, edges);
  return mesh;
}

TriangleWinding::TriangleWinding(TriangleMesh mesh) {
  if (mesh.triangles.empty()) return;
  bounds_ = bounds_of(mesh.vertices, mesh.triangles);
  double area = 0;
  for (const Triangle& t : mesh.triangles) area += area_of(mesh.vertices, t);
  constexpr double kRounding = 1.01;
  least_distance2_ = kRounding * area / (2 * std::numbers::pi);
  surface_ = triangles_as_solid(std::move(mesh));
  winding_.emplace(surface_->view());
}

WindingNumbers TriangleWinding::at_each(const WindingPlaces& x) const {
  if (!winding_) return WindingNumbers::Zero();
  const UnitFrame& frame = surface_->frame();
  return winding_->at_each((x.rowwise() - frame.centre.transpose()) / frame.scale());
}

}  // namespace ist
