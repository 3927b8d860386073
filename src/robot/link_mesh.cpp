#include "robot/link_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <ist/error.h>

namespace ist {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kSides = 256;  ///< of a prism around a cylinder

TriangleMesh box_mesh(const Vector3d& half) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.emplace_back((i & 1) != 0 ? half.x() : -half.x(),
                               (i & 2) != 0 ? half.y() : -half.y(),
                               (i & 4) != 0 ? half.z() : -half.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

ShapeMesh cylinder_mesh(const LinkCylinder& cylinder) {
  const double widened = (1 + 1e-12) / std::cos(std::numbers::pi / kSides);
  const double radius = cylinder.radius * widened;
  ShapeMesh out;
  out.slack = cylinder.radius * (widened - 1) * (1 + 1e-9);
  TriangleMesh& mesh = out.mesh;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const double a = 2 * std::numbers::pi * i / kSides;
    for (const double z : {-cylinder.half_height, cylinder.half_height})
      mesh.vertices.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
  }
  mesh.vertices.emplace_back(0, 0, -cylinder.half_height);
  mesh.vertices.emplace_back(0, 0, cylinder.half_height);
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const std::uint32_t j = (i + 1) % kSides;
    mesh.triangles.push_back({2 * i, 2 * j, 2 * j + 1});
    mesh.triangles.push_back({2 * i, 2 * j + 1, 2 * i + 1});
    mesh.triangles.push_back({2 * kSides, 2 * j, 2 * i});
    mesh.triangles.push_back({2 * kSides + 1, 2 * i + 1, 2 * j + 1});
  }
  return out;
}

TriangleMesh scaled_mesh(const LinkMesh& shape, const PackagePaths& paths) {
  TriangleMesh mesh = load_mesh(paths.find(shape.file));
  scale_mesh(mesh, shape.scale);
  return mesh;
}

}  // namespace

ShapeMesh mesh_of(const PlacedShape& placed, const PackagePaths& paths, const std::string& file) {
  ShapeMesh out;
  try {
    if (const auto* mesh = std::get_if<LinkMesh>(&placed.shape)) {
      out.mesh = scaled_mesh(*mesh, paths);
    } else if (const auto* box = std::get_if<LinkBox>(&placed.shape)) {
      out.mesh = box_mesh(box->half_extents);
    } else if (const auto* cylinder = std::get_if<LinkCylinder>(&placed.shape)) {
      out = cylinder_mesh(*cylinder);
    } else {
      throw Error("a sphere has no mesh");
    }
  } catch (const Error& error) {
    throw Error(file + ": line " + std::to_string(placed.line) + ": " + error.what());
  }
  const Eigen::Matrix3d turn = placed.rotation.toRotationMatrix();
  const bool turned = !placed.rotation.isApprox(Eigen::Quaterniond::Identity(), 0);
  for (Vector3d& v : out.mesh.vertices) v = (turned ? Vector3d(turn * v) : v) + placed.translation;
  return out;
}

LinkGeometry geometry_of(std::span<const PlacedShape> shapes, const PackagePaths& paths,
                         const std::string& file) {
  LinkGeometry out;
  for (const PlacedShape& placed : shapes) {
    if (const auto* ball = std::get_if<LinkBall>(&placed.shape)) {
      out.spheres.push_back({placed.translation, ball->radius});
      continue;
    }
    const ShapeMesh one = mesh_of(placed, paths, file);
    const auto first = static_cast<std::uint32_t>(out.mesh.vertices.size());
    out.mesh.vertices.insert(out.mesh.vertices.end(), one.mesh.vertices.begin(),
                             one.mesh.vertices.end());
    for (const auto& t : one.mesh.triangles)
      out.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    out.mesh.notes.insert(out.mesh.notes.end(), one.mesh.notes.begin(), one.mesh.notes.end());
    out.slack = std::max(out.slack, one.slack);
  }
  return out;
}

}  // namespace ist
