#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "mesh/connectivity/item_groups.h"
#include "mesh/geometry/exact_triangle.h"
#include "mesh/level_set/polygonise.h"

namespace ist {
namespace {

using Eigen::Vector3d;

/// Fraction of a cell's edge: bounds below it need no refinement. A refinement takes four times as
/// long, and many cells, being small, do not need it.
double near_enough(std::size_t cells_or_triangles) {
  constexpr std::size_t kMany = 100'000;
  return cells_or_triangles > kMany ? 0.25 : 0.125;
}
constexpr double kMargin = 1 + 1e-12;  // covers relative rounding
// Limits of the subdivision of triangles and cells, and of the parts of a level. More are needed
// only if the signed distance underestimates much, and would take too long.
constexpr int kTriangleDepth = 5, kCellDepth = 5;
constexpr std::size_t kMostPieces = 256, kMostParts = 4096;

double length(const Vector3d& a) { return std::sqrt(dot(a, a)); }

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double v : values) most = std::max(most, v);
  return most;
}

/// Bounds the distance of a triangle's points from the surface. Everything within |s| of a point
/// with signed distance s is on its side. So the normals through the triangle lead from a ball
/// outside to one inside, and cross the surface in between.
class TriangleError {
 public:
  TriangleError(const Solid& solid, double edge, double near, const Vector3d& normal)
      : solid_(solid), edge_(edge), near_(near), normal_(normal) {}

  double bound(const Vector3d& a, const Vector3d& b, const Vector3d& c) const {
    std::vector<Piece> open = {{a, b, c}}, next;
    double most = 0;
    for (int depth = 0; !open.empty(); ++depth) {
      const bool last = depth == kTriangleDepth || 4 * open.size() > kMostPieces;
      for (const auto& [p, q, r] : open) {
        const Vector3d middle = (p + q + r) / 3;
        const double reach =
            kMargin * std::max({length(p - middle), length(q - middle), length(r - middle)});
        const double best = between_balls(middle, reach);
        if (best <= near_) {
          most = std::max(most, best);
        } else if (last) {
          most = std::max(most, std::min(best, to_change(middle) + reach));
        } else {
          const Vector3d pq = 0.5 * p + 0.5 * q, qr = 0.5 * q + 0.5 * r, rp = 0.5 * r + 0.5 * p;
          next.insert(next.end(), {{p, pq, rp}, {pq, q, qr}, {rp, qr, r}, {pq, qr, rp}});
        }
      }
      open.swap(next);
      next.clear();
    }
    return most;
  }

 private:
  using Piece = std::array<Vector3d, 3>;

  double between_balls(const Vector3d& middle, double reach) const {
    double best = farthest();
    for (double s = 0.5 * edge_; s > 0.02 * edge_; s *= 0.25) {
      const double outside = solid_.signed_distance(middle + s * normal_);
      const double inside = -solid_.signed_distance(middle - s * normal_);
      if (!(outside > reach && inside > reach)) continue;
      const double above = s - std::sqrt(outside * outside - reach * reach);
      const double below = s - std::sqrt(inside * inside - reach * reach);
      best = std::min(best, std::max(std::abs(above), std::abs(below)));
    }
    return best;
  }

  /// A distance within which the sign changes, along the normal or across it.
  double to_change(const Vector3d& middle) const {
    const double here = solid_.signed_distance(middle);
    const auto changes = [&](const Vector3d& offset) {
      return (solid_.signed_distance(middle + offset) < 0) != (here < 0);
    };
    for (double s = std::max(kMargin * std::abs(here), 0x1p-20 * edge_); s < edge_; s *= 1.5) {
      if (changes(s * normal_) || changes(-s * normal_)) return s;
      for (int k = 0; k < 3; ++k) {
        Vector3d offset = Vector3d::Zero();
        offset[k] = s;
        if (changes(offset) || changes(-offset)) return s;
      }
      for (int i = 0; i < 8; ++i) {
        const double part = 0.5773502691896257 * s;  // of the diagonal
        if (changes({(i & 1) != 0 ? part : -part, (i & 2) != 0 ? part : -part,
                     (i & 4) != 0 ? part : -part}))
          return s;
      }
    }
    return farthest();
  }

  /// A quad lies in the four cells around an edge that the surface crosses.
  double farthest() const { return 1.7320508075688774 * edge_; }

  const Solid& solid_;
  const double edge_, near_;
  const Vector3d normal_;
};

/// Bounds the distance of the surface in a cell from some triangles.
class CellError {
 public:
  CellError(const Solid& solid, const CellGrid& grid, double near,
            std::vector<TriangleFrame<double>> triangles)
      : solid_(solid), grid_(grid), near_(near), triangles_(std::move(triangles)) {}

