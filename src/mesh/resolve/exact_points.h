#pragma once

#include <Eigen/Core>
#include <boost/multiprecision/cpp_int.hpp>
#include <string>
#include <unordered_map>

#include "mesh/connectivity/edge_table.h"

namespace ist {

/// Thrown and caught within this folder, with the reason why a mesh is not resolved.
struct Unresolvable {
  std::string reason;
};

/// Whole numbers of any size; up to 1,024 bits without an allocation.
using Whole = boost::multiprecision::number<
    boost::multiprecision::cpp_int_backend<1024, 0, boost::multiprecision::signed_magnitude,
                                           boost::multiprecision::unchecked,
                                           std::allocator<boost::multiprecision::limb_type>>,
    boost::multiprecision::et_off>;
using WholeVector = std::array<Whole, 3>;

WholeVector minus(const WholeVector& a, const WholeVector& b);
WholeVector times(const WholeVector& a, const Whole& factor);
WholeVector cross(const WholeVector& a, const WholeVector& b);
Whole dot(const WholeVector& a, const WholeVector& b);

/// The point x / w in units of the lattice, w > 0.
struct ExactPoint {
  WholeVector x;
  Whole w;
};

/// The plane through three points: normal · x = offset. The normal points to the front.
struct ExactPlane {
  WholeVector normal;
  Whole offset;

  /// Positive in front.
  Whole height(const ExactPoint& p) const { return dot(normal, p.x) - offset * p.w; }
};

ExactPoint common_point(const ExactPlane& a, const ExactPlane& b, const ExactPlane& c);
/// The intersection of the line from p to q with a plane that is `height_p` below p and `height_q`
/// below q.
ExactPoint between(const WholeVector& p, const WholeVector& q, const Whole& height_p,
                   const Whole& height_q);

/// An exact point in double: the nearest double, and the approximate remainder.
struct RoundedPoint {
  Eigen::Vector3d at = Eigen::Vector3d::Zero(), rest = Eigen::Vector3d::Zero();
};

struct PointView {
  const RoundedPoint* rounded;
  const ExactPoint* exact;  ///< null: `rounded->at` is exact

  double at(int k) const { return rounded->at[k]; }
};

/// Points of one arrangement by number: a mesh's vertices, then points constructed from them. Every
/// coordinate of a vertex is a multiple of one power of two, the lattice's step, so all arithmetic
/// is on integers. Equal points have one number.
///
/// Signs are exact: decided in double if the rounding allows, else in integers.
class ExactPoints {
 public:
  explicit ExactPoints(const std::vector<Eigen::Vector3d>& vertices);

  std::uint32_t size() const { return static_cast<std::uint32_t>(at_.size()); }
  bool is_given(std::uint32_t p) const { return p < given_; }
  const Eigen::Vector3d& rounded(std::uint32_t p) const { return at_[p].at; }  ///< to nearest
  PointView view(std::uint32_t p) const {
    return {&at_[p], is_given(p) ? nullptr : &made_[p - given_]};
  }

  /// `at`: each coordinate's nearest double, the same for equal points; `rest`: within 2^-50 of
  /// itself.
  RoundedPoint round(const ExactPoint& point) const;
  /// Adds a point whose round() is `rounded` and returns its number.
  std::uint32_t add(ExactPoint point, const RoundedPoint& rounded);
  std::uint32_t add(const Eigen::Vector3d& point) {
    const RoundedPoint rounded = {point};
    return add(exact({&rounded, nullptr}), rounded);
  }

  WholeVector whole(std::uint32_t given) const;  ///< of a vertex
  ExactPoint exact(std::uint32_t p) const { return exact(view(p)); }
  ExactPoint exact(const PointView& p) const;
  ExactPlane plane(const Triangle& given) const;

  /// Sign of the area of abc seen against axis k: 1 if it is counter-clockwise.
  int turn(int k, const PointView& a, const PointView& b, const PointView& c) const;
  int turn(int k, std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    return a == b || b == c || c == a ? 0 : turn(k, view(a), view(b), view(c));
  }
  int compare(int k, std::uint32_t a, std::uint32_t b) const;
  /// 1 if p is in front of a triangle of vertices, 0 in its plane.
  int side(const Triangle& given, const PointView& p) const;

 private:
  Whole whole(double coordinate) const;

  std::uint32_t given_;
  int exponent_ = 0;  ///< of the lattice's step
  std::vector<RoundedPoint> at_;
  std::vector<ExactPoint> made_;
  std::unordered_multimap<std::uint64_t, std::uint32_t> by_place_;
};

}  // namespace ist
