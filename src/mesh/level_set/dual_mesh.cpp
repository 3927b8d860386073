#include "mesh/level_set/polygonise.h"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>

#include "base/message_text.h"

namespace ist {
namespace {

/// Planes that touch a surface near a place, and the point that fits them best: on the edge or at
/// the corner where they meet, or in their middle if they are nearly one plane.
class PlaneFit {
 public:
  /// `normal`: of unit length, or zero if the surface has none.
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& normal) {
    ++count_;
    points_ += point;
    const double offset = dot(normal, point);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) square_[i][j] += normal[i] * normal[j];
      moment_[i] += normal[i] * offset;
    }
  }

  Eigen::Vector3d best() const {
    // Tikhonov's regularisation, repeated from its result: directions that the planes determine
    // well are found to many digits, the middle of the points determines the rest.
    constexpr double kRegularisation = 0.01;  // squared sine of an angle of 6 degrees
    Eigen::Vector3d x = points_ / count_;
    const double weight = kRegularisation * count_;
    for (int pass = 0; pass < 4; ++pass) x = solved(weight, x);
    return x;
  }

 private:
  /// Minimum of Σ (n·x − n·p)² + weight |x − from|², by a Cholesky factorisation.
  Eigen::Vector3d solved(double weight, const Eigen::Vector3d& from) const {
    double l[3][3] = {};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j <= i; ++j) {
        double sum = square_[i][j] + (i == j ? weight : 0.0);
        for (int k = 0; k < j; ++k) sum -= l[i][k] * l[j][k];
        l[i][j] = i == j ? std::sqrt(sum) : sum / l[j][j];
      }
    Eigen::Vector3d x;
    for (int i = 0; i < 3; ++i) {
      double sum = moment_[i] + weight * from[i];
      for (int k = 0; k < i; ++k) sum -= l[i][k] * x[k];
      x[i] = sum / l[i][i];
    }
    for (int i = 2; i >= 0; --i) {
      for (int k = i + 1; k < 3; ++k) x[i] -= l[k][i] * x[k];
      x[i] /= l[i][i];
    }
    return x;
  }

  double count_ = 0;
  Eigen::Vector3d points_ = Eigen::Vector3d::Zero();
  double square_[3][3] = {};
  Eigen::Vector3d moment_ = Eigen::Vector3d::Zero();
};

using Eigen::Vector3d;

/// A cell in its own coordinates: its middle is the origin, its edge the unit.
class CellField {
 public:
  CellField(const Solid& solid, const CellGrid& grid, const SurfaceCell& cell)
      : solid_(solid), grid_(grid), cell_(cell) {}

  Vector3d world(const Vector3d& x) const {
    return grid_.point(cell_.at[0] + 0.5 + x[0], cell_.at[1] + 0.5 + x[1],
                       cell_.at[2] + 0.5 + x[2]);
  }
  double value(const Vector3d& x) const { return solid_.signed_distance(world(x)) / grid_.edge; }

  Vector3d gradient(const Vector3d& x) const {
    constexpr double kStep = 0x1p-10;
    Vector3d g;
    for (int k = 0; k < 3; ++k) {
      Vector3d e = Vector3d::Zero();
      e[k] = kStep;
      g[k] = (value(x + e) - value(x - e)) / (2 * kStep);
    }
    return g;
  }

  /// The point where the surface crosses an edge with two signs, by false position (the Illinois
  /// rule). The same for every cell at the edge, except for rounding.
  Vector3d crossing(int edge) const {
    const int axis = edge / 4, corner = edge_corners(edge)[0];
    const auto at = [&](double t) {
      Vector3d x;
      for (int k = 0; k < 3; ++k) x[k] = k == axis ? t : (corner >> k & 1) - 0.5;
      return x;
    };
    double low = -0.5, high = 0.5, at_low = value(at(low)), at_high = value(at(high));
    const bool low_inside = at_low < 0;
    int last = 0;
    for (int pass = 0; pass < 24 && high - low > 0x1p-24; ++pass) {
      double t = (low * at_high - high * at_low) / (at_high - at_low);
      if (!(t > low && t < high)) t = 0.5 * (low + high);
      const double now = value(at(t));
      if (std::abs(now) < 0x1p-30) return at(t);
      if ((now < 0) == low_inside) {
        low = t;
        at_low = now;
        if (last == 1) at_high *= 0.5;
        last = 1;
      } else {
        high = t;
        at_high = now;
        if (last == 2) at_low *= 0.5;
        last = 2;
      }
    }
    return at(0.5 * (low + high));
  }

