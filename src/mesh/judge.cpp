#include "mesh/judge.h"

#include <cmath>
#include <cstdio>
#include <iterator>

#include "mesh/connectivity/usable_mesh.h"
#include "mesh/hierarchy/winding.h"
#include "mesh/mesh_solid.h"
#include "mesh/outward_winding.h"

namespace ist {
namespace {

constexpr int kOnLine = kWindingPoints;   ///< points on a line along x
constexpr std::size_t kLines = 128;       ///< a block sums the points of this many lines in order
constexpr std::size_t kFewest = 16;       ///< blocks of volume samples
constexpr std::size_t kMostBlocks = 512;  ///< the same, if the solid fills little of its box
constexpr double kEnough = 4096;          ///< samples in solid or winding number
constexpr std::size_t kSurface = 8192;    ///< samples of a surface

/// Fractional part of i·step: multiples of an irrational step are a low-discrepancy sequence.
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
  double agreed = 0, all = 0;   ///< Σ w in the solid; points in either set
  double solid = 0, wound = 0;  ///< points in the solid; points with w ≥ ½
};

VolumeSums operator+(const VolumeSums& a, const VolumeSums& b) {
  return {a.agreed + b.agreed, a.all + b.all, a.solid + b.solid, a.wound + b.wound};
}

/// The triangles of `outward` without those of `made`, which is closed: few if both have most in
/// common. Their winding number plus that of `made` is that of `outward`. Nothing if they are many.
std::optional<TriangleMesh> difference(const TriangleMesh& outward, const TriangleMesh& made,
                                       const TwoMeshes& both) {
  const std::vector<Triangle> of_outward = both.sorted(outward.triangles, false);
  const std::vector<Triangle>& of_made = both.of_b();
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

/// Samples blocks until there are enough points in either set. The winding number is that of
/// `rest`, plus the solid's if `add_solid`.
std::vector<VolumeSums> sample_volumes(const Eigen::AlignedBox3d& bounds,
                                       const TriangleWinding& rest, bool add_solid,
                                       const MeshSolid& made) {
  const Eigen::AlignedBox3d box = bounds.merged(made.bounds());
  const Eigen::Vector3d low = box.min(), size = box.sizes();
  const Eigen::Vector3d& centre = made.frame().centre;
  const double scale = made.frame().scale();
  const auto start_of = [&](std::size_t line) -> Eigen::Vector3d {
    return low + size.cwiseProduct(cube_point(line));
  };
  std::vector<VolumeSums> blocks;
  double met = 0;
  while (blocks.size() < kMostBlocks && met < kEnough) {
    const std::size_t first = blocks.size(), last = std::max(kFewest, 2 * first);
    blocks.resize(last);
    std::vector<std::array<double, 2>> lines((last - first) * kLines);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const Eigen::Vector3d unit = made.frame().to_unit(start_of(first * kLines + i));
      lines[i] = {unit.y(), unit.z()};
    }
    const auto crossings = line_crossings(made.arrays(), lines);
    tbb::parallel_for(first, last, [&](std::size_t b) {
      WindingPlaces x = WindingPlaces::Zero();
      std::array<int, kWindingPoints> solid{};  // winding numbers
      std::size_t count = 0;
      const auto add = [&] {
        const WindingNumbers of_rest = rest.at_each(x);
        for (std::size_t i = 0; i < count; ++i) {
          const double w =
              std::clamp(of_rest[Eigen::Index(i)] + (add_solid ? solid[i] : 0), 0.0, 1.0);
          const double s = solid[i] >= 1 ? 1 : 0, wound = w >= 0.5 ? 1 : 0;
          blocks[b] = blocks[b] + VolumeSums{s * w, std::max(s, wound), s, wound};
        }
        count = 0;
      };
      for (std::size_t line = b * kLines; line < (b + 1) * kLines; ++line) {
        const double begin = cube_point(line).x();
        Eigen::Vector3d place = start_of(line);
        for (int i = 0; i < kOnLine; ++i) {
          const double along = begin + static_cast<double>(i) / kOnLine;
          place.x() = low.x() + size.x() * (along - std::floor(along));
          const double here = (place.x() - centre.x()) / scale;
          int winding = 0;
          for (const Crossing& crossing : crossings[line - first * kLines])
            if (crossing.x <= here) winding += crossing.sign;
          if (winding < 1 && rest.surely_less_than_half(place)) continue;  // adds nothing
          x.row(Eigen::Index(count)) = place.transpose();
          solid[count] = winding;
          if (++count == kWindingPoints) add();
        }
      }
      if (count > 0) add();
    });
    for (std::size_t b = first; b < last; ++b) met += blocks[b].all;
  }
  return blocks;
}

/// Distances from points spread evenly over a surface to another surface.
struct Distances {
  double mean = 0, max = 0;  ///< [u]
  double near = 0;           ///< share of the area within `limit`
};

/// The part of `mesh` that contains the closest points of some places. reach[i]: the distance from
/// places[i] to a corner of one of its triangles, or infinity.
std::unique_ptr<MeshSolid> part_near(const TriangleMesh& mesh,
                                     const std::vector<Eigen::Vector3d>& places,
                                     const std::vector<double>& reach) {
  constexpr double kRounding = 1 + 1e-9;
  Eigen::AlignedBox3d about;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Eigen::Vector3d off = Eigen::Vector3d::Constant(kRounding * reach[i]);
    about.extend(places[i] - off);
    about.extend(places[i] + off);
  }
  TriangleMesh part{mesh.vertices, {}, {}};
  std::ranges::copy_if(mesh.triangles, std::back_inserter(part.triangles), [&](const Triangle& t) {
    return bounds_of(mesh.vertices, t).intersects(about);
  });
  drop_unused(part);
  return triangles_as_solid(std::move(part));
}

