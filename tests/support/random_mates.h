#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include <ist/mesh.h>
#include <ist/types.h>

// Random mates of extruded profiles, whose volumes and contact areas follow from plane geometry.

namespace ist::testing {

/// A profile in the xy plane, between two heights.
struct Extrusion {
  using Point = Eigen::Vector2d;
  std::vector<Point> points;
  std::vector<std::array<std::uint32_t, 3>> cap;    ///< triangles of the profile, counter-clockwise
  std::vector<std::vector<std::uint32_t>> outline;  ///< loops, the profile to their left
  double low = 0, high = 1;

  TriangleMesh mesh() const {
    TriangleMesh out;
    const auto n = static_cast<std::uint32_t>(points.size());
    for (const double z : {low, high})
      for (const Point& p : points) out.vertices.emplace_back(p.x(), p.y(), z);
    for (const auto& [a, b, c] : cap) {
      out.triangles.push_back({a, c, b});
      out.triangles.push_back({n + a, n + b, n + c});
    }
    for (const auto& loop : outline)
      for (std::size_t i = 0; i < loop.size(); ++i) {
        const std::uint32_t a = loop[i], b = loop[(i + 1) % loop.size()];
        out.triangles.push_back({a, b, n + b});
        out.triangles.push_back({a, n + b, n + a});
      }
    return out;
  }

  double area() const {
    double twice = 0;
    for (const auto& [a, b, c] : cap) twice += cross(points[b] - points[a], points[c] - points[a]);
    return twice / 2;
  }

  /// [u²] Of all faces.
  double surface() const {
    double rim = 0;
    for (const auto& loop : outline)
      for (std::size_t i = 0; i < loop.size(); ++i)
        rim += (points[loop[(i + 1) % loop.size()]] - points[loop[i]]).norm();
    return 2 * area() + rim * (high - low);
  }

  static double cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

  static Extrusion rectangle(double width, double depth, double height) {
    const double x = width / 2, y = depth / 2;
    return {{{-x, -y}, {x, -y}, {x, y}, {-x, y}},
            {{0, 1, 2}, {0, 2, 3}},
            {{0, 1, 2, 3}},
            -height / 2,
            height / 2};
  }

  /// About the axis, fanned from its first corner as CAD kernels do.
  static Extrusion prism(std::uint32_t corners, double radius, double low, double high) {
    Extrusion out;
    out.low = low, out.high = high;
    out.outline.resize(1);
    for (std::uint32_t i = 0; i < corners; ++i) {
      out.points.push_back(on_circle(i, corners, radius));
      out.outline[0].push_back(i);
      if (i >= 2) out.cap.push_back({0, i - 1, i});
    }
    return out;
  }

  /// Likewise with another corner halfway between two, nearer to the axis; a fan about the axis.
  static Extrusion fan(std::uint32_t spikes, double radius, double inner, double low, double high) {
    Extrusion out;
    out.low = low, out.high = high;
    out.outline.resize(1);
    const std::uint32_t n = 2 * spikes;
    for (std::uint32_t i = 0; i < n; ++i) {
      out.points.push_back(on_circle(i, n, i % 2 == 0 ? radius : inner));
      out.outline[0].push_back(i);
      out.cap.push_back({n, i, (i + 1) % n});
    }
    out.points.emplace_back(0, 0);
    return out;
  }

  static Extrusion tube(std::uint32_t corners, double radius, double hole, double low,
                        double high) {
    Extrusion out;
    out.low = low, out.high = high;
    out.outline.resize(2);
    for (std::uint32_t i = 0; i < corners; ++i) {
      out.points.push_back(on_circle(i, corners, radius));
      out.points.push_back(on_circle(i, corners, hole));
      const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % corners);
      out.cap.push_back({a, b, b + 1});
      out.cap.push_back({a, b + 1, a + 1});
      out.outline[0].push_back(a);
      out.outline[1].push_back(2 * corners - 1 - a);
    }
    return out;
  }

  /// A channel, open to +y: its walls and floor are `wall` thick, its bed is at y = 0 between
  /// x = ± width / 2.
  static Extrusion channel(double width, double depth, double wall, double low, double high) {
    const double x = width / 2, w = x + wall;
    return {{{-w, -wall},
             {w, -wall},
             {w, depth},
             {x, depth},
             {x, 0},
             {-x, 0},
             {-x, depth},
             {-w, depth}},
            {{0, 1, 4}, {0, 4, 5}, {1, 2, 3}, {1, 3, 4}, {0, 5, 6}, {0, 6, 7}},
            {{0, 1, 2, 3, 4, 5, 6, 7}},
            low,
            high};
  }