 private:
  const Solid& solid_;
  const CellGrid& grid_;
  const SurfaceCell& cell_;
};

/// Keeps a vertex off the walls of its cell, so that vertices of two cells never coincide.
Vector3d kept_inside(Vector3d x) {
  constexpr double kReach = 0.5 - 0x1p-10;
  for (int k = 0; k < 3; ++k) x[k] = std::clamp(x[k], -kReach, kReach);
  return x;
}

Vector3d vertex_of(const CellField& field, const SurfaceCell& cell, int loop) {
  PlaneFit planes;
  for (int e = 0; e < 12; ++e) {
    if (!cell.crosses(e) || cell.loop_of[static_cast<std::size_t>(e)] != loop) continue;
    const Vector3d p = field.crossing(e), g = field.gradient(p);
    const double length = std::sqrt(dot(g, g));
    planes.add(p, length > 0 ? Vector3d(g / length) : Vector3d(Vector3d::Zero()));
  }
  Vector3d x = kept_inside(planes.best());
  double value = field.value(x);
  for (int pass = 0; pass < 3 && std::abs(value) > 0x1p-20; ++pass) {
    const Vector3d g = field.gradient(x);
    const double slope = dot(g, g);
    if (!(slope > 0.01)) break;
    const Vector3d nearer = kept_inside(x - value / slope * g);
    const double there = field.value(nearer);
    if (!(std::abs(there) < std::abs(value))) break;
    x = nearer;
    value = there;
  }
  return x;
}

/// The vertices of all cells' loops, [u]: each within its cell, off its walls, at the intersection
/// of the surface's tangent planes at the loop's edges, or on the surface if these are nearly one
/// plane. Sets first_vertex.
std::vector<Vector3d> place_vertices(const Solid& solid, const CellGrid& grid,
                                     std::vector<SurfaceCell>& cells) {
  std::uint32_t count = 0;
  for (SurfaceCell& cell : cells) {
    cell.first_vertex = count;
    count += cell.loops;
  }
  std::vector<Vector3d> vertices(count);
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t c) {
    const CellField field(solid, grid, cells[c]);
    for (int loop = 0; loop < cells[c].loops; ++loop)
      vertices[cells[c].first_vertex + static_cast<std::size_t>(loop)] =
          field.world(vertex_of(field, cells[c], loop));
  });
  return vertices;
}

using Quad = std::array<std::uint32_t, 4>;  ///< counter-clockwise seen from outside

[[noreturn]] void refuse_gap(const CellGrid& grid, const std::array<std::int32_t, 3>& at) {
  bool border = false;
  for (std::size_t k = 0; k < 3; ++k) border |= at[k] <= 0 || at[k] + 1 >= grid.count[k];
  const std::string place = position_text(grid.point(at[0], at[1], at[2]));
  if (border)
    throw Error("solid: it extends beyond its bounds near " + place + ". Enlarge the bounds");
  throw Error("solid: its signed distance is not 1-Lipschitz near " + place +
              ". Divide it by its largest slope");
}

