#include <ist/solid.h>
#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/level_set/polygonise.h"

namespace ist {
namespace {

constexpr std::uint32_t kMostPoints = 1u << 20;                ///< along an axis: Morton codes
constexpr std::uint64_t kMostValues = std::uint64_t{1} << 31;  ///< 8 GiB of floats

using CellValues = std::array<double, 8>;

/// Points of a grid, and cells between them.
class Lattice {
 public:
  explicit Lattice(const DistanceGrid& grid) : grid_(grid) {}

  std::int32_t cells(std::size_t axis) const {
    return static_cast<std::int32_t>(grid_.size[axis]) - 1;
  }
  CellValues values(std::int32_t i, std::int32_t j, std::int32_t k) const {
    CellValues v{};
    for (std::size_t c = 0; c < 8; ++c)
      v[c] = at(i + static_cast<std::int32_t>(c & 1), j + static_cast<std::int32_t>(c >> 1 & 1),
                k + static_cast<std::int32_t>(c >> 2));
    return v;
  }
  float at(std::int32_t i, std::int32_t j, std::int32_t k) const {
    const auto x = static_cast<std::size_t>(i), y = static_cast<std::size_t>(j),
               z = static_cast<std::size_t>(k);
    return grid_.values[x + grid_.size[0] * (y + std::size_t{grid_.size[1]} * z)];
  }

 private:
  const DistanceGrid& grid_;
};

/// Steepest slope of the interpolation in a cell, times the spacing. The square of each partial
/// derivative is convex along every axis, so a corner has the largest.
double steepest(const CellValues& v) {
  double most = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    const double x = v[c | 1] - v[c & 6], y = v[c | 2] - v[c & 5], z = v[c | 4] - v[c & 3];
    most = std::max(most, x * x + y * y + z * z);
  }
  return std::sqrt(most);
}

/// The cells of a layer that have points of both signs.
std::vector<SurfaceCell> crossed_cells(const Lattice& lattice, std::int32_t k) {
  std::vector<SurfaceCell> cells;
  for (std::int32_t j = 0; j < lattice.cells(1); ++j)
    for (std::int32_t i = 0; i < lattice.cells(0); ++i) {
      const CellValues v = lattice.values(i, j, k);
      SurfaceCell cell;
      for (std::size_t c = 0; c < 8; ++c)
        if (v[c] < 0) cell.inside = static_cast<std::uint8_t>(cell.inside | 1u << c);
      if (cell.inside == 0 || cell.inside == 255) continue;
      cell.at = {i, j, k};
      cell.key = morton_code(cell.at);
      find_loops(cell);
      cells.push_back(cell);
    }
  return cells;
}

/// Steepest slope within two cells of any of `cells`, times the spacing: proofs look no further.
double steepest_near(const Lattice& lattice, const std::vector<SurfaceCell>& cells) {
  constexpr std::int32_t kReach = 2;
  std::vector<double> slopes(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(), [&](std::size_t c) {
    std::int32_t from[3], to[3];
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = std::max(0, cells[c].at[k] - kReach);
      to[k] = std::min(lattice.cells(k) - 1, cells[c].at[k] + kReach);
    }
    for (std::int32_t z = from[2]; z <= to[2]; ++z)
      for (std::int32_t y = from[1]; y <= to[1]; ++y)
        for (std::int32_t x = from[0]; x <= to[0]; ++x)
          slopes[c] = std::max(slopes[c], steepest(lattice.values(x, y, z)));
  });
  return *std::max_element(slopes.begin(), slopes.end());
}

/// The interpolation over its steepest slope: 1-Lipschitz near the surface. Constant beyond the
/// lattice.
class Interpolation final : public Solid {
 public:
  Interpolation(const Lattice& lattice, const CellGrid& grid, double steepest)
      : lattice_(lattice), grid_(grid), factor_(steepest > 0 ? grid.edge / steepest : 1) {}

  double signed_distance(const Eigen::Vector3d& x) const override {
    std::int32_t cell[3];
    double part[3];
    for (int a = 0; a < 3; ++a) {
      const double u = (x[a] - grid_.low[a]) / grid_.edge;
      const std::int32_t last = lattice_.cells(static_cast<std::size_t>(a)) - 1;
      cell[a] = static_cast<std::int32_t>(std::clamp(std::floor(u), 0.0, double(last)));
      part[a] = std::clamp(u - cell[a], 0.0, 1.0);
    }
    const CellValues v = lattice_.values(cell[0], cell[1], cell[2]);
    const auto between = [](double a, double b, double t) { return (1 - t) * a + t * b; };
    double rows[4];
    for (std::size_t r = 0; r < 4; ++r) rows[r] = between(v[2 * r], v[2 * r + 1], part[0]);
    return factor_ *
           between(between(rows[0], rows[1], part[1]), between(rows[2], rows[3], part[1]), part[2]);
  }
  Eigen::AlignedBox3d bounds() const override {
    return {grid_.low, grid_.point(grid_.count[0], grid_.count[1], grid_.count[2])};
  }
  double volume() const override { return 0; }  // unused: the mesh has one

