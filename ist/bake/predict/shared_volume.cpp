#include "bake/predict/shared_volume.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "mesh/line_lattice.h"

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kFirstLines = 128;  // on a side of the lattice
constexpr std::uint32_t kMostLines = 1024;
constexpr std::uint32_t kBandRows = 128;  // cut at once: a tenth of a second at most, even (parts)
constexpr double kRoom = 1e-9;            // around boxes that cull, unit frame: far above rounding

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

  /// Forgets the triangles that lines in `box` (y, z) do not cross before x_end.
  void keep(const Eigen::AlignedBox2d& box, double x_end) {
    kept_ = triangles_at(box, x_end);
    view_.triangles = kept_.data();
    view_.triangle_count = static_cast<std::uint32_t>(kept_.size() / 3);
  }

  /// Crossings with a lattice in that box.
  LatticeCrossings cross(const LineLattice& lattice) const { return cross_lattice(view_, lattice); }

  /// The same of a lattice that fills but a part of it.
  LatticeCrossings cross(const LineLattice& lattice, const Eigen::AlignedBox2d& part,
                         double x_end) const {
    const std::vector<std::uint32_t> triangles = triangles_at(part, x_end);
    MeshView view = view_;
    view.triangles = triangles.data();
    view.triangle_count = static_cast<std::uint32_t>(triangles.size() / 3);
    return cross_lattice(view, lattice);
  }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  /// Corners of the triangles that lines in the box may cross before x_end.
  std::vector<std::uint32_t> triangles_at(const Eigen::AlignedBox2d& box, double x_end) const {
    std::vector<std::uint32_t> found;
    for (std::size_t t = 0; t < view_.triangle_count; ++t) {
      const std::uint32_t* const corners = view_.triangles + 3 * t;
      const double* const p[3] = {vertices_.data() + 3 * std::size_t{corners[0]},
                                  vertices_.data() + 3 * std::size_t{corners[1]},
                                  vertices_.data() + 3 * std::size_t{corners[2]}};
      const auto low = [&](int k) { return std::min({p[0][k], p[1][k], p[2][k]}) - kRoom; };
      const auto high = [&](int k) { return std::max({p[0][k], p[1][k], p[2][k]}) + kRoom; };
      if (low(0) > x_end || low(1) > box.max().x() || high(1) < box.min().x() ||
          low(2) > box.max().y() || high(2) < box.min().y())
        continue;
      found.insert(found.end(), corners, corners + 3);
    }
    return found;
  }

  std::vector<double> vertices_;
  std::vector<std::uint32_t> kept_;
  MeshView view_;
  Eigen::AlignedBox3d bounds_;
};

/// A convex body where lines run along x.
class MovedConvex {
 public:
  explicit MovedConvex(const ConvexBody& body) : body_(body), bounds_(body.bounds()) {}

  void keep(const Eigen::AlignedBox2d&, double) {}
  LatticeCrossings cross(const LineLattice& lattice) const {
    LatticeCrossings result;
    result.first.push_back(0);
    for (std::uint32_t j = 0; j < lattice.nz; ++j)
      for (std::uint32_t i = 0; i < lattice.ny; ++i) {
        const Vector3d on_line(0, lattice.y(i, j), lattice.z(j));
        if (const auto part = body_.part_of(on_line, Vector3d::UnitX())) {
          result.crossings.push_back({part->from, 1});
          result.crossings.push_back({part->to, -1});
        }
        result.first.push_back(static_cast<std::uint32_t>(result.crossings.size()));
      }
    return result;
  }
  LatticeCrossings cross(const LineLattice& lattice, const Eigen::AlignedBox2d&, double) const {
    return cross(lattice);
  }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  ConvexBody body_;
  Eigen::AlignedBox3d bounds_;
};

