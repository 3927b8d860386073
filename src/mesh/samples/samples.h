#pragma once

#include <ist/mesh.h>
#include <span>
#include <string_view>

namespace ist {

/// A closed mesh that is generated: outward, without self-intersections. Lengths are [u]; every
/// sample is a few units across.
struct Sample {
  const char* name;
  const char* description;
  TriangleMesh (*make)();
};

/// All samples, in the order in which they are listed to a user.
std::span<const Sample> samples();

/// The mesh of a sample. Throws Error that lists the valid names.
TriangleMesh make_sample(std::string_view name);

// The dimensions of the bolt and the nut, for turning one in the other. Both are on the z axis: the
// bolt's thread from z = 0 to 16, the nut from −4 to 4. The nut fits wherever it is moved by t
// along z and rotated by 2π t / kThreadPitch about it, and collides half a pitch off.
inline constexpr double kThreadPitch = 2.0;  ///< [u] along z per turn, right-handed
inline constexpr double kThreadMajor = 5.0;  ///< [u] radius of the bolt's crests
inline constexpr double kThreadMinor = 4.0;  ///< [u] radius of the bolt's roots
inline constexpr double kThreadClearance =
    0.15;  ///< [u] the nut's thread is wider by this, radially

}  // namespace ist

// One function per sample; samples.cpp lists them for the user.
namespace ist::shapes {

TriangleMesh box(const Eigen::Vector3d& half_extent);
TriangleMesh sphere(double radius, int subdivisions);
TriangleMesh hollow_sphere(double outer, double inner, int subdivisions);
TriangleMesh cylinder(double radius, double height);
TriangleMesh capsule(double radius, double height);  ///< `height` between the two centres
TriangleMesh torus(double major, double minor);
TriangleMesh torus_knot();
TriangleMesh gear();
TriangleMesh bolt();
TriangleMesh nut();

}  // namespace ist::shapes
