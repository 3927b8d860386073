#include "mesh/judge.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "mesh/mesh_solid.h"
#include "mesh/outward_winding.h"
#include "mesh/weld.h"
#include "mesh/winding.h"

namespace ist {
namespace {

constexpr int kOnLine = kWindingPoints;  ///< points on a line along x
constexpr std::size_t kLines = 128;      ///< whose points are summed in order, a block
constexpr std::size_t kFewest = 16;      ///< blocks of volume samples
constexpr std::size_t kMost = 512;       ///< the same, where the solid fills little of its box
constexpr double kEnough = 4096;         ///< samples in solid or winding number
constexpr std::size_t kSurface = 8192;   ///< samples of a surface

/// Part of i·step after the point: multiples of the golden ratio's kin spread evenly.
double spread(std::size_t i, double step) {
  const double x = 0.5 + static_cast<double>(i) * step;
  return x - std::floor(x);
}

/// Point i of a sequence that fills the unit cube evenly (Roberts' R₃).
Eigen::Vector3d cube_point(std::size_t i) {
  return {spread(i, 0.8191725133961645), spread(i, 0.6710436067037893),
          spread(i, 0.5497004779019703)};
}

struct VolumeSums {
  double agreed = 0, all = 0;   ///< Σ w in the solid; points there and where w ≥ ½ besides
  double solid = 0, wound = 0;  ///< points in the one, and where the other is ½ or more
};

VolumeSums operator+(const VolumeSums& a, const VolumeSums& b) {
  return {a.agreed + b.agreed, a.all + b.all, a.solid + b.solid, a.wound + b.wound};
}

/// The triangles of two meshes by the numbers of their corners, which are the same where the
/// coordinates are.
class TwoMeshes {
 public:
  using Corners = std::array<std::uint32_t, 3>;

  TwoMeshes(const TriangleMesh& a, const TriangleMesh& b) : first_of_b_(a.vertices.size()) {
    std::vector<Eigen::Vector3d> points = a.vertices;
    points.insert(points.end(), b.vertices.begin(), b.vertices.end());
    number_ = first_equal(points, std::vector<std::uint8_t>(points.size(), 1));
  }

  /// A triangle of either by those numbers, turned so that the smallest comes first.
  Corners corners(const Corners& t, const bool of_b) const {
    Corners named;
    for (std::size_t k = 0; k < 3; ++k) named[k] = number_[t[k] + (of_b ? first_of_b_ : 0)];
    std::rotate(named.begin(), std::min_element(named.begin(), named.end()), named.end());
    return named;
  }

  std::vector<Corners> sorted(const std::vector<Corners>& triangles, const bool of_b) const {
    std::vector<Corners> all(triangles.size());
    tbb::parallel_for(std::size_t{0}, all.size(),
                      [&](const std::size_t t) { all[t] = corners(triangles[t], of_b); });
    tbb::parallel_sort(all.begin(), all.end());
    return all;
  }

  /// [triangle] 1 where the other mesh has it too, whichever way it faces.
  std::vector<std::uint8_t> shared(const std::vector<Corners>& triangles, const bool of_b,
                                   const std::vector<Corners>& sorted_others) const {
    std::vector<std::uint8_t> has(triangles.size());
    tbb::parallel_for(std::size_t{0}, has.size(), [&](const std::size_t t) {
      const Corners same = corners(triangles[t], of_b), turned = {same[0], same[2], same[1]};
      has[t] = std::binary_search(sorted_others.begin(), sorted_others.end(), same) ||
               std::binary_search(sorted_others.begin(), sorted_others.end(), turned);
    });
    return has;
  }

