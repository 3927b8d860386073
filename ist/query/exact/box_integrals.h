#pragma once

#include <cstdint>

#include "query/base/pair_place.h"
#include "query/exact/mesh_tree.h"
#include "query/exact/overlap_formulas.h"

// Integrals over all that is below a lane of a box block, on the host and on a GPU.

namespace ist {

IST_HD inline exact::Point map_point(const Similarity& map, const exact::Point& x) noexcept {
  double moved[3];
  map.apply({x.x, x.y, x.z}, moved);
  return {moved[0], moved[1], moved[2]};
}
IST_HD inline exact::Point map_vector(const Similarity& map, const exact::Point& x) noexcept {
  return {(map.m[0] * x.x + map.m[1] * x.y) + map.m[2] * x.z,
          (map.m[3] * x.x + map.m[4] * x.y) + map.m[5] * x.z,
          (map.m[6] * x.x + map.m[7] * x.y) + map.m[8] * x.z};
}

/// Integrals over all triangles below a lane of a box block, relative to a point.
struct LaneSums {
  double six_volumes;
  exact::Point moment, normal, torque;  ///< 24 ∫ x, ∫ n dA, ∫ x × n dA
  double area, width;                   ///< at least, and of the box all sides together
  double reach;                         ///< of its middle

  double six_volume_rounding;  ///< six_volumes may be off by this
};

/// `a_from_b`: for B's blocks; null for A's.
IST_HD inline LaneSums lane_sums(const BoxBlock& box, const BoxSums& sums, std::uint32_t lane,
                                 const Similarity* a_from_b, const exact::Point& origin) noexcept {
  using exact::Point;
  const auto middle = [&](int k) {
    return (double{box.low[k][lane]} + double{box.high[k][lane]}) / 2;
  };
  const auto width = [&](int k) { return double{box.high[k][lane]} - double{box.low[k][lane]}; };
  Point c = {middle(0), middle(1), middle(2)};
  Point n = {sums.normal[0][lane], sums.normal[1][lane], sums.normal[2][lane]};
  Point cone = {sums.cone[0][lane], sums.cone[1][lane], sums.cone[2][lane]};
  double trace = (sums.flux[0][0][lane] + sums.flux[1][1][lane]) + sums.flux[2][2][lane];
  double area = sums.area[lane], wide = (width(0) + width(1)) + width(2);
  const auto flux = [&](const Point& d) {  // Σₖ ∫ y nₖ dA · dₖ
    return Point{
        (sums.flux[0][0][lane] * d.x + sums.flux[0][1][lane] * d.y) + sums.flux[0][2][lane] * d.z,
        (sums.flux[1][0][lane] * d.x + sums.flux[1][1][lane] * d.y) + sums.flux[1][2][lane] * d.z,
        (sums.flux[2][0][lane] * d.x + sums.flux[2][1][lane] * d.y) + sums.flux[2][2][lane] * d.z};
  };
  Point twist = {sums.flux[1][2][lane] - sums.flux[2][1][lane],
                 sums.flux[2][0][lane] - sums.flux[0][2][lane],
                 sums.flux[0][1][lane] - sums.flux[1][0][lane]};  // ∫ y × n dA
  Point d = c - origin, turned;
  if (a_from_b != nullptr) {
    const double s = a_from_b->scale;
    d = map_point(*a_from_b, c) - origin;
    const double* m = a_from_b->m;
    const Point back = {(m[0] * d.x + m[3] * d.y) + m[6] * d.z,
                        (m[1] * d.x + m[4] * d.y) + m[7] * d.z,
                        (m[2] * d.x + m[5] * d.y) + m[8] * d.z};
    turned = s * map_vector(*a_from_b, flux(back));
    n = s * map_vector(*a_from_b, n);
    twist = (s * s) * map_vector(*a_from_b, twist);
    cone = (s * s * s) * map_vector(*a_from_b, cone);
    trace *= s * s * s;
    area *= s * s;
    wide *= s;
  } else {
    turned = flux(d);
  }
  const double out = dot(d, n);
  LaneSums found = {2 * (trace + out),
                    6 * (cone + (trace * d + (turned + out * d))),
                    n,
                    twist + cross(d, n),
                    area,
                    wide,
                    exact::length_bound(d),
                    0};
  found.six_volume_rounding = 64 * exact::kHalfUnit * found.area * (found.reach + found.width);
  return found;
}

/// A bound of the change of volume if a surface moves: a layer of that thickness over its faces,
/// edges and corners. `width`: the sum of the sides of a box around it.
IST_HD inline double moved_layer(double moved, double area, double width) noexcept {
  return moved * area + 32 * (moved * moved) * width;
}

/// The symbolic translation of B, by which signs of a pair are decided.
struct MoveAside {
  exact::Point by = {0, 0, 0};  ///< A's unit frame
  double far = 0;               ///< its length
};

/// The translation is far larger than the rounding of the meshes' placement, and far smaller than
/// what the interval allows for anyway. So flush faces and coincident copies have clear signs. It
/// points away from A's middle, since flush parts separate in that direction, and somewhat across,
/// in a direction that no face or edge of a part is likely to have. It changes sign if A and B
/// change places, as do its first and last term; the sign of the middle term follows from the
/// middles or, if these are equal, from the meshes' hashes. Copies of one mesh about one middle get
/// the same translation.
IST_HD inline MoveAside aside_of(const MeshTree& a, const MeshTree& b,
                                 const Similarity& a_from_b) noexcept {
  using exact::Point;
  const auto unit = [](const Point& x) {
    const double length = std::sqrt(dot(x, x));
    return length > 0 ? 1 / length * x : Point{0, 0, 0};
  };
  const Point to_side = {0.267, 0.534, 0.802};
  const Point centre = unit(vec3(a_from_b.t));
  const Point turned = 1 / a_from_b.scale * map_vector(a_from_b, to_side);
  const Point both = to_side + turned;
  const double along = dot(centre, both);
  const bool first = std::abs(along) > 1e-9 ? along > 0 : a.hash <= b.hash;
  const Point across = (first ? 1.0 : -1.0) * both + cross(to_side, turned);
  constexpr double kAside = 0x1p-47;  // of both sizes
  const double far = kAside * (a.extent() + a_from_b.scale * b.extent());
  return {far * unit(centre + 0.4 * unit(across)), far};
}

}  // namespace ist
