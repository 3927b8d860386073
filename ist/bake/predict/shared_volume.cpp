#include "bake/predict/shared_volume.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/line_lattice.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kFirstLines = 128;  // on a side of the lattice
constexpr std::uint32_t kMostLines = 1024;

/// A mesh moved to where lines run along x.
class MovedMesh {
 public:
  template <class Move>
  MovedMesh(const MeshSolid& solid, const Move& move) : view_(solid.arrays()) {
    vertices_.resize(3 * std::size_t{view_.vertex_count});
    tbb::parallel_for(std::uint32_t{0}, view_.vertex_count, [&](std::uint32_t v) {
      const Vector3d x = move(Vector3d(view_.vertices + 3 * std::size_t{v}));
      for (int k = 0; k < 3; ++k)
        vertices_[3 * std::size_t{v} + static_cast<std::size_t>(k)] = x[k];
    });
    view_.vertices = vertices_.data();
    for (std::size_t v = 0; v < view_.vertex_count; ++v)
      bounds_.extend(Vector3d(vertices_.data() + 3 * v));
  }

  LatticeCrossings cross(const LineLattice& lattice) const { return cross_lattice(view_, lattice); }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  std::vector<double> vertices_;
  MeshView view_;
  Eigen::AlignedBox3d bounds_;
};

/// Length of a line inside both solids: where both winding numbers are at least 1. Behind the last
/// crossing with one of them that one's is 0.
double common_length(const LatticeCrossings& a, const LatticeCrossings& b, std::size_t line) {
  std::uint32_t i = a.first[line], j = b.first[line];
  int winding_a = 0, winding_b = 0;
  double length = 0, since = 0;
  while (i < a.first[line + 1] && j < b.first[line + 1]) {
    const bool inside = winding_a >= 1 && winding_b >= 1;
    const bool of_a = comes_before(a.crossings[i], b.crossings[j]);
    const Crossing& next = of_a ? a.crossings[i++] : b.crossings[j++];
    if (inside) length += next.x - since;
    (of_a ? winding_a : winding_b) += next.sign;
    since = next.x;
  }
  return length;
}

struct Sums {
  double volume = 0, error = 0;
  Eigen::AlignedBox2d seen;  ///< (y, z) around the lines that meet the overlap, empty if none
};

Sums integrate(const MovedMesh& a, const MovedMesh& b, const Eigen::AlignedBox2d& box,
               std::uint32_t lines) {
  LineLattice lattice;
  lattice.y0 = box.min().x();
  lattice.z0 = box.min().y();
  lattice.ny = lattice.nz = lines;
  lattice.step_y = box.sizes().x() / lines;
  lattice.step_z = box.sizes().y() / lines;
  lattice.offset = kGoldenRatio / 2;
  lattice.shift = kGoldenRatio;
  const LatticeCrossings in_a = a.cross(lattice), in_b = b.cross(lattice);
  std::vector<double> lengths(lattice.lines());
  tbb::parallel_for(std::size_t{0}, lengths.size(),
                    [&](std::size_t line) { lengths[line] = common_length(in_a, in_b, line); });

  Sums sums;
  double part[4] = {};
  for (std::uint32_t j = 0; j < lines; ++j)
    for (std::uint32_t i = 0; i < lines; ++i) {
      const double length = lengths[std::size_t{j} * lines + i];
      if (!(length > 0)) continue;
      part[2 * (j % 2) + i % 2] += length;
      const Eigen::Vector2d at(lattice.y(i, j), lattice.z(j));
      const Eigen::Vector2d step(lattice.step_y, lattice.step_z);
      sums.seen.extend(Eigen::AlignedBox2d(at - step, at + step));
    }
  const double area = lattice.step_y * lattice.step_z;
  const double mean = ((part[0] + part[1]) + (part[2] + part[3])) / 4;
  double squares = 0;
  for (const double p : part) squares += (p - mean) * (p - mean);
  // Each part is a lattice of twice the step, by chance off by about their spread; the four
  // together err less.
  sums.volume = 4 * area * mean;
  sums.error = 4 * area * std::sqrt(squares / 3);
  return sums;
}

}  // namespace

SharedVolume shared_volume(const MeshSolid& a, const MeshSolid& b, const Pose& b_in_a,
                           double scale_b, const Vector3d& along, double relative_error) {
  const double unit = a.frame().scale();
  const Vector3d axis = along.normalized();
  Eigen::Matrix3d turn;  // of lines along `along` to lines along x
  turn.row(0) = axis;
  turn.row(1) = axis.unitOrthogonal();
  turn.row(2) = axis.cross(Vector3d(turn.row(1)));
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(b_in_a.q[0], b_in_a.q[1], b_in_a.q[2], b_in_a.q[3]).toRotationMatrix();
  const Vector3d shift(b_in_a.t[0], b_in_a.t[1], b_in_a.t[2]);
  const MovedMesh moved_a(a, [&](const Vector3d& x) { return Vector3d(turn * x); });
  const MovedMesh moved_b(b, [&](const Vector3d& x) {
    const Vector3d in_a = rotation * (scale_b * b.frame().from_unit(x)) + shift;
    return Vector3d(turn * a.frame().to_unit(in_a));
  });

  const Eigen::AlignedBox3d common = moved_a.bounds().intersection(moved_b.bounds());
  SharedVolume result;
  if (common.isEmpty()) return result;
  Eigen::AlignedBox2d box(common.min().tail<2>(), common.max().tail<2>());
  for (std::uint32_t lines = kFirstLines; lines <= kMostLines;) {
    const Sums sums = integrate(moved_a, moved_b, box, lines);
    const double unit3 = unit * unit * unit;
    result = {unit3 * sums.volume, unit3 * sums.error};
    const Eigen::AlignedBox2d closer = box.intersection(sums.seen);
    constexpr double kWorthClosing = 0.6;  // of the area
    if (sums.volume > 0 && closer.volume() < kWorthClosing * box.volume()) {
      box = closer;
      continue;
    }
    if (sums.volume > 0 && result.error <= relative_error * result.volume) break;
    lines *= 2;
  }
  return result;
}

}  // namespace ist
