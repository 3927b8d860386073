#pragma once

#include <ist/mesh.h>

// One function a sample; samples.cpp lists them for the user.
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