 private:
  std::size_t first_of_b_;
  std::vector<std::uint32_t> number_;  ///< of a's and b's vertices
};

/// The triangles of `outward` less those of `made`, which is closed: where both have most in
/// common, few. Their winding number and that of `made` are the sum's. Nothing where they are many.
std::optional<TriangleMesh> difference(const TriangleMesh& outward, const TriangleMesh& made,
                                       const TwoMeshes& both,
                                       const std::vector<TwoMeshes::Corners>& of_made) {
  const std::vector<TwoMeshes::Corners> of_outward = both.sorted(outward.triangles, false);
  TriangleMesh rest;
  std::set_difference(of_made.begin(), of_made.end(), of_outward.begin(), of_outward.end(),
                      std::back_inserter(rest.triangles));
  for (auto& t : rest.triangles) std::swap(t[1], t[2]);
  std::set_difference(of_outward.begin(), of_outward.end(), of_made.begin(), of_made.end(),
                      std::back_inserter(rest.triangles));
  if (rest.triangles.size() > outward.triangles.size() / 2) return std::nullopt;
  rest.vertices = outward.vertices;
  rest.vertices.insert(rest.vertices.end(), made.vertices.begin(), made.vertices.end());
  drop_unused(rest);
  return rest;
}

/// Blocks of samples until there are enough of them in either. The winding number is that of
/// `rest`, and of the solid where `add_solid` says so.
std::vector<VolumeSums> sample_volumes(const Eigen::AlignedBox3d& bounds,
                                       const TriangleWinding& rest, const bool add_solid,
                                       const MeshSolid& made) {
  const Eigen::AlignedBox3d box = bounds.merged(made.bounds());
  const Eigen::Vector3d low = box.min(), size = box.sizes();
  std::vector<VolumeSums> blocks;
  double met = 0;
  while (blocks.size() < kMost && met < kEnough) {
    const std::size_t first = blocks.size(), last = std::max(kFewest, 2 * first);
    blocks.resize(last);
    tbb::parallel_for(first, last, [&](std::size_t b) {
      WindingPlaces x;
      std::vector<Crossing> crossings;
      for (std::size_t line = b * kLines; line < (b + 1) * kLines; ++line) {
        const Eigen::Vector3d place = cube_point(line);
        const Eigen::Vector3d start = low + size.cwiseProduct(place);
        const Eigen::Vector3d unit = made.frame().to_unit(start);
        line_crossings(made.view(), unit.y(), unit.z(), crossings);
        for (int i = 0; i < kOnLine; ++i) {
          const double along = place.x() + static_cast<double>(i) / kOnLine;
          x.row(i) = start.transpose();
          x(i, 0) = low.x() + size.x() * (along - std::floor(along));
        }
        const WindingNumbers of_rest = rest.at_each(x);
        for (int i = 0; i < kOnLine; ++i) {
          const double here = made.frame().to_unit(x.row(i).transpose()).x();
          int winding = 0;
          for (const Crossing& crossing : crossings)
            if (crossing.x <= here) winding += crossing.sign;
          const bool inside = winding >= 1;
          const double w = std::clamp(of_rest[i] + (add_solid ? winding : 0), 0.0, 1.0);
          const double s = inside ? 1 : 0, wound = w >= 0.5 ? 1 : 0;
          blocks[b] = blocks[b] + VolumeSums{s * w, std::max(s, wound), s, wound};
        }
      }
    });
    for (std::size_t b = first; b < last; ++b) met += blocks[b].all;
  }
  return blocks;
}

/// Distances from one surface, at points spread evenly over its area, to another.
struct Distances {
  double mean = 0, max = 0;  ///< [u]
  double near = 0;           ///< share of the area within `limit`
};

/// `shared`: [triangle] 1 where it is one of `to`, too.
Distances distances(const TriangleMesh& from, const std::vector<std::uint8_t>& shared,
                    const MeshSolid& to, double limit) {
  std::vector<double> area_to(from.triangles.size());  // of all triangles up to this one
  double area = 0;
  for (std::size_t t = 0; t < area_to.size(); ++t) {
    const auto& [a, b, c] = from.triangles[t];
    const Eigen::Vector3d& corner = from.vertices[a];
    area += (from.vertices[b] - corner).cross(from.vertices[c] - corner).norm() / 2;
    area_to[t] = area;
  }
  std::vector<std::array<std::size_t, 2>> apart;  // sample, triangle
  for (std::size_t i = 0, t = 0; i < kSurface; ++i) {
    const double place = (static_cast<double>(i) + 0.5) / double{kSurface} * area;
    while (t + 1 < area_to.size() && area_to[t] < place) ++t;
    if (shared[t] == 0) apart.push_back({i, t});
  }
  std::vector<double> distance(kSurface);
  tbb::parallel_for(std::size_t{0}, apart.size(), [&](std::size_t which) {
    const auto [i, t] = apart[which];
    double u = spread(i, 0.7548776662466927), v = spread(i, 0.5698402909980532);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto& [a, b, c] = from.triangles[t];
    const Eigen::Vector3d& corner = from.vertices[a];
    const Eigen::Vector3d x =
        corner + u * (from.vertices[b] - corner) + v * (from.vertices[c] - corner);
    distance[i] = to.closest_point(to.frame().to_unit(x)).distance * to.frame().scale();
  });
  Distances result;
  for (const double d : distance) {
    result.mean += d / double{kSurface};
    result.max = std::max(result.max, d);
    result.near += d <= limit ? 1 / double{kSurface} : 0;
  }
  return result;
}

}  // namespace

RepairQuality judge(const TriangleMesh& soup, const ClosedMesh& made, double kept) {
  const std::unique_ptr<MeshSolid> surface = triangles_as_solid(soup);
  const MeshSolid solid(made);
  const TwoMeshes both(soup, made.mesh);
  const std::vector<TwoMeshes::Corners> of_soup = both.sorted(soup.triangles, false),
                                        of_made = both.sorted(made.mesh.triangles, true);
  TriangleMesh outward = turned_outward(soup);
  std::optional<TriangleMesh> rest = difference(outward, made.mesh, both, of_made);
  const TriangleWinding winding(rest ? std::move(*rest) : std::move(outward));

  const std::vector<VolumeSums> blocks =
      sample_volumes(surface->bounds(), winding, rest.has_value(), solid);
  VolumeSums all;
  for (const VolumeSums& block : blocks) all = all + block;
  RepairQuality judged;
  if (all.all > 0) {
    judged.agreement = all.agreed / all.all;
    double squares = 0;
    for (const VolumeSums& block : blocks) {
      const double off = block.agreed - judged.agreement * block.all;
      squares += off * off;
    }
    judged.agreement_error = std::min(1.0, (2 * std::sqrt(squares) + 3) / all.all);
  } else {
    judged.agreement_error = 1;  // too thin for any sample
  }
  if (all.solid > 0) judged.volume_ratio = all.wound / all.solid;

  const double diagonal = surface->bounds().diagonal().norm();
  const Distances lost =
      distances(soup, both.shared(soup.triangles, false, of_made), solid, kept * diagonal);
  const Distances added = distances(made.mesh, both.shared(made.mesh.triangles, true, of_soup),
                                    *surface, kept * diagonal);
  judged.kept_surface = lost.near;
  judged.input_mean = lost.mean;
  judged.input_max = lost.max;
  judged.made_mean = added.mean;
  judged.made_max = added.max;
  judged.confidence =
      std::max(0.0, judged.agreement - judged.agreement_error) * judged.kept_surface;
  return judged;
}

std::string describe(const RepairQuality& judged) {
  char text[320];
  std::snprintf(text, sizeof text,
                "confidence %.2f: solid and winding number agree on %.1f %% (± %.1f) of the "
                "volume, and %.1f %% of the surface was kept; the input is at most %.3g from the "
                "solid's surface, and that surface at most %.3g from the input",
                judged.confidence, 100 * judged.agreement, 100 * judged.agreement_error,
                100 * judged.kept_surface, judged.input_max, judged.made_max);
  return text;
}

}  // namespace ist