  /// After half a turn about the x axis, or not, and then a turn about the z axis.
  Extrusion turned(bool flip, double degrees) const {
    Extrusion out = *this;
    const Eigen::Rotation2Dd turn(degrees * std::numbers::pi / 180);
    for (Point& p : out.points) p = turn * Point(p.x(), flip ? -p.y() : p.y());
    if (flip) {
      out.low = -high, out.high = -low;
      for (auto& t : out.cap) std::swap(t[1], t[2]);
      for (auto& loop : out.outline) std::reverse(loop.begin(), loop.end());
    }
    return out;
  }

  Extrusion moved(const Eigen::Vector3d& by) const {
    Extrusion out = *this;
    for (Point& p : out.points) p += by.head<2>();
    out.low += by.z(), out.high += by.z();
    return out;
  }

 private:
  static Point on_circle(std::uint32_t i, std::uint32_t n, double radius) {
    const double angle = 2 * std::numbers::pi * i / n;
    return radius * Point(std::cos(angle), std::sin(angle));
  }
};

/// The common area of two triangles.
inline double common_area(const std::array<Eigen::Vector2d, 3>& a,
                          const std::array<Eigen::Vector2d, 3>& b) {
  using Point = Eigen::Vector2d;
  std::vector<Point> polygon(b.begin(), b.end());
  for (int e = 0; e < 3 && !polygon.empty(); ++e) {
    const Point from = a[e], along = a[(e + 1) % 3] - from;
    std::vector<Point> kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
      const double at_p = Extrusion::cross(along, p - from),
                   at_q = Extrusion::cross(along, q - from);
      if (at_p >= 0) kept.push_back(p);
      if ((at_p >= 0) != (at_q >= 0)) kept.push_back(p + at_p / (at_p - at_q) * (q - p));
    }
    polygon = std::move(kept);
  }
  double twice = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    twice += Extrusion::cross(polygon[i - 1] - polygon[0], polygon[i] - polygon[0]);
  return twice / 2;
}

/// The intersection of two extrusions along z.
struct InCommon {
  double volume = 0;
  double area = 0;  ///< of faces on each other, where the volume is 0
};

inline InCommon in_common(const Extrusion& a, const Extrusion& b) {
  const auto corners = [](const Extrusion& of, const std::array<std::uint32_t, 3>& t) {
    return std::array{of.points[t[0]], of.points[t[1]], of.points[t[2]]};
  };
  double area = 0, size = 0;
  for (const Extrusion* of : {&a, &b})
    for (const auto& p : of->points) size = std::max(size, p.lpNorm<Eigen::Infinity>());
  for (const auto& t : a.cap)
    for (const auto& s : b.cap) area += common_area(corners(a, t), corners(b, s));
  const double height = std::min(a.high, b.high) - std::max(a.low, b.low);
  const double rounding = 1e-13 * (size + std::abs(a.high) + std::abs(b.high));
  if (height < -rounding) return {};
  if (height <= rounding) return {0, area};
  if (area > rounding * size) return {area * height, 0};
  double length = 0;  // of walls on each other
  for (const auto& loop : a.outline)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Extrusion::Point from = a.points[loop[i]], to = a.points[loop[(i + 1) % loop.size()]];
      const double whole = (to - from).norm();
      const Extrusion::Point along = (to - from) / whole;
      for (const auto& other : b.outline)
        for (std::size_t k = 0; k < other.size(); ++k) {
          const Extrusion::Point p = b.points[other[k]] - from,
                                 q = b.points[other[(k + 1) % other.size()]] - from;
          if (std::abs(Extrusion::cross(along, p)) > rounding ||
              std::abs(Extrusion::cross(along, q)) > rounding)
            continue;
          length += std::max(0.0, std::min(whole, along.dot(p)) - std::max(0.0, along.dot(q)));
        }
    }
  return {0, length * height};
}

/// Two extrusions mated, A where it is.
struct Mate {
  const char* kind = "";
  Extrusion a, b;             ///< each in its own frame
  Eigen::Quaterniond q;       ///< turns B
  Extrusion b_turned;         ///< B after that
  Eigen::Vector3d t;          ///< and then moves it
  Eigen::Vector3d direction;  ///< unit: off A's face, or across the axis
  bool copy = false;          ///< B is A's like
  bool parts = false;         ///< any displacement along `direction` separates them
};

class RandomMates {
 public:
  explicit RandomMates(std::uint64_t seed) : random_(seed) {}

