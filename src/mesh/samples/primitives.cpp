#include <algorithm>
#include <map>
#include <utility>

#include "mesh/samples/mesh_builder.h"
#include "mesh/samples/shapes.h"

namespace ist::shapes {
namespace {

constexpr std::size_t kSegments = 96;  // around an axis

/// Adds a geodesic sphere: an icosahedron whose triangles are split in four, `subdivisions` times.
void add_sphere(MeshBuilder& builder, double radius, int subdivisions, bool inward) {
  const double golden = std::numbers::phi;
  const auto add = [&](const Eigen::Vector3d& direction) {
    const Eigen::Vector3d p = radius * direction.normalized();
    return builder.vertex(p.x(), p.y(), p.z());
  };
  std::vector<std::uint32_t> corner;
  for (const auto& [x, y, z] : {std::array{-1.0, golden, 0.0},
                                {1.0, golden, 0.0},
                                {-1.0, -golden, 0.0},
                                {1.0, -golden, 0.0},
                                {0.0, -1.0, golden},
                                {0.0, 1.0, golden},
                                {0.0, -1.0, -golden},
                                {0.0, 1.0, -golden},
                                {golden, 0.0, -1.0},
                                {golden, 0.0, 1.0},
                                {-golden, 0.0, -1.0},
                                {-golden, 0.0, 1.0}})
    corner.push_back(add({x, y, z}));
  std::vector<std::array<std::uint32_t, 3>> faces = {
      {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
      {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
      {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (auto& face : faces)
    for (auto& v : face) v = corner[v];

  for (int level = 0; level < subdivisions; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [it, fresh] = middles.try_emplace(std::minmax(a, b));
      if (fresh) it->second = add(builder[a] + builder[b]);
      return it->second;
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : faces) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    faces = std::move(finer);
  }
  for (const auto& [a, b, c] : faces)
    inward ? builder.triangle(a, c, b) : builder.triangle(a, b, c);
}

/// A surface of revolution about z through the (radius, z) points of a profile that runs upwards
/// from the lower pole to the upper one; both poles are added.
TriangleMesh revolve(const std::vector<std::pair<double, double>>& profile, double bottom,
                     double top) {
  MeshBuilder builder;
  std::vector<Ring> rings;
  rings.reserve(profile.size());
  for (const auto& [radius, z] : profile)
    rings.push_back(builder.ring(kSegments, z, [r = radius](std::size_t) { return r; }));
  for (std::size_t k = 0; k + 1 < rings.size(); ++k) builder.wall(rings[k], rings[k + 1]);
  builder.cap_down(rings.front(), builder.vertex(0, 0, bottom));
  builder.cap_up(rings.back(), builder.vertex(0, 0, top));
  return builder.take();
}

}  // namespace

TriangleMesh box(const Eigen::Vector3d& half_extent) {
  MeshBuilder builder;
  for (int i = 0; i < 8; ++i)
    builder.vertex((i & 1 ? 1 : -1) * half_extent.x(), (i & 2 ? 1 : -1) * half_extent.y(),
                   (i & 4 ? 1 : -1) * half_extent.z());
  const auto quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    builder.triangle(a, b, c);
    builder.triangle(a, c, d);
  };
  quad(0, 2, 3, 1);  // −z
  quad(4, 5, 7, 6);  // +z
  quad(0, 1, 5, 4);  // −y
  quad(2, 6, 7, 3);  // +y
  quad(0, 4, 6, 2);  // −x
  quad(1, 3, 7, 5);  // +x
  return builder.take();
}

TriangleMesh sphere(double radius, int subdivisions) {
  MeshBuilder builder;
  add_sphere(builder, radius, subdivisions, false);
  return builder.take();
}

TriangleMesh hollow_sphere(double outer, double inner, int subdivisions) {
  MeshBuilder builder;
  add_sphere(builder, outer, subdivisions, false);
  add_sphere(builder, inner, subdivisions, true);
  return builder.take();
}

TriangleMesh cylinder(double radius, double height) {
  return revolve({{radius, -height / 2}, {radius, height / 2}}, -height / 2, height / 2);
}

TriangleMesh capsule(double radius, double height) {
  constexpr int kRings = 16;  // a hemisphere, pole excluded
  std::vector<std::pair<double, double>> profile;
  for (int k = 1; k <= kRings; ++k) {
    const double latitude = std::numbers::pi / 2 * k / kRings;
    profile.emplace_back(radius * std::sin(latitude), -height / 2 - radius * std::cos(latitude));
  }
  for (int k = kRings; k >= 1; --k) {
    const double latitude = std::numbers::pi / 2 * k / kRings;
    profile.emplace_back(radius * std::sin(latitude), height / 2 + radius * std::cos(latitude));
  }
  return revolve(profile, -height / 2 - radius, height / 2 + radius);
}

TriangleMesh torus(double major, double minor) {
  constexpr std::size_t kTube = 48;
  MeshBuilder builder;
  std::vector<Ring> rings;
  for (std::size_t k = 0; k < kTube; ++k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kTube;
    rings.push_back(builder.ring(kSegments, minor * std::sin(angle),
                                 [&](std::size_t) { return major + minor * std::cos(angle); }));
  }
  for (std::size_t k = 0; k < kTube; ++k) builder.wall(rings[k], rings[(k + 1) % kTube]);
  return builder.take();
}

TriangleMesh torus_knot() {
  // The (2, 3) knot: twice around the axis while the tube's core turns three times.
  constexpr std::size_t kAlong = 360, kAround = 24;
  constexpr double kTubeRadius = 0.35;
  const auto core = [](double t) {
    const double r = 2 + std::cos(3 * t);
    return Eigen::Vector3d(r * std::cos(2 * t), r * std::sin(2 * t), -std::sin(3 * t));
  };
  const auto tangent = [](double t) {
    const double r = 2 + std::cos(3 * t), dr = -3 * std::sin(3 * t);
    return Eigen::Vector3d(dr * std::cos(2 * t) - 2 * r * std::sin(2 * t),
                           dr * std::sin(2 * t) + 2 * r * std::cos(2 * t), -3 * std::cos(3 * t))
        .normalized();
  };
  MeshBuilder builder;
  std::vector<Ring> rings;
  for (std::size_t i = 0; i < kAlong; ++i) {
    const double t = 2 * std::numbers::pi * static_cast<double>(i) / kAlong;
    // The normal of the torus that carries the knot: periodic, never along the tangent.
    const Eigen::Vector3d u(std::cos(3 * t) * std::cos(2 * t), std::cos(3 * t) * std::sin(2 * t),
                            -std::sin(3 * t));
    const Eigen::Vector3d v = tangent(t).cross(u);
    Ring ring(kAround);
    for (std::size_t k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kAround;
      const Eigen::Vector3d p = core(t) + kTubeRadius * (std::cos(angle) * u + std::sin(angle) * v);
      ring[k] = builder.vertex(p.x(), p.y(), p.z());
    }
    rings.push_back(std::move(ring));
  }
  for (std::size_t i = 0; i < kAlong; ++i) builder.wall(rings[i], rings[(i + 1) % kAlong]);
  return builder.take();
}

/// A toothed disc: both faces are flat rings between the bore and the teeth, so every vertex of the
/// outline has a partner on the bore at the same angle.
TriangleMesh gear() {
  constexpr std::size_t kTeeth = 16, kSteps = 12;  // vertices a tooth
  constexpr double kRoot = 4.0, kTip = 5.0, kBore = 1.5, kHalfWidth = 0.8;
  // A trapezium: root, flank up, tip, flank down, by fractions of the tooth's angle.
  const auto outline = [](std::size_t i) {
    const double u = static_cast<double>(i % kSteps) / kSteps;
    const double height =
        std::min({1.0, std::max(0.0, (u - 0.25) * 6), std::max(0.0, (1 - u) * 6)});
    return kRoot + (kTip - kRoot) * height;
  };
  const auto bore = [](std::size_t) { return kBore; };
  constexpr std::size_t kCount = kTeeth * kSteps;

  MeshBuilder builder;
  const Ring inner_low = builder.ring(kCount, -kHalfWidth, bore);
  const Ring outer_low = builder.ring(kCount, -kHalfWidth, outline);
  const Ring outer_high = builder.ring(kCount, kHalfWidth, outline);
  const Ring inner_high = builder.ring(kCount, kHalfWidth, bore);
  builder.wall(inner_low, outer_low);
  builder.wall(outer_low, outer_high);
  builder.wall(outer_high, inner_high);
  builder.wall(inner_high, inner_low);
  return builder.take();
}

}  // namespace ist::shapes
