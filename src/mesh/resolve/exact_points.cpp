#include "mesh/resolve/exact_points.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "mesh/connectivity/weld.h"
#include "mesh/geometry/exact_sign.h"

namespace ist {
namespace {

constexpr double kHalfUlp = 0x1p-53;  ///< of a rounded coordinate, relative to it
constexpr double kTiny = 1e-290;      ///< exceeds the effect of underflow

/// numerator / denominator · 2^exponent as the nearest double, and the remainder to 2^-50 of it.
std::array<double, 2> quotient(const Whole& numerator, const Whole& denominator, int exponent) {
  if (numerator.is_zero()) return {0, 0};
  Whole above = abs(numerator), below = denominator, whole, remainder;
  const int shift = 130 - (static_cast<int>(msb(above)) - static_cast<int>(msb(below)));
  if (shift > 0)
    above <<= shift;
  else
    below <<= -shift;
  divide_qr(above, below, whole, remainder);  // 130 or 131 bits
  const auto dropped = static_cast<int>(msb(whole)) - 63;
  const bool inexact = !remainder.is_zero() || static_cast<int>(lsb(whole)) < dropped;
  const auto bits = static_cast<std::uint64_t>(whole >> dropped) | (inexact ? 1 : 0);
  const auto nearest = static_cast<double>(bits);
  const Whole rest = whole - (Whole(nearest) << dropped);
  const int scale = exponent - shift, sign = numerator.sign() < 0 ? -1 : 1;
  return {sign * std::ldexp(nearest, dropped + scale),
          sign * std::ldexp(static_cast<double>(rest), scale)};
}

/// A sum of two doubles, the second far smaller.
struct Double2 {
  double high, low;
};

/// a_k − b_k, to 2^-102 of their sizes.
Double2 difference(const PointView& a, const PointView& b, int k) {
  const double p = a.at(k), q = b.at(k), high = p - q, back = high - p;
  const double lost = (p - (high - back)) - (q + back);  // Knuth's two-sum
  return {high, lost + (a.rounded->rest[k] - b.rounded->rest[k])};
}

/// a · b − c · d.
double determinant(const Double2& a, const Double2& b, const Double2& c, const Double2& d) {
  const double left = a.high * b.high, right = c.high * d.high, high = left - right;
  const double back = high - left, lost = (left - (high - back)) - (right + back);
  const auto rest = [](const Double2& p, const Double2& q, double product) {
    return std::fma(p.high, q.high, -product) + (p.high * q.low + p.low * (q.high + q.low));
  };
  const double low = rest(a, b, left) - rest(c, d, right);
  return high + (lost + low);
}

bool equal(const ExactPoint& a, const ExactPoint& b) {
  for (std::size_t k = 0; k < 3; ++k)
    if (a.x[k] * b.w != b.x[k] * a.w) return false;
  return true;
}

/// Bound on the error of p_k in double.
double error_of(const PointView& p, int k) {
  return p.exact == nullptr ? 0 : std::abs(p.at(k)) * kHalfUlp;
}

ExactPoint with_positive_w(WholeVector x, Whole w) {
  if (w.sign() < 0) {
    w = -w;
    for (Whole& c : x) c = -c;
  }
  return {std::move(x), std::move(w)};
}

}  // namespace

WholeVector minus(const WholeVector& a, const WholeVector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

WholeVector times(const WholeVector& a, const Whole& factor) {
  return {a[0] * factor, a[1] * factor, a[2] * factor};
}

WholeVector cross(const WholeVector& a, const WholeVector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Whole dot(const WholeVector& a, const WholeVector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

ExactPoint common_point(const ExactPlane& a, const ExactPlane& b, const ExactPlane& c) {
  const WholeVector bc = cross(b.normal, c.normal), ca = cross(c.normal, a.normal),
                    ab = cross(a.normal, b.normal);
  WholeVector x;
  for (std::size_t k = 0; k < 3; ++k) x[k] = a.offset * bc[k] + b.offset * ca[k] + c.offset * ab[k];
  return with_positive_w(std::move(x), dot(a.normal, bc));
}

ExactPoint between(const WholeVector& p, const WholeVector& q, const Whole& height_p,
                   const Whole& height_q) {
  return with_positive_w(minus(times(q, height_p), times(p, height_q)), height_p - height_q);
}

ExactPoints::ExactPoints(const std::vector<Eigen::Vector3d>& vertices)
    : given_(static_cast<std::uint32_t>(vertices.size())), at_(vertices.size()) {
  for (std::size_t p = 0; p < vertices.size(); ++p) at_[p].at = vertices[p];
  bool any = false;
  for (const Eigen::Vector3d& p : vertices)
    for (const double x : p) {
      if (x == 0) continue;
      int exponent = 0;
      const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
      const int lowest = exponent - 53 + std::countr_zero(static_cast<std::uint64_t>(mantissa));
      exponent_ = any ? std::min(exponent_, lowest) : lowest;
      any = true;
    }
  by_place_.reserve(at_.size());
  for (std::uint32_t p = 0; p < given_; ++p) by_place_.emplace(hash_of_bits(at_[p].at), p);
}

RoundedPoint ExactPoints::round(const ExactPoint& p) const {
  RoundedPoint rounded;
  for (const int k : {0, 1, 2}) {
    const auto [at, rest] = quotient(p.x[static_cast<std::size_t>(k)], p.w, exponent_);
    rounded.at[k] = at;
    rounded.rest[k] = rest;
  }
  return rounded;
}

std::uint32_t ExactPoints::add(ExactPoint point, const RoundedPoint& rounded) {
  const std::uint64_t hash = hash_of_bits(rounded.at);
  const auto [begin, end] = by_place_.equal_range(hash);
  for (auto it = begin; it != end; ++it)
    if (at_[it->second].at == rounded.at && equal(exact(it->second), point)) return it->second;
  by_place_.emplace(hash, size());
  at_.push_back(rounded);
  made_.push_back(std::move(point));
  return size() - 1;
}

Whole ExactPoints::whole(double coordinate) const {
  int exponent = 0;
  const auto mantissa =
      static_cast<std::int64_t>(std::ldexp(std::frexp(coordinate, &exponent), 53));
  if (mantissa == 0) return 0;
  const int shift = exponent - 53 - exponent_;
  Whole size = std::abs(mantissa);
  if (shift >= 0)
    size <<= shift;
  else
    size >>= -shift;
  return mantissa < 0 ? Whole(-size) : size;
}

WholeVector ExactPoints::whole(std::uint32_t given) const {
  const Eigen::Vector3d& p = at_[given].at;
  return {whole(p[0]), whole(p[1]), whole(p[2])};
}

ExactPoint ExactPoints::exact(const PointView& p) const {
  if (p.exact != nullptr) return *p.exact;
  return {{whole(p.at(0)), whole(p.at(1)), whole(p.at(2))}, 1};
}

ExactPlane ExactPoints::plane(const Triangle& given) const {
  const WholeVector a = whole(given[0]);
  WholeVector normal = cross(minus(whole(given[1]), a), minus(whole(given[2]), a));
  Whole offset = dot(normal, a);
  return {std::move(normal), std::move(offset)};
}

int ExactPoints::turn(int k, const PointView& a, const PointView& b, const PointView& c) const {
  const int x = (k + 1) % 3, y = (k + 2) % 3;
  const double ax = a.at(x) - c.at(x), ay = a.at(y) - c.at(y);
  const double bx = b.at(x) - c.at(x), by = b.at(y) - c.at(y);
  const bool given = a.exact == nullptr && b.exact == nullptr && c.exact == nullptr;
  if (given && (ax == 0 || by == 0) && (ay == 0 || bx == 0)) return 0;
  const double left = ax * by, right = ay * bx, area = left - right;
  // Bounds on the rounding of the corners, coordinate by coordinate.
  const double corner_x = error_of(a, x) + error_of(b, x) + error_of(c, x);
  const double corner_y = error_of(a, y) + error_of(b, y) + error_of(c, y);
  const double bound = exact_sign::kOrient2dBound * (std::abs(left) + std::abs(right)) +
                       1.001 * (corner_x * (std::abs(ay) + std::abs(by) + corner_y) +
                                corner_y * (std::abs(ax) + std::abs(bx) + corner_x)) +
                       kTiny;
  if (std::abs(area) > bound) return area > 0 ? 1 : -1;
  // The same with twice as many digits.
  const double again = determinant(difference(a, c, x), difference(b, c, y), difference(a, c, y),
                                   difference(b, c, x));
  const double size_x = std::abs(a.at(x)) + std::abs(b.at(x)) + std::abs(c.at(x));
  const double size_y = std::abs(a.at(y)) + std::abs(b.at(y)) + std::abs(c.at(y));
  const double bound_again =
      0x1p-98 * (std::abs(left) + std::abs(right) + size_x * (std::abs(ay) + std::abs(by)) +
                 size_y * (std::abs(ax) + std::abs(bx)) + 0x1p-48 * size_x * size_y) +
      kTiny;
  if (std::abs(again) > bound_again) return again > 0 ? 1 : -1;
  const auto i = static_cast<std::size_t>(x), j = static_cast<std::size_t>(y);
  const ExactPoint p = exact(a), q = exact(b), r = exact(c);
  const Whole exact_area = p.x[i] * (q.x[j] * r.w - q.w * r.x[j]) -
                           p.x[j] * (q.x[i] * r.w - q.w * r.x[i]) +
                           p.w * (q.x[i] * r.x[j] - q.x[j] * r.x[i]);
  return exact_area.sign();
}

int ExactPoints::compare(int k, std::uint32_t a, std::uint32_t b) const {
  if (a == b) return 0;
  const double at_a = at_[a].at[k], at_b = at_[b].at[k];
  if (at_a != at_b) return at_a < at_b ? -1 : 1;  // rounding keeps the order
  if (is_given(a) && is_given(b)) return 0;
  const ExactPoint p = exact(a), q = exact(b);
  const auto i = static_cast<std::size_t>(k);
  return (p.x[i] * q.w).compare(q.x[i] * p.w);
}

int ExactPoints::side(const Triangle& given, const PointView& p) const {
  const Eigen::Vector3d &a = at_[given[0]].at, &x = p.rounded->at;
  const Eigen::Vector3d ab = at_[given[1]].at - a, ac = at_[given[2]].at - a, ap = x - a;
  double height = 0, magnitude = 0, moved = 0;
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const double left = ab[i] * ac[j], right = ab[j] * ac[i];
    height += ap[k] * (left - right);
    magnitude += std::abs(ap[k]) * (std::abs(left) + std::abs(right));
    moved += error_of(p, k) * (std::abs(left) + std::abs(right));
  }
  if (std::abs(height) > exact_sign::kOrient3dBound * magnitude + 1.001 * moved + kTiny)
    return height > 0 ? 1 : -1;
  return plane(given).height(exact(p)).sign();
}

}  // namespace ist
