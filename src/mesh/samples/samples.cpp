#include "mesh/samples/samples.h"

#include <ist/mesh.h>
#include <ist/types.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace ist::shapes {
namespace {

/// A closed ring of vertices, counter-clockwise seen from +z (or along the direction of the sweep).
using Ring = std::vector<std::uint32_t>;

/// Builds meshes from rings. Coordinates are rounded to multiples of 2^-30, so that a sample does
/// not depend on the last bit of the platform's sin and cos.
class MeshBuilder {
 public:
  std::uint32_t vertex(double x, double y, double z) {
    mesh_.vertices.emplace_back(snap(x), snap(y), snap(z));
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh_.triangles.push_back({a, b, c});
  }

  /// A ring of `n` vertices about the z axis; `radius(i)` is the radius of the i-th.
  template <class Radius>
  Ring ring(std::size_t n, double z, Radius radius) {
    Ring result(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n);
      result[i] = vertex(radius(i) * std::cos(angle), radius(i) * std::sin(angle), z);
    }
    return result;
  }

  /// A wall between two rings of equal length, outward if `upper` follows `lower` along +z.
  void wall(const Ring& lower, const Ring& upper) {
    for (std::size_t i = 0, n = lower.size(); i < n; ++i) {
      const std::size_t j = (i + 1) % n;
      triangle(lower[i], lower[j], upper[j]);
      triangle(lower[i], upper[j], upper[i]);
    }
  }

  /// A cap from a ring to its apex, facing +z.
  void cap_up(const Ring& ring, std::uint32_t apex) {
    for (std::size_t i = 0, n = ring.size(); i < n; ++i) triangle(apex, ring[i], ring[(i + 1) % n]);
  }

  /// A cap from a ring to its apex, facing −z.
  void cap_down(const Ring& ring, std::uint32_t apex) {
    for (std::size_t i = 0, n = ring.size(); i < n; ++i) triangle(apex, ring[(i + 1) % n], ring[i]);
  }

  const Eigen::Vector3d& operator[](std::uint32_t v) const { return mesh_.vertices[v]; }
  TriangleMesh take() { return std::move(mesh_); }

 private:
  static double snap(double x) { return std::nearbyint(x * 0x1p30) * 0x1p-30; }

  TriangleMesh mesh_;
};

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

// A thread is the surface r = profile(z / pitch − θ / 2π) about the z axis. It is cut into columns
// at fixed θ; a column has a vertex at every corner of the profile, so that the mesh's edges run
// along the helix, and one at each end of the thread.

constexpr std::size_t kColumns = 60;  // a multiple of six: every corner of a hexagon has a column
constexpr double kHexagon = 7.5;      // half the width across flats

/// Fractions of a pitch at the profile's corners: root, flank, crest, flank.
constexpr std::array kCorners = {0.1, 0.5, 0.6, 1.0};

double profile(double turns) {
  const double u = turns - std::floor(turns);
  if (u < kCorners[0]) return kThreadMinor;
  const double up = (u - kCorners[0]) / (kCorners[1] - kCorners[0]);
  const double down = (kCorners[3] - u) / (kCorners[3] - kCorners[2]);
  return kThreadMinor + (kThreadMajor - kThreadMinor) * std::min({1.0, up, down});
}

double hexagon(std::size_t i) {
  constexpr std::size_t kSide = kColumns / 6;
  const double angle = std::numbers::pi / 3 * (static_cast<double>(i % kSide) / kSide - 0.5);
  return kHexagon / std::cos(angle);
}

struct Column {
  std::vector<double> z;
  std::vector<std::uint32_t> vertex;
};

Column add_column(MeshBuilder& builder, std::size_t i, double bottom, double top,
                  double clearance) {
  constexpr double kTolerance = 1e-6;  // a corner this close to an end is merged with it
  const double turn = static_cast<double>(i) / kColumns;
  Column column;
  const auto add = [&](double z) {
    const double r = profile(z / kThreadPitch - turn + 1e-12) + clearance;
    const double angle = 2 * std::numbers::pi * turn;
    column.z.push_back(z);
    column.vertex.push_back(builder.vertex(r * std::cos(angle), r * std::sin(angle), z));
  };
  add(bottom);
  for (double k = std::floor(bottom / kThreadPitch) - 2; k * kThreadPitch < top; ++k)
    for (const double corner : kCorners) {
      const double z = kThreadPitch * (k + corner + turn);
      if (z > bottom + kTolerance && z < top - kTolerance) add(z);
    }
  add(top);
  return column;
}