 private:
  const Lattice& lattice_;
  CellGrid grid_;
  double factor_;
};

std::string point_text(std::uint64_t index, const DistanceGrid& grid) {
  const std::uint64_t x = index % grid.size[0], y = index / grid.size[0] % grid.size[1],
                      z = index / grid.size[0] / grid.size[1];
  return "point (" + std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + ")";
}

void require_usable(const DistanceGrid& grid, const std::string& name) {
  std::uint64_t count = 1;
  for (const std::uint32_t n : grid.size) {
    if (n < 2 || n > kMostPoints)
      throw Error(name + ": a grid of " + std::to_string(n) +
                  " points along an axis; the number must be 2 to " + std::to_string(kMostPoints));
    count *= n;
    if (count > kMostValues)
      throw Error(name + ": a grid of more than 2^31 points. Resample it with larger cells");
  }
  if (grid.values.size() != count)
    throw Error(name + ": a grid of " + std::to_string(count) + " points has " +
                std::to_string(grid.values.size()) + " values");
  if (!(grid.spacing > 0) || !std::isfinite(grid.spacing) || !grid.origin.allFinite())
    throw Error(name + ": the grid's spacing must be > 0, and it and the origin finite");
  bool any = false;
  for (std::uint64_t i = 0; i < count; ++i) {
    const float value = grid.values[i];
    if (!std::isfinite(value))
      throw Error(name + ": the value of " + point_text(i, grid) + " is not finite");
    if (!(value < 0)) continue;
    any = true;
    const std::uint64_t at[3] = {i % grid.size[0], i / grid.size[0] % grid.size[1],
                                 i / grid.size[0] / grid.size[1]};
    for (std::size_t k = 0; k < 3; ++k)
      if (at[k] == 0 || at[k] + 1 == grid.size[k])
        throw Error(name + ": the solid touches the grid's border at " + point_text(i, grid) +
                    ". Add a layer of outside points to the grid");
  }
  if (!any) throw Error(name + ": no point of the grid is inside the solid");
}

/// The cells of a grid that the surface crosses, and their solid.
struct Crossed {
  const Lattice lattice;
  const CellGrid grid;
  std::vector<SurfaceCell> cells;
  const Interpolation solid;

  explicit Crossed(const DistanceGrid& distances)
      : lattice(distances),
        grid(grid_of(distances, lattice)),
        cells(crossed(lattice, grid)),
        solid(lattice, grid, steepest_near(lattice, cells)) {}

 private:
  static CellGrid grid_of(const DistanceGrid& distances, const Lattice& lattice) {
    CellGrid grid;
    grid.low = distances.origin;
    grid.edge = distances.spacing;
    for (std::size_t k = 0; k < 3; ++k) grid.count[k] = lattice.cells(k);
    return grid;
  }
  /// Returns them sorted by key.
  static std::vector<SurfaceCell> crossed(const Lattice& lattice, const CellGrid& grid) {
    std::vector<std::vector<SurfaceCell>> layers(static_cast<std::size_t>(grid.count[2]));
    tbb::parallel_for(std::size_t{0}, layers.size(), [&](std::size_t k) {
      layers[k] = crossed_cells(lattice, static_cast<std::int32_t>(k));
    });
    std::vector<SurfaceCell> cells;
    for (std::vector<SurfaceCell>& layer : layers) {
      cells.insert(cells.end(), layer.begin(), layer.end());
      layer.clear();
    }
    std::sort(cells.begin(), cells.end(),
              [](const SurfaceCell& a, const SurfaceCell& b) { return a.key < b.key; });
    return cells;
  }
};

}  // namespace

LevelSetMesh mesh_level_set(const DistanceGrid& distances, const std::string& name,
                            const ProgressCallback& progress) {
  require_usable(distances, name);
  Stage stage("polygonise", progress);
  stage.step(0, 0);
  Crossed at(distances);
  Polygonised made = dual_mesh(at.solid, at.grid, std::move(at.cells), stage);
  return {close_mesh(std::move(made.mesh), name), made.error};
}

ClosedMesh level_set_surface(const DistanceGrid& distances, const std::string& name) {
  require_usable(distances, name);
  Stage stage("polygonise", {});
  Crossed at(distances);
  return close_mesh(dual_surface(at.solid, at.grid, at.cells, stage), name);
}

std::unique_ptr<Solid> make_grid_solid(const DistanceGrid& grid) {
  return make_solid(mesh_level_set(grid, "distance grid").mesh);
}

std::unique_ptr<Solid> load_vdb_solid(const std::string& path) {
  return make_solid(load_vdb(path).mesh);
}

}  // namespace ist
