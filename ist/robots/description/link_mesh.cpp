#include "robots/description/link_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <ist/types.h>

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

ShapeMesh capsule_mesh(const CoverCapsule& capsule) {
  constexpr std::uint32_t kRings = 24, kAround = 48;  // without poles; two are the equator
  // the most that a facet spans in both directions
  const double across = std::numbers::pi / kRings;
  const double radius = capsule.radius / std::cos(0.75 * across);
  const Vector3d axis = capsule.end - capsule.begin;
  const bool ball = axis.isZero(0);
  const Eigen::Matrix3d turn = turn_from_z(ball ? Vector3d::UnitZ() : axis).toRotationMatrix();
  ShapeMesh out;
  out.slack = radius - capsule.radius;
  TriangleMesh& mesh = out.mesh;
  const auto add = [&](double down, double around, bool end) {
    mesh.vertices.push_back(
        (end ? capsule.end : capsule.begin) +
        turn * (radius * Vector3d(std::sin(down) * std::cos(around),
                                  std::sin(down) * std::sin(around), -std::cos(down))));
  };
  add(0, 0, false);
  add(std::numbers::pi, 0, true);
  std::uint32_t rings = 0;
  const auto add_ring = [&](std::uint32_t ring, bool end) {
    for (std::uint32_t i = 0; i < kAround; ++i)
      add(across * ring, 2 * std::numbers::pi * i / kAround, end);
    ++rings;
  };
  for (std::uint32_t ring = 1; ring <= kRings / 2; ++ring) add_ring(ring, false);
  for (std::uint32_t ring = kRings / 2 + (ball ? 1 : 0); ring < kRings; ++ring)
    add_ring(ring, true);
  const auto at = [](std::uint32_t ring, std::uint32_t i) {
    return 2 + ring * kAround + i % kAround;
  };
  for (std::uint32_t i = 0; i < kAround; ++i) {
    mesh.triangles.push_back({0, at(0, i + 1), at(0, i)});
    mesh.triangles.push_back({1, at(rings - 1, i), at(rings - 1, i + 1)});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i + 1)});
      mesh.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring + 1, i)});
    }
  }
  return out;
}

void append_mesh(TriangleMesh& mesh, const TriangleMesh& more) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), more.vertices.begin(), more.vertices.end());
  for (const auto& t : more.triangles)
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  mesh.notes.insert(mesh.notes.end(), more.notes.begin(), more.notes.end());
}

ShapeMesh mesh_of(const PlacedLinkShape& placed, const PackagePaths& paths,
                  const std::string& file) {
  ShapeMesh out;
  try {
    if (const auto* mesh = std::get_if<LinkMesh>(&placed.shape)) {
      out.mesh = scaled_mesh(*mesh, paths);
    } else if (const auto* box = std::get_if<LinkBox>(&placed.shape)) {
      out.mesh = box_mesh(box->half_extents);
    } else if (const auto* cylinder = std::get_if<LinkCylinder>(&placed.shape)) {
      out = cylinder_mesh(*cylinder);
    } else if (const auto* capsule = std::get_if<LinkCapsule>(&placed.shape)) {
      const Vector3d end(0, 0, capsule->half_height);
      out = capsule_mesh({-end, end, capsule->radius});
    } else if (const auto* ellipsoid = std::get_if<LinkEllipsoid>(&placed.shape)) {
      out = capsule_mesh({Vector3d::Zero(), Vector3d::Zero(), 1});
      scale_mesh(out.mesh, ellipsoid->radii);
      out.slack *= ellipsoid->radii.maxCoeff();
    } else {
      throw Error("a sphere has no mesh");
    }
  } catch (const Error& error) {
    const std::string line = placed.line == 0 ? "" : "line " + std::to_string(placed.line) + ": ";
    throw Error(file + ": " + line + error.what());
  }
  const Eigen::Matrix3d turn = placed.rotation.toRotationMatrix();
  const bool turned = !placed.rotation.isApprox(Eigen::Quaterniond::Identity(), 0);
  for (Vector3d& v : out.mesh.vertices) v = (turned ? Vector3d(turn * v) : v) + placed.translation;
  return out;
}

LinkGeometry geometry_of(std::span<const PlacedLinkShape> shapes, const PackagePaths& paths,
                         const std::string& file) {
  LinkGeometry out;
  for (const PlacedLinkShape& placed : shapes) {
    if (const auto* ball = std::get_if<LinkBall>(&placed.shape)) {
      out.spheres.push_back({placed.translation, ball->radius});
      continue;
    }
    const ShapeMesh one = mesh_of(placed, paths, file);
    append_mesh(out.mesh, one.mesh);
    out.slack = std::max(out.slack, one.slack);
  }
  return out;
}

}  // namespace ist