  Mate next(std::uint32_t most_corners) {
    using Eigen::Vector3d;
    Mate mate;
    const auto turn = [&](bool flip, double degrees) {
      mate.q = Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vector3d::UnitZ());
      if (flip) mate.q = mate.q * Eigen::Quaterniond(0, 1, 0, 0);
      mate.b_turned = mate.b.turned(flip, degrees);
    };
    const double fifteens = one_in(3) ? 0 : one_in(2) ? 90.0 * whole(0, 3) : 15.0 * whole(0, 23);
    const auto corners = static_cast<std::uint32_t>(whole(3, static_cast<int>(most_corners)));
    switch (whole(0, 5)) {
      case 0: {
        mate.kind = "face on face";
        mate.a = any(corners);
        mate.copy = one_in(3);
        mate.b = mate.copy ? mate.a : any(static_cast<std::uint32_t>(whole(3, int(most_corners))));
        turn(one_in(2), fifteens);
        mate.t = {one_in(2) ? 0 : length() - 1, one_in(2) ? 0 : length() - 1,
                  mate.a.high - mate.b_turned.low};
        mate.direction = Vector3d::UnitZ();
        mate.parts = true;
        break;
      }
      case 1: {
        mate.kind = "pin in its hole";
        const double hole = length();
        mate.a = Extrusion::tube(corners, hole + length(), hole, 0, length());
        mate.b = Extrusion::prism(corners, hole, 0, one_in(2) ? mate.a.high : length());
        // In its corners, or across them.
        turn(one_in(3), one_in(2) ? fifteens : 360.0 / corners * whole(0, int(corners)));
        mate.t = {0, 0, one_in(2) ? -mate.b_turned.low : mate.a.high / 2 - mate.b_turned.low};
        mate.direction = across();
        break;
      }
      case 2: {
        mate.kind = "in place";
        mate.a = any(corners);
        mate.b = mate.a;
        mate.copy = true;
        const bool flip = one_in(3);
        turn(flip, fifteens);
        mate.t = {0, 0, mate.a.low - mate.b_turned.low};
        mate.direction = one_in(2) ? Vector3d(Vector3d::UnitZ()) : across();
        break;
      }
      case 3: {
        mate.kind = "side by side";
        mate.a = Extrusion::rectangle(length(), length(), length());
        mate.copy = one_in(2);
        mate.b = mate.copy ? mate.a : Extrusion::rectangle(length(), length(), length());
        turn(one_in(2), 90.0 * whole(0, 3));
        const auto right = [](const Extrusion& of) {
          double x = 0;
          for (const auto& p : of.points) x = std::max(x, p.x());
          return x;
        };
        mate.t = {right(mate.a) + right(mate.b_turned), one_in(2) ? 0 : (length() - 1) / 4,
                  one_in(2) ? 0 : (length() - 1) / 4};
        mate.direction = Vector3d::UnitX();
        mate.parts = true;
        break;
      }
      case 4: {
        mate.kind = "in a channel";
        const double width = length(), depth = length();
        mate.a = Extrusion::channel(width, depth, length() / 2, 0, length());
        mate.b = Extrusion::rectangle(width, one_in(2) ? depth : length(), length());
        turn(one_in(2), one_in(2) ? 180 : 0);
        mate.t = {0, (mate.b.points[2].y() - mate.b.points[1].y()) / 2,
                  one_in(2) ? -mate.b_turned.low : length() / 2};
        mate.direction = Vector3d::UnitY();
        break;
      }
      default: {
        mate.kind = "a box turned on end";
        mate.a = any(corners);
        const Vector3d edges(length(), length(), length());
        mate.b = Extrusion::rectangle(edges.x(), edges.y(), edges.z());
        const double half = std::sqrt(0.5);
        mate.q = Eigen::AngleAxisd(90.0 * whole(0, 3) * std::numbers::pi / 180, Vector3d::UnitZ()) *
                 (one_in(2) ? Eigen::Quaterniond(half, half, 0, 0)
                            : Eigen::Quaterniond(half, 0, half, 0));
        const Vector3d after = (mate.q * edges).cwiseAbs();
        mate.b_turned = Extrusion::rectangle(after.x(), after.y(), after.z());
        mate.t = {one_in(2) ? 0 : length() - 1, 0, mate.a.high - mate.b_turned.low};
        mate.direction = Vector3d::UnitZ();
        mate.parts = true;
      }
    }
    return mate;
  }

  bool one_in(int n) { return whole(1, n) == 1; }
  int whole(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }
  std::mt19937_64& random() { return random_; }

 private:
  /// 0.5 … 2, of few digits or of all.
  double length() {
    return one_in(2) ? whole(2, 8) / 4.0 : std::uniform_real_distribution<double>(0.5, 2)(random_);
  }
  Eigen::Vector3d across() {
    if (one_in(2)) return Eigen::Vector3d::UnitX();
    const double angle = whole(0, 23) * std::numbers::pi / 12;
    return {std::cos(angle), std::sin(angle), 0};
  }
  Extrusion any(std::uint32_t corners) {
    const double radius = length(), low = one_in(2) ? 0 : -length(), high = length();
    switch (whole(0, 3)) {
      case 0:
        return Extrusion::rectangle(length(), length(), length());
      case 1:
        return Extrusion::fan(corners, radius, radius * whole(1, 3) / 4.0, low, high);
      case 2:
        return Extrusion::tube(corners, radius, radius * whole(1, 3) / 4.0, low, high);
      default:
        return Extrusion::prism(corners, radius, low, high);
    }
  }

  std::mt19937_64 random_;
};

}  // namespace ist::testing