/// Length of a line inside both solids: where both winding numbers are at least 1.
double common_length(const LatticeCrossings& a, const LatticeCrossings& b, std::size_t line) {
  std::uint32_t i = a.first[line], j = b.first[line];
  const std::uint32_t end_a = a.first[line + 1], end_b = b.first[line + 1];
  if (i == end_a || j == end_b) return 0;
  int winding_a = 0, winding_b = 0;
  double length = 0, since = 0;
  while (i < end_a || j < end_b) {
    const bool inside = winding_a >= 1 && winding_b >= 1;
    const bool of_a = j == end_b || (i < end_a && comes_before(a.crossings[i], b.crossings[j]));
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

/// Two solids where lines run along x, and what they have in common.
template <class MovedB>
class Pair {
 public:
  Pair(MovedMesh a, MovedB b, const std::function<bool()>& go_on)
      : a_(std::move(a)),
        b_(std::move(b)),
        common_(a_.bounds().intersection(b_.bounds())),
        go_on_(go_on) {}

  const Eigen::AlignedBox3d& common() const { return common_; }

  /// Each box must lie in the one before. None: it is not to go on.
  std::optional<Sums> integrate(const Eigen::AlignedBox2d& box, std::uint32_t lines) {
    a_.keep(box, common_.max().x());
    b_.keep(box, common_.max().x());
    LineLattice lattice;
    lattice.y0 = box.min().x();
    lattice.ny = lines;
    lattice.step_y = box.sizes().x() / lines;
    lattice.step_z = box.sizes().y() / lines;
    lattice.offset = kGoldenRatio / 2;
    lattice.shift = kGoldenRatio;
    Sums sums;
    double part[4] = {};
    for (std::uint32_t row = 0; row < lines; row += kBandRows) {
      lattice.z0 = box.min().y() + row * lattice.step_z;
      lattice.nz = std::min(kBandRows, lines - row);
      if (!add_band(lattice, box, part, sums.seen)) return std::nullopt;
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

 private:
  /// Adds the lengths of a band's lines to the four parts; false: it is not to go on.
  bool add_band(const LineLattice& lattice, const Eigen::AlignedBox2d& box, double* part,
                Eigen::AlignedBox2d& seen) const {
    Eigen::AlignedBox2d band = box;
    band.min().y() = lattice.z0;
    band.max().y() = lattice.z0 + lattice.nz * lattice.step_z;
    const auto crossings = [&](const auto& mesh) {
      return lattice.nz == lattice.ny ? mesh.cross(lattice)
                                      : mesh.cross(lattice, band, common_.max().x());
    };
    if (go_on_ && !go_on_()) return false;
    const LatticeCrossings in_a = crossings(a_);
    if (go_on_ && !go_on_()) return false;
    const LatticeCrossings in_b = crossings(b_);
    std::vector<double> lengths(lattice.lines());
    tbb::parallel_for(std::size_t{0}, lengths.size(),
                      [&](std::size_t line) { lengths[line] = common_length(in_a, in_b, line); });
    for (std::uint32_t j = 0; j < lattice.nz; ++j)
      for (std::uint32_t i = 0; i < lattice.ny; ++i) {
        const double length = lengths[std::size_t{j} * lattice.ny + i];
        if (!(length > 0)) continue;
        part[2 * (j % 2) + i % 2] += length;
        const Eigen::Vector2d at(lattice.y(i, j), lattice.z(j));
        const Eigen::Vector2d step(lattice.step_y, lattice.step_z);
        seen.extend(Eigen::AlignedBox2d(at - step, at + step));
      }
    return true;
  }

  MovedMesh a_;
  MovedB b_;
  const Eigen::AlignedBox3d common_;
  const std::function<bool()>& go_on_;
};

/// Of lines along `along` to lines along x.
Eigen::Matrix3d turn_of(const Vector3d& along) {
  const Vector3d axis = along.normalized();
  Eigen::Matrix3d turn;
  turn.row(0) = axis;
  turn.row(1) = axis.unitOrthogonal();
  turn.row(2) = axis.cross(Vector3d(turn.row(1)));
  return turn;
}

MovedMesh turned(const MeshSolid& solid, const Eigen::Matrix3d& turn) {
  return MovedMesh(solid, [&](const Vector3d& x) { return Vector3d(turn * x); });
}

/// Closes in on the overlap and refines, as shared_volume() says; `unit`: [u] of the unit frame.
template <class MovedB>
SharedVolume integrate(Pair<MovedB> pair, double unit, double relative_error) {
  const Eigen::AlignedBox3d& common = pair.common();
  SharedVolume result;
  if (common.isEmpty()) return result;
  Eigen::AlignedBox2d box(common.min().tail<2>(), common.max().tail<2>());
  for (std::uint32_t lines = kFirstLines; lines <= kMostLines;) {
    const std::optional<Sums> found = pair.integrate(box, lines);
    if (!found) return {};
    const Sums& sums = *found;
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

}  // namespace

SharedVolume shared_volume(const MeshSolid& a, const MeshSolid& b, const Pose& b_in_a,
                           double scale_b, const Vector3d& along, double relative_error,
                           const std::function<bool()>& go_on) {
  const Eigen::Matrix3d turn = turn_of(along);
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(b_in_a.q[0], b_in_a.q[1], b_in_a.q[2], b_in_a.q[3]).toRotationMatrix();
  const Vector3d shift(b_in_a.t[0], b_in_a.t[1], b_in_a.t[2]);
  MovedMesh moved_b(b, [&](const Vector3d& x) {
    const Vector3d in_a = rotation * (scale_b * b.frame().from_unit(x)) + shift;
    return Vector3d(turn * a.frame().to_unit(in_a));
  });
  return integrate(Pair(turned(a, turn), std::move(moved_b), go_on), a.frame().scale(),
                   relative_error);
}

SharedVolume shared_volume(const MeshSolid& a, const ConvexBody& b, const Vector3d& along,
                           double relative_error, const std::function<bool()>& go_on) {
  const Eigen::Matrix3d turn = turn_of(along);
  return integrate(Pair(turned(a, turn), MovedConvex(b.to_unit(a.frame()).turned(turn)), go_on),
                   a.frame().scale(), relative_error);
}

}  // namespace ist