/// `shared`, `corners`: [triangle, vertex of `from`] 1 if `to` has it too.
Distances distances(const TriangleMesh& from, const std::vector<std::uint8_t>& shared,
                    const std::vector<std::uint8_t>& corners, const TriangleMesh& to,
                    double limit) {
  std::vector<double> area_to(from.triangles.size());  // of all triangles up to this one
  double area = 0;
  for (std::size_t t = 0; t < area_to.size(); ++t) {
    area += area_of(from.vertices, from.triangles[t]);
    area_to[t] = area;
  }
  std::vector<std::size_t> apart;       // samples on triangles that `to` lacks
  std::vector<Eigen::Vector3d> places;  // their positions
  std::vector<double> reach;            // their distances to a corner that `to` has
  for (std::size_t i = 0, t = 0; i < kSurface; ++i) {
    const double place = (static_cast<double>(i) + 0.5) / double{kSurface} * area;
    while (t + 1 < area_to.size() && area_to[t] < place) ++t;
    if (shared[t] != 0) continue;
    double u = spread(i, 0.7548776662466927), v = spread(i, 0.5698402909980532);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    const auto& [a, b, c] = from.triangles[t];
    const Eigen::Vector3d& corner = from.vertices[a];
    apart.push_back(i);
    places.emplace_back(corner + u * (from.vertices[b] - corner) + v * (from.vertices[c] - corner));
    reach.push_back(HUGE_VAL);
    for (const std::uint32_t w : from.triangles[t])
      if (corners[w] != 0)
        reach.back() = std::min(reach.back(), (from.vertices[w] - places.back()).norm());
  }
  std::vector<double> distance(kSurface);
  if (!apart.empty()) {
    const auto part = part_near(to, places, reach);
    tbb::parallel_for(std::size_t{0}, apart.size(), [&](std::size_t i) {
      const UnitFrame& frame = part->frame();
      distance[apart[i]] = part->closest_point(frame.to_unit(places[i])).distance * frame.scale();
    });
  }
  Distances result;
  for (const double d : distance) {
    result.mean += d / double{kSurface};
    result.max = std::max(result.max, d);
    result.near += d <= limit ? 1 / double{kSurface} : 0;
  }
  return result;
}

}  // namespace

RepairQuality judge(const TriangleMesh& soup, const ClosedMesh& made, const TwoMeshes& both,
                    double kept) {
  const Eigen::AlignedBox3d bounds = bounds_of(soup.vertices, soup.triangles);
  const MeshSolid solid(made);
  TriangleMesh outward = turned_outward(soup);
  std::optional<TriangleMesh> rest = difference(outward, made.mesh, both);
  const TriangleWinding winding(rest ? std::move(*rest) : std::move(outward));

  const std::vector<VolumeSums> blocks = sample_volumes(bounds, winding, rest.has_value(), solid);
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

  const double limit = kept * bounds.diagonal().norm();
  const Distances lost = distances(soup, both.shared_of_a(), both.corners_of_a(), made.mesh, limit);
  const Distances added =
      distances(made.mesh, both.shared_of_b(), both.corners_of_b(), soup, limit);
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