/// The quad across an edge with two signs, by the vertices of the four cells around it.
Quad quad_across(const std::vector<SurfaceCell>& cells, const CellGrid& grid,
                 const SurfaceCell& owner, int axis) {
  const auto b = static_cast<std::size_t>((axis + 1) % 3),
             c = static_cast<std::size_t>((axis + 2) % 3);
  // Counter-clockwise about the axis; the edge is at the far end of a preceding cell.
  constexpr int kBefore[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
  Quad quad{};
  for (std::size_t i = 0; i < 4; ++i) {
    std::array<std::int32_t, 3> at = owner.at;
    at[b] -= kBefore[i][0];
    at[c] -= kBefore[i][1];
    const SurfaceCell* const cell = cell_at(cells, at);
    const int edge = 4 * axis + kBefore[i][0] + 2 * kBefore[i][1];
    if (cell == nullptr || !cell->crosses(edge)) refuse_gap(grid, owner.at);
    quad[i] = cell->first_vertex + cell->loop_of[static_cast<std::size_t>(edge)];
  }
  if ((owner.inside & 1) == 0) std::swap(quad[1], quad[3]);
  return quad;
}

std::vector<Quad> all_quads(const std::vector<SurfaceCell>& cells, const CellGrid& grid) {
  std::vector<Quad> quads;
  for (const SurfaceCell& cell : cells) {
    if (cell.loops == 0) continue;
    // Edges at the lower corner belong to this cell; no edge with two signs is on the grid's
    // border.
    for (int axis = 0; axis < 3; ++axis)
      if (cell.crosses(4 * axis)) quads.push_back(quad_across(cells, grid, cell, axis));
    for (std::size_t k = 0; k < 3; ++k)
      for (int i = 0; i < 8; ++i)
        if (cell.at[k] + 1 == grid.count[k] && (i >> k & 1) != 0 && (cell.inside >> i & 1) != 0)
          refuse_gap(grid, cell.at);
  }
  return quads;
}

/// Splits each quad into two triangles, by the diagonal whose middle is nearer to the surface.
std::vector<std::array<std::uint32_t, 3>> split(const Solid& solid, const std::vector<Quad>& quads,
                                                const std::vector<Eigen::Vector3d>& vertices) {
  std::vector<std::array<std::uint32_t, 3>> triangles(2 * quads.size());
  tbb::parallel_for(std::size_t{0}, quads.size(), [&](std::size_t q) {
    const Quad& v = quads[q];
    const auto off = [&](std::size_t i, std::size_t j) {
      return std::abs(solid.signed_distance(0.5 * vertices[v[i]] + 0.5 * vertices[v[j]]));
    };
    const std::size_t from = off(0, 2) <= off(1, 3) ? 0 : 1;
    triangles[2 * q] = {v[from], v[from + 1], v[from + 2]};
    triangles[2 * q + 1] = {v[from], v[from + 2], v[(from + 3) % 4]};
  });
  return triangles;
}

}  // namespace

TriangleMesh dual_surface(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell>& cells,
                          Stage& stage) {
  TriangleMesh mesh;
  mesh.vertices = place_vertices(solid, grid, cells);
  stage.step(0, 0.4);
  mesh.triangles = split(solid, all_quads(cells, grid), mesh.vertices);
  stage.step(0, 0.5);
  return mesh;
}

Polygonised dual_mesh(const Solid& solid, const CellGrid& grid, std::vector<SurfaceCell> cells,
                      Stage& stage) {
  Polygonised result = {dual_surface(solid, grid, cells, stage)};
  result.error = std::max(mesh_to_surface(solid, grid, result.mesh),
                          surface_to_mesh(solid, grid, cells, result.mesh));
  stage.step(0, 1);
  return result;
}

Polygonised polygonise(const Solid& solid, unsigned cells, const ProgressCallback& progress) {
  if (cells < kFewestCells || cells > kMostCells)
    throw Error("polygonise: " + std::to_string(cells) + " cells requested; the number must be " +
                std::to_string(kFewestCells) + " to " + std::to_string(kMostCells));
  Stage stage("polygonise", progress);
  stage.step(0, 0);
  const CellGrid grid = grid_around(solid, cells);
  std::vector<SurfaceCell> listed = find_surface_cells(
      solid, grid, [&](int level, int levels) { stage.step(0, 0.2 * level / levels); });
  const bool seen = std::any_of(listed.begin(), listed.end(),
                                [](const SurfaceCell& cell) { return cell.loops > 0; });
  if (!seen)
    throw Error(
        "solid: a grid of " + std::to_string(cells) +
        " cells along the longest side does not resolve it. Use more cells, or tighter bounds");
  return dual_mesh(solid, grid, std::move(listed), stage);
}

}  // namespace ist
