#include <tbb/parallel_for.h>
#include <algorithm>
#include <cmath>

#include "base/message_text.h"
#include "mesh/connectivity/edge_table.h"
#include "mesh/connectivity/usable_mesh.h"
#include "mesh/judge.h"
#include "mesh/level_set/polygonise.h"
#include "mesh/mesh_solid.h"
#include "mesh/outward_winding.h"

namespace ist {
namespace {

constexpr double kFinest = 1e-3, kCoarsest = 0.1;  ///< of the diagonal
constexpr double kBeyond =
    3.37;  ///< steps of lattice around the bounds; avoids lattice planes on faces
constexpr double kFarthest = 2;    ///< steps: values are clamped beyond
constexpr double kKeptByWrap = 2;  ///< steps: thickened walls extend about one from their middle
constexpr double kClearly = 0.75;  ///< winding number that excludes the other side of a hole
constexpr std::uint32_t kBlockSide =
    16;  ///< points along a side of a block that is decided at once

/// True if nothing one step behind either side of a triangle is clearly inside: it is a sheet, or a
/// wall that the lattice may miss. For a large triangle, true if that holds at two of four points.
bool is_thin(const TriangleMesh& mesh, const Triangle& t, const OutwardWinding& winding,
             double step) {
  const Eigen::Vector3d corners[3] = {mesh.vertices[t[0]], mesh.vertices[t[1]],
                                      mesh.vertices[t[2]]};
  const Eigen::Vector3d across = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
  const double area2 = across.norm();
  if (!(area2 > 0)) return false;
  const Eigen::Vector3d normal = step / area2 * across;
  const Eigen::Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
  const auto thin_at = [&](const Eigen::Vector3d& x) {
    return winding.at(x - normal) < kClearly && winding.at(x + normal) < kClearly;
  };
  const bool small = (corners[0] - middle).norm() < step && (corners[1] - middle).norm() < step &&
                     (corners[2] - middle).norm() < step;
  if (small) return thin_at(middle);
  int thin = thin_at(middle) ? 1 : 0;
  for (const Eigen::Vector3d& corner : corners)
    thin += thin_at(0.7 * corner + 0.3 * middle) ? 1 : 0;
  return thin >= 2;
}

/// The function that a wrap samples: > 0 in the solid.
class Wrap {
 public:
  Wrap(const TriangleMesh& mesh, double step)
      : winding_(mesh),
        surface_(triangles_as_solid(mesh)),
        bounds_(surface_->bounds()),
        step_(step) {
    std::vector<char> thin(mesh.triangles.size());
    tbb::parallel_for(std::size_t{0}, thin.size(), [&](std::size_t t) {
      thin[t] = is_thin(mesh, mesh.triangles[t], winding_, step) ? 1 : 0;
    });
    TriangleMesh walls;
    walls.vertices = mesh.vertices;
    for (std::size_t t = 0; t < thin.size(); ++t)
      if (thin[t] != 0) walls.triangles.push_back(mesh.triangles[t]);
    thin_count_ = walls.triangles.size();
    if (thin_count_ > 0) walls_ = triangles_as_solid(std::move(walls));
  }

  std::size_t thin_count() const { return thin_count_; }

  /// Away from holes this is the distance from the surface, negative inside; across a hole it is 0
  /// where the winding number is ½. Near thin walls it is at least one step minus the distance to
  /// them. The solid ends one step beyond the bounds: unoriented triangles may have winding numbers
  /// outside.
  double value(const Eigen::Vector3d& x) const {
    const double side = std::clamp(4 * (0.5 - winding_.at(x)), -1.0, 1.0);
    const double most = kFarthest * step_;
    double value = std::clamp(side * distance(*surface_, x), -most, most);
    if (walls_ && value > -step_) value = std::min(value, distance(*walls_, x, most) - step_);
    return std::max(value, std::min(most, beyond_bounds(x) - 1.5 * step_));
  }

  /// The value's sign throughout a ball, if it is known: ±1, or 0.
  ///
  /// The winding number is harmonic off the surface, so its slope is at most 3/2 of half its range
  /// over the distance from the surface; the range is assumed to be 2.
  int sign_in(const Eigen::Vector3d& centre, double radius) const {
    const double free = distance(*surface_, centre) - radius;
    if (!(free > kFarthest * step_)) return 0;
    const double above = winding_.at(centre) - 0.5;
    if (!(std::abs(above) > 1.5 * radius / free)) return 0;
    if (above < 0) return 1;
    return beyond_bounds(centre) + radius < -0.5 * step_ ? -1 : 0;
  }

 private:
  /// The largest distance along an axis by which x is outside the bounds; negative inside.
  double beyond_bounds(const Eigen::Vector3d& x) const {
    return std::max((bounds_.min() - x).maxCoeff(), (x - bounds_.max()).maxCoeff());
  }

  static double distance(const MeshSolid& to, const Eigen::Vector3d& x,
                         double limit = std::numeric_limits<double>::infinity()) {
    const double scale = to.frame().scale();
    return to.closest_point(to.frame().to_unit(x), limit / scale).distance * scale;
  }

