#include "bake/field/boundary_solid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "bake/field/cell_overlap.h"
#include "bake/field/winding_sides.h"
#include "mesh/exact_closest_point.h"

namespace ist {
namespace {

using Point = Eigen::Vector3d;
using Corners = std::array<Point, 3>;

/// Divides a triangle until its pieces are apart from those that it meets, or small, and keeps what
/// may be boundary.
class Pieces {
 public:
  Pieces(const MeshSolid& solid, std::uint32_t triangle, double smallest)
      : solid_(solid), triangle_(triangle), smallest_(smallest) {}

  void add(const Corners& part, const std::vector<std::uint32_t>& met, std::vector<Corners>& out) {
    const MeshView& mesh = solid_.arrays();
    Point low = part[0], high = part[0];
    for (const Point& p : part) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const Point centre = (low + high) / 2, half = (high - low) / 2 + Point::Constant(kRoom);
    std::vector<std::uint32_t> still;
    for (const std::uint32_t other : met) {
      const Corners t = corners_in(mesh, other);
      if (CellOverlap(t[0].data(), t[1].data(), t[2].data()).meets(centre.data(), half.data()))
        still.push_back(other);
    }
    if (still.empty()) {
      const std::optional<int> outside = winding_outside(solid_, triangle_, part);
      if (!outside || *outside == 0) out.push_back(part);
      return;
    }
    if ((high - low).norm() <= smallest_) {
      out.push_back(part);
      return;
    }
    const Point ab = (part[0] + part[1]) / 2, bc = (part[1] + part[2]) / 2,
                ca = (part[2] + part[0]) / 2;
    for (const Corners& quarter : {Corners{part[0], ab, ca}, Corners{ab, part[1], bc},
                                   Corners{ca, bc, part[2]}, Corners{ab, bc, ca}})
      add(quarter, still, out);
  }

 private:
  static constexpr double kRoom = 1e-9;  // unit frame
  const MeshSolid& solid_;
  const std::uint32_t triangle_;
  const double smallest_;
};

}  // namespace

BoundarySolid::BoundarySolid(const MeshSolid& solid, const Overlaps& overlaps, double piece)
    : solid_(solid) {
  const MeshView& mesh = solid.arrays();
  std::vector<std::vector<std::uint32_t>> met(mesh.triangle_count);
  for (const auto& [a, b] : overlaps.pairs) {
    met[a].push_back(b);
    met[b].push_back(a);
  }
  std::vector<std::vector<Corners>> parts(mesh.triangle_count);
  tbb::parallel_for(std::uint32_t{0}, mesh.triangle_count, [&](std::uint32_t t) {
    if (overlaps.part[t] == Overlaps::Part::boundary)
      parts[t].push_back(corners_in(mesh, t));
    else if (overlaps.part[t] == Overlaps::Part::mixed)
      Pieces(solid, t, piece).add(corners_in(mesh, t), met[t], parts[t]);
  });
  for (const std::vector<Corners>& some : parts)
    for (const Corners& part : some)
      for (const Point& p : part) {
        corners_.push_back(static_cast<std::uint32_t>(corners_.size()));
        vertices_.insert(vertices_.end(), p.begin(), p.end());
      }
  bvh_ = build_bvh(vertices_, corners_);
  view_ = {vertices_.data(),
           corners_.data(),
           static_cast<std::uint32_t>(corners_.size()),
           static_cast<std::uint32_t>(corners_.size() / 3),
           bvh_.nodes.data(),
           bvh_.blocks.data(),
           bvh_.root};
}

double BoundarySolid::signed_distance(const Point& x) const {
  constexpr double kFar = 1e3;
  const double distance = exact_closest_point(view_, x, kFar).distance;
  return solid_.inside(x) ? distance : -distance;
}

Eigen::AlignedBox3d BoundarySolid::bounds() const {
  const MeshView& mesh = solid_.arrays();
  Eigen::AlignedBox3d box;
  for (std::size_t v = 0; v < mesh.vertex_count; ++v)
    box.extend(Eigen::Map<const Point>(mesh.vertices + 3 * v));
  return box;
}

}  // namespace ist