  /// An error bound for the cell around `middle`; infinite if it may have surface and no triangles.
  double bound(const Vector3d& middle) const {
    std::vector<Vector3d> open = {middle}, next;
    double half = 0.5 * grid_.edge, most = 0;
    for (int depth = 0; !open.empty(); ++depth, half *= 0.5) {
      const bool last = depth == kCellDepth || 8 * open.size() > kMostParts;
      const double reach = 1.7320508075688774 * half * kMargin + grid_.rounding();
      for (const Vector3d& x : open) {
        if (std::abs(solid_.signed_distance(x)) > reach) continue;
        const double best = distance(x) + reach;
        if (last || best <= near_) {
          most = std::max(most, best);
          continue;
        }
        const double h = 0.5 * half;
        for (int i = 0; i < 8; ++i)
          next.push_back(
              x + Vector3d((i & 1) != 0 ? h : -h, (i & 2) != 0 ? h : -h, (i & 4) != 0 ? h : -h));
      }
      open.swap(next);
      next.clear();
    }
    return most;
  }

 private:
  double distance(const Vector3d& x) const {
    double least = std::numeric_limits<double>::infinity();
    for (const TriangleFrame<double>& t : triangles_)
      least = std::min(least, closest_in_frame(t, x.data()).distance2);
    return std::sqrt(least) * kMargin;
  }

  const Solid& solid_;
  const CellGrid& grid_;
  const double near_;  ///< [u]
  const std::vector<TriangleFrame<double>> triangles_;
};

/// The triangles at the vertices of a cell and, if there are none or if `around`, of its
/// neighbours.
std::vector<TriangleFrame<double>> triangles_near(const std::vector<SurfaceCell>& cells,
                                                  const SurfaceCell& cell, bool around,
                                                  const ItemGroups<>& fans,
                                                  const TriangleMesh& mesh) {
  std::vector<std::uint32_t> found;
  const auto take = [&](const SurfaceCell* from) {
    if (from == nullptr) return;
    for (std::uint32_t v = from->first_vertex; v < from->first_vertex + from->loops; ++v)
      found.insert(found.end(), fans[v].begin(), fans[v].end());
  };
  take(&cell);
  if (around)
    for (int i = 0; i < 27; ++i)
      if (i != 13)
        take(cell_at(cells,
                     {cell.at[0] + i % 3 - 1, cell.at[1] + i / 3 % 3 - 1, cell.at[2] + i / 9 - 1}));
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  std::vector<TriangleFrame<double>> frames;
  for (const std::uint32_t t : found) {
    const auto& [a, b, c] = mesh.triangles[t];
    frames.push_back(make_triangle_frame(mesh.vertices[a].data(), mesh.vertices[b].data(),
                                         mesh.vertices[c].data()));
  }
  return frames;
}

double to_any_vertex(const TriangleMesh& mesh, const Vector3d& x) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3d& v : mesh.vertices) least = std::min(least, dot(v - x, v - x));
  return std::sqrt(least) * kMargin;
}

}  // namespace

double mesh_to_surface(const Solid& solid, const CellGrid& grid, const TriangleMesh& mesh) {
  std::vector<double> bounds(mesh.triangles.size());
  const double near = grid.edge * near_enough(bounds.size());
  tbb::parallel_for(std::size_t{0}, bounds.size(), [&](std::size_t t) {
    const Vector3d &a = mesh.vertices[mesh.triangles[t][0]],
                   &b = mesh.vertices[mesh.triangles[t][1]],
                   &c = mesh.vertices[mesh.triangles[t][2]];
    const Vector3d u = b - a, v = c - a;
    const Vector3d normal(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                          u[0] * v[1] - u[1] * v[0]);
    const double size = length(normal);
    const Vector3d unit = size > 0 ? Vector3d(normal / size) : Vector3d(Vector3d::UnitX());
    bounds[t] = TriangleError(solid, grid.edge, near, unit).bound(a, b, c);
  });
  return largest(bounds) + grid.rounding();
}

double surface_to_mesh(const Solid& solid, const CellGrid& grid,
                       const std::vector<SurfaceCell>& cells, const TriangleMesh& mesh) {
  const ItemGroups<> fans = triangles_at_vertices(mesh.vertices.size(), mesh.triangles);
  std::vector<double> bounds(cells.size());
  const double near = grid.edge * near_enough(bounds.size());
  tbb::parallel_for(std::size_t{0}, bounds.size(), [&](std::size_t c) {
    const SurfaceCell& cell = cells[c];
    const Vector3d middle = grid.point(cell.at[0] + 0.5, cell.at[1] + 0.5, cell.at[2] + 0.5);
    const auto bound_by = [&](bool around) {
      return CellError(solid, grid, near, triangles_near(cells, cell, around, fans, mesh))
          .bound(middle);
    };
    bounds[c] = bound_by(cell.loops == 0);
    if (bounds[c] > near && cell.loops != 0) bounds[c] = std::min(bounds[c], bound_by(true));
    if (bounds[c] > 3 * grid.edge)
      bounds[c] = to_any_vertex(mesh, middle) + grid.half_diagonal() * kMargin;
  });
  return largest(bounds) + grid.rounding();
}

}  // namespace ist