/// Adds a thread's wall between two heights; returns its lower and upper ring.
std::pair<Ring, Ring> add_thread(MeshBuilder& builder, double bottom, double top, double clearance,
                                 bool inward) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < kColumns; ++i)
    columns.push_back(add_column(builder, i, bottom, top, clearance));

  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    inward ? builder.triangle(a, c, b) : builder.triangle(a, b, c);
  };
  std::pair<Ring, Ring> rings;
  for (std::size_t i = 0; i < kColumns; ++i) {
    const Column& left = columns[i];
    const Column& right = columns[(i + 1) % kColumns];
    rings.first.push_back(left.vertex.front());
    rings.second.push_back(left.vertex.back());
    // Advances along both columns; the step goes to the side whose next vertex comes first along
    // the thread. The right column is 1/kColumns of a turn ahead.
    std::size_t a = 0, b = 0;
    while (a + 1 < left.z.size() || b + 1 < right.z.size()) {
      const bool left_done = a + 1 == left.z.size();
      const bool right_done = b + 1 == right.z.size();
      if (right_done ||
          (!left_done && left.z[a + 1] < right.z[b + 1] - kThreadPitch / kColumns + 1e-9)) {
        triangle(left.vertex[a], right.vertex[b], left.vertex[a + 1]);
        ++a;
      } else {
        triangle(left.vertex[a], right.vertex[b], right.vertex[b + 1]);
        ++b;
      }
    }
  }
  return rings;
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

TriangleMesh bolt() {
  constexpr double kThreadLength = 16, kHeadHeight = 5;
  MeshBuilder builder;
  const auto [tip, neck] = add_thread(builder, 0, kThreadLength, 0, false);
  const Ring head_low = builder.ring(kColumns, kThreadLength, hexagon);
  const Ring head_high = builder.ring(kColumns, kThreadLength + kHeadHeight, hexagon);
  builder.cap_down(tip, builder.vertex(0, 0, 0));
  builder.wall(neck, head_low);
  builder.wall(head_low, head_high);
  builder.cap_up(head_high, builder.vertex(0, 0, kThreadLength + kHeadHeight));
  return builder.take();
}

TriangleMesh nut() {
  constexpr double kHalfHeight = 4;
  MeshBuilder builder;
  const auto [bore_low, bore_high] =
      add_thread(builder, -kHalfHeight, kHalfHeight, kThreadClearance, true);
  const Ring low = builder.ring(kColumns, -kHalfHeight, hexagon);
  const Ring high = builder.ring(kColumns, kHalfHeight, hexagon);
  builder.wall(bore_low, low);
  builder.wall(low, high);
  builder.wall(high, bore_high);
  return builder.take();
}

}  // namespace ist::shapes

namespace ist {
namespace {

constexpr std::array kSamples = {
    Sample{"gear", "spur gear of 16 teeth with a bore", shapes::gear},
    Sample{"bolt", "hexagon bolt with a helical thread; the nut fits it", shapes::bolt},
    Sample{"nut", "hexagon nut with the bolt's thread", shapes::nut},
    Sample{"torus_knot", "tube along a trefoil", shapes::torus_knot},
    Sample{"cube", "unit cube, 12 triangles",
           [] {
             return shapes::box({0.5, 0.5, 0.5});
           }},
    Sample{"slab", "flat box of 4 x 3 x 0.25",
           [] {
             return shapes::box({2, 1.5, 0.125});
           }},
    Sample{"sphere", "unit ball, 5,120 triangles", [] { return shapes::sphere(1, 4); }},
    Sample{"hollow_sphere", "shell between the radii 0.9 and 1: two surfaces, one cavity",
           [] { return shapes::hollow_sphere(1, 0.9, 4); }},
    Sample{"torus", "ring of radius 1, tube of 0.35", [] { return shapes::torus(1, 0.35); }},
    Sample{"cylinder", "radius 1, height 2", [] { return shapes::cylinder(1, 2); }},
    Sample{"capsule", "radius 0.5, 2 between the centres", [] { return shapes::capsule(0.5, 2); }},
};

}  // namespace

std::span<const Sample> samples() { return kSamples; }

TriangleMesh make_sample(std::string_view name) {
  std::string names;
  for (const Sample& sample : kSamples) {
    if (name == sample.name) return sample.make();
    names += std::string(names.empty() ? "" : ", ") + sample.name;
  }
  throw Error("no sample is called '" + std::string(name) + "'; there are " + names);
}

}  // namespace ist
