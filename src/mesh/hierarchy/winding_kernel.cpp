#include "mesh/hierarchy/winding.h"

#include <numbers>

#include "base/elementary.h"
#include "mesh/geometry/exact_triangle.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mesh/hierarchy/winding_kernel.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace ist::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using Tag = hn::CappedTag<double, kWindingPoints>;
using Vector = hn::Vec<Tag>;

HWY_INLINE Vector dot(const Vector a[3], const Vector b[3]) {
  return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}

/// Winding numbers of eight points. Angles are multiplied as complex numbers, and the turns of the
/// product are counted: an arc tangent would cost more than everything else.
class Winding {
 public:
  explicit Winding(const double points[3][kWindingPoints]) {
    for (std::size_t i = 0; i < kWindingPoints; ++i) {
      for (std::size_t k = 0; k < 3; ++k) points_[k][i] = points[k][i];
      re_[i] = 1;
      im_[i] = turns_[i] = far_[i] = 0;
    }
  }

  /// Half the signed solid angle, positive if a point sees the back (van Oosterom & Strackee).
  void add(const Corners& t) {
    const Tag d;
    for (std::size_t i = 0; i < kWindingPoints; i += hn::Lanes(d)) {
      Vector a[3], b[3], c[3];
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector point = hn::Load(d, points_[k] + i);
        a[k] = hn::Set(d, t.p[0][k]) - point;
        b[k] = hn::Set(d, t.p[1][k]) - point;
        c[k] = hn::Set(d, t.p[2][k]) - point;
      }
      const Vector la = hn::Sqrt(dot(a, a)), lb = hn::Sqrt(dot(b, b)), lc = hn::Sqrt(dot(c, c));
      const Vector across[3] = {b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2],
                                b[0] * c[1] - b[1] * c[0]};
      const Vector opposite = dot(a, across);
      const Vector adjacent = ((la * lb * lc + dot(a, b) * lc) + dot(b, c) * la) + dot(c, a) * lb;
      const Vector re = hn::Load(d, re_ + i), im = hn::Load(d, im_ + i);
      const Vector new_im = re * opposite + im * adjacent;
      // A turn of less than a half across the negative real axis, in either direction.
      const Vector zero = hn::Zero(d), one = hn::Set(d, 1);
      const auto above = im >= zero, now_above = new_im >= zero;
      const Vector on =
          hn::IfThenElseZero(hn::AndNot(now_above, hn::And(above, opposite > zero)), one);
      const Vector back =
          hn::IfThenElseZero(hn::AndNot(above, hn::And(now_above, opposite < zero)), one);
      hn::Store(re * adjacent - im * opposite, d, re_ + i);
      hn::Store(new_im, d, im_ + i);
      hn::Store(hn::Load(d, turns_ + i) + (on - back), d, turns_ + i);
    }
  }

  /// Normalises the product after a few triangles, before it leaves the range of double.
  void shorten() {
    const Tag d;
    for (std::size_t i = 0; i < kWindingPoints; i += hn::Lanes(d)) {
      const Vector re = hn::Load(d, re_ + i), im = hn::Load(d, im_ + i), one = hn::Set(d, 1);
      const Vector length = hn::Max(hn::Abs(re), hn::Abs(im));
      const auto is_one = length > hn::Zero(d);
      const Vector divisor = hn::IfThenElse(is_one, length, one);
      hn::Store(hn::IfThenElse(is_one, re / divisor, one), d, re_ + i);
      hn::Store(im / divisor, d, im_ + i);
    }
  }

  /// Adds the far-field expansion of a group; adds nothing and returns false if a point is too
  /// near.
  bool add(const FarTriangles& seen) {
    const Tag d;
    alignas(64) double angles[kWindingPoints];
    for (std::size_t i = 0; i < kWindingPoints; i += hn::Lanes(d)) {
      Vector r[3];
      for (std::size_t k = 0; k < 3; ++k)
        r[k] = hn::Set(d, seen.centre[k]) - hn::Load(d, points_[k] + i);
      const Vector r2 = dot(r, r);
      if (!hn::AllTrue(d, r2 > hn::Set(d, seen.reach2))) return false;
      Vector first = hn::Zero(d), second = hn::Zero(d);
      for (std::size_t k = 0; k < 3; ++k) {
        first = first + hn::Set(d, seen.dipole[k]) * r[k];
        for (std::size_t j = 0; j < 3; ++j)
          second = second + r[k] * hn::Set(d, seen.second[3 * k + j]) * r[j];
      }
      const Vector trace = hn::Set(d, seen.second[0] + seen.second[4] + seen.second[8]);
      hn::Store((first + trace - hn::Set(d, 3) * second / r2) / (r2 * hn::Sqrt(r2)), d, angles + i);
    }
    for (std::size_t i = 0; i < kWindingPoints; ++i) far_[i] += angles[i];
    return true;
  }

  double number(std::size_t i) const {
    constexpr double kFullTurn = 2 * std::numbers::pi;
    return (far_[i] + 2 * (angle_of(im_[i], re_[i]) + kFullTurn * turns_[i])) / (2 * kFullTurn);
  }

 private:
  alignas(64) double points_[3][kWindingPoints];
  alignas(64) double re_[kWindingPoints], im_[kWindingPoints];  ///< the product
  alignas(64) double turns_[kWindingPoints];                    ///< its turns so far
  double far_[kWindingPoints];                                  ///< solid angles of far groups
};

void wind_about(const MeshView& mesh, const FarChildren* far,
                const double points[3][kWindingPoints], double winding[kWindingPoints]) {
  Winding sum(points);
  std::uint32_t stack[kBvhStackSize];
  int top = 0;
  if (mesh.root != kBvhEmpty) stack[top++] = mesh.root;
  while (top > 0) {
    const std::uint32_t at = stack[--top];
    if ((at & kBvhLeaf) != 0) {
      for (const std::uint32_t triangle : mesh.blocks[at & ~kBvhLeaf].triangle)
        if (triangle != kNoTriangle) sum.add(corners_of(mesh, triangle));
      sum.shorten();
      continue;
    }
    for (std::size_t i = 0; i < kBvhWidth; ++i) {
      const std::uint32_t child = mesh.nodes[at].child[i];
      if (child != kBvhEmpty && !sum.add(far[at][i])) stack[top++] = child;
    }
  }
  for (std::size_t i = 0; i < kWindingPoints; ++i) winding[i] = sum.number(i);
}

}  // namespace
}  // namespace ist::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ist {

HWY_EXPORT(wind_about);

void wind_about(const MeshView& mesh, const FarChildren* far,
                const double points[3][kWindingPoints], double winding[kWindingPoints]) {
  HWY_DYNAMIC_DISPATCH(wind_about)(mesh, far, points, winding);
}

}  // namespace ist
#endif
