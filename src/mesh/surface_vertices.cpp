#include "mesh/surface_vertices.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "mesh/plane_fit.h"

namespace ist {
namespace {

using Eigen::Vector3d;

/// A cell in coordinates of its own: its middle is the origin, its edge the unit.
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

  /// Where the surface crosses an edge of two signs, by false position (the Illinois rule). The
  /// same for every cell of the edge, but for rounding.
  Vector3d crossing(int edge) const {
    const int axis = edge / 4, corner = edge_corners(edge)[0];
    const auto at = [&](double t) {
      Vector3d x;
      for (int k = 0; k < 3; ++k) x[k] = k == axis ? t : (corner >> k & 1) - 0.5;
      return x;
    };
    double low = -0.5, high = 0.5, at_low = value(at(low)), at_high = value(at(high));
    const bool low_inside = at_low > 0;
    int last = 0;
    for (int pass = 0; pass < 24 && high - low > 0x1p-24; ++pass) {
      double t = (low * at_high - high * at_low) / (at_high - at_low);
      if (!(t > low && t < high)) t = 0.5 * (low + high);
      const double now = value(at(t));
      if (std::abs(now) < 0x1p-30) return at(t);
      if ((now > 0) == low_inside) {
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

/// Off the walls of the cell: vertices of two cells are never one.
Vector3d kept_inside(Vector3d x) {
  constexpr double kReach = 0.5 - 0x1p-10;
  for (int k = 0; k < 3; ++k) x[k] = std::clamp(x[k], -kReach, kReach);
  return x;
}

double dot(const Vector3d& a, const Vector3d& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

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

}  // namespace

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

}  // namespace ist