  OutwardWinding winding_;
  std::unique_ptr<MeshSolid> surface_, walls_;
  Eigen::AlignedBox3d bounds_;
  double step_;
  std::size_t thin_count_ = 0;
};

/// Samples points of a lattice by halving blocks, down to points that must be evaluated one by one.
class Sampler {
 public:
  Sampler(const Wrap& wrap, DistanceGrid& grid) : wrap_(wrap), grid_(grid) {}

  void fill(const std::array<std::uint32_t, 3>& first, std::uint32_t size) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (first[k] >= grid_.size[k]) return;
    if (size == 1) return set(first, wrap_.value(point(first, 0)));
    const double half = 0.5 * (size - 1);
    const double radius = 0.8660254037844387 * (size - 1) * grid_.spacing * (1 + 1e-9);
    if (const int sign = wrap_.sign_in(point(first, half), radius); sign != 0)
      return set_all(first, size, sign * kFarthest * grid_.spacing);
    for (std::uint32_t child = 0; child < 8; ++child)
      fill({first[0] + (child & 1) * size / 2, first[1] + (child >> 1 & 1) * size / 2,
            first[2] + (child >> 2) * size / 2},
           size / 2);
  }

 private:
  Eigen::Vector3d point(const std::array<std::uint32_t, 3>& at, double beyond) const {
    Eigen::Vector3d x = grid_.origin;
    for (int k = 0; k < 3; ++k) x[k] += grid_.spacing * (at[static_cast<std::size_t>(k)] + beyond);
    return x;
  }
  void set(const std::array<std::uint32_t, 3>& at, double value) const {
    grid_
        .values[at[0] + std::size_t{grid_.size[0]} * (at[1] + std::size_t{grid_.size[1]} * at[2])] =
        static_cast<float>(value);
  }
  void set_all(const std::array<std::uint32_t, 3>& first, std::uint32_t size, double value) const {
    const auto end = [&](std::size_t k) { return std::min(first[k] + size, grid_.size[k]); };
    for (std::uint32_t z = first[2]; z < end(2); ++z)
      for (std::uint32_t y = first[1]; y < end(1); ++y)
        for (std::uint32_t x = first[0]; x < end(0); ++x) set({x, y, z}, value);
  }

  const Wrap& wrap_;
  DistanceGrid& grid_;
};

DistanceGrid sample(const Wrap& wrap, const Eigen::AlignedBox3d& bounds, double step) {
  DistanceGrid grid;
  grid.spacing = step;
  grid.origin = bounds.min() - Eigen::Vector3d::Constant(kBeyond * step);
  std::size_t count = 1;
  std::array<std::uint32_t, 3> blocks;
  for (std::size_t k = 0; k < 3; ++k) {
    const double extent = bounds.sizes()[static_cast<int>(k)] / step + 2 * kBeyond;
    grid.size[k] = static_cast<std::uint32_t>(std::ceil(extent)) + 1;
    blocks[k] = (grid.size[k] + kBlockSide - 1) / kBlockSide;
    count *= grid.size[k];
  }
  grid.values.resize(count);
  const Sampler sampler(wrap, grid);
  tbb::parallel_for(
      std::size_t{0}, std::size_t{blocks[0]} * blocks[1] * blocks[2], [&](std::size_t b) {
        const auto at = [&](std::size_t of) { return static_cast<std::uint32_t>(of) * kBlockSide; };
        sampler.fill(
            {at(b % blocks[0]), at(b / blocks[0] % blocks[1]), at(b / blocks[0] / blocks[1])},
            kBlockSide);
      });
  return grid;
}

}  // namespace

ClosedMesh wrap_mesh(TriangleMesh mesh, const std::string& name, double detail) {
  if (!(detail >= kFinest && detail <= kCoarsest))
    throw Error(name + ": a wrap detail of " + shortest(detail) + " is out of range; use " +
                shortest(kFinest) + " to " + shortest(kCoarsest) + " of the diagonal");
  weld_usable(mesh, name);
  const Eigen::AlignedBox3d bounds = bounds_of(mesh.vertices);
  const double step = detail * bounds.diagonal().norm();
  const double offset = largest_coordinate(bounds);
  if (!(step > 1e-12 * offset))
    throw Error(name + ": a size of " + shortest(bounds.diagonal().norm()) + " at an offset of " +
                shortest(offset) + " cannot be wrapped. Move it closer to the origin");
  const Wrap wrap(mesh, step);
  ClosedMesh made = level_set_surface(sample(wrap, bounds, step), name);
  made.report.wrapped = true;
  made.report.judged = judge(mesh, made, TwoMeshes(mesh, made.mesh), kKeptByWrap * detail);
  made.report.notes.insert(made.report.notes.begin(), mesh.notes.begin(), mesh.notes.end());
  std::string note = "wrapped on a lattice of " + shortest(step);
  if (wrap.thin_count() > 0)
    note += ", " + counted(wrap.thin_count(), "triangle") + " of thin walls thickened";
  made.report.notes.push_back(note);
  made.report.notes.push_back("wrap: " + describe(*made.report.judged));
  return made;
}

}  // namespace ist
