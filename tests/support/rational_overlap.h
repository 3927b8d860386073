#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ist/mesh.h>

// The volume of the overlap of two small meshes without a rounding, by nothing that the library
// does: a solid is a sum of tetrahedra with signs, from one point to each of its triangles.

namespace ist::testing {

using Rational = boost::multiprecision::number<boost::multiprecision::cpp_rational_backend,
                                               boost::multiprecision::et_off>;

namespace rational {

/// Coordinates are whole multiples of 2⁻²⁰ or more and below 64, so that a determinant of them
/// fits.
using Whole = __int128;

/// How many parts of 1 all coordinates are multiples of.
inline double parts_of_one(const TriangleMesh& mesh, double parts) {
  for (const Eigen::Vector3d& x : mesh.vertices)
    while ((parts * x).array().floor().matrix() != parts * x) parts *= 2;
  if (parts > 0x1p20) throw std::domain_error("too fine for the exact reference");
  return parts;
}

template <class T>
using Point = std::array<T, 3>;
template <class T>
using Tetrahedron = std::array<Point<T>, 4>;

template <class T>
Point<T> operator-(const Point<T>& a, const Point<T>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

template <class T>
Point<T> cross(const Point<T>& a, const Point<T>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <class T>
T dot(const Point<T>& a, const Point<T>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class T>
T six_volumes(const Tetrahedron<T>& t) {
  return dot(t[1] - t[0], cross(t[2] - t[0], t[3] - t[0]));
}

template <class T>
Point<Rational> rational(const Point<T>& x) {
  return {Rational(x[0]), Rational(x[1]), Rational(x[2])};
}

/// A tetrahedron of a solid: `sign` −1 where it is to be taken away.
struct Signed {
  Tetrahedron<Whole> corner;
  int sign;
  std::array<Point<Whole>, 4> normal;  ///< inward, of the face across corner k

  /// How far x lies inside of face k, in some unit.
  Whole height(std::size_t k, const Point<Whole>& x) const {
    return dot(normal[k], x - corner[(k + 1) % 4]);
  }
  Rational height(std::size_t k, const Point<Rational>& x) const {
    return dot(rational(normal[k]), x - rational(corner[(k + 1) % 4]));
  }
};

inline std::vector<Signed> tetrahedra(const TriangleMesh& mesh, double parts) {
  const auto point = [&](std::uint32_t v) {
    Point<Whole> out;
    for (std::size_t k = 0; k < 3; ++k)
      out[k] = static_cast<std::int64_t>(parts * mesh.vertices[v][static_cast<Eigen::Index>(k)]);
    return out;
  };
  const Point<Whole> apex = point(mesh.triangles[0][0]);
  std::vector<Signed> out;
  for (const auto& t : mesh.triangles) {
    Signed made{{apex, point(t[0]), point(t[1]), point(t[2])}, 1, {}};
    const Whole volume = six_volumes(made.corner);
    if (volume == 0) continue;
    if (volume < 0) {
      made.sign = -1;
      std::swap(made.corner[2], made.corner[3]);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const auto &p = made.corner[(k + 1) % 4], &q = made.corner[(k + 2) % 4],
                 &r = made.corner[(k + 3) % 4];
      made.normal[k] = cross(q - p, r - p);
      if (made.height(k, made.corner[k]) < 0)
        for (Whole& n : made.normal[k]) n = -n;
    }
    out.push_back(made);
  }
  return out;
}

/// Six volumes of the part of `t` that lies inside of planes k, k + 1, … of `other`: where a plane
/// goes between two corners, the tetrahedron is cut in two there.
inline Rational six_volumes_inside(const Tetrahedron<Rational>& t, const Signed& other,
                                   std::size_t k) {
  if (k == 4) return abs(six_volumes(t));
  std::array<Rational, 4> height;
  std::size_t above = 4, below = 4;
  for (std::size_t i = 0; i < 4; ++i) {
    height[i] = other.height(k, t[i]);
    if (height[i] > 0) above = i;
    if (height[i] < 0) below = i;
  }
  if (above == 4) return 0;
  if (below == 4) return six_volumes_inside(t, other, k + 1);
  const Rational share = height[above] / (height[above] - height[below]);
  Point<Rational> cut;
  for (std::size_t x = 0; x < 3; ++x) cut[x] = t[above][x] + share * (t[below][x] - t[above][x]);
  Tetrahedron<Rational> with_above = t, with_below = t;
  with_above[below] = cut;
  with_below[above] = cut;
  return six_volumes_inside(with_above, other, k) + six_volumes_inside(with_below, other, k);
}

inline bool apart(const Signed& a, const Signed& b) {
  for (const auto& [planes, points] : {std::pair(&a, &b), std::pair(&b, &a)})
    for (std::size_t k = 0; k < 4; ++k) {
      bool all_outside = true;
      for (std::size_t i = 0; i < 4 && all_outside; ++i)
        all_outside = planes->height(k, points->corner[i]) <= 0;
      if (all_outside) return true;
    }
  return false;
}

}  // namespace rational

/// Volume of the overlap of two closed meshes with winding numbers of 0 and 1.
inline Rational rational_overlap(const TriangleMesh& a, const TriangleMesh& b) {
  const double parts = rational::parts_of_one(b, rational::parts_of_one(a, 1));
  const std::vector<rational::Signed> of_a = rational::tetrahedra(a, parts),
                                      of_b = rational::tetrahedra(b, parts);
  Rational sum = 0;
  for (const rational::Signed& x : of_a)
    for (const rational::Signed& y : of_b) {
      if (rational::apart(x, y)) continue;
      rational::Tetrahedron<Rational> t;
      for (std::size_t k = 0; k < 4; ++k) t[k] = rational::rational(x.corner[k]);
      sum += x.sign * y.sign * rational::six_volumes_inside(t, y, 0);
    }
  const Rational grid = parts;
  return sum / (6 * grid * grid * grid);
}

}  // namespace ist::testing
