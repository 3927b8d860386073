#include "peer_shapes.h"

#include <BulletCollision/CollisionShapes/btShapeHull.h>
#include <BulletCollision/Gimpact/btGImpactShape.h>

#ifdef IST_HAVE_HACD
#include <HACD/hacdHACD.h>
#endif

#include <ist/bullet/convert.h>
#include <algorithm>
#include <cmath>

std::unique_ptr<PeerShape> make_gimpact_shape(const Part& part, double margin) {
  auto peer = std::make_unique<PeerShape>();
  for (const Eigen::Vector3d& v : part.vertices_in_body()) {
    for (int k = 0; k < 3; ++k) peer->coordinates.push_back(v[k]);
  }
  for (const auto& t : part.mesh().triangles) {
    for (const std::uint32_t i : t) peer->indices.push_back(static_cast<int>(i));
  }
  peer->mesh = std::make_unique<btTriangleIndexVertexArray>(
      static_cast<int>(peer->indices.size() / 3), peer->indices.data(),
      static_cast<int>(3 * sizeof(int)), static_cast<int>(peer->coordinates.size() / 3),
      peer->coordinates.data(), static_cast<int>(3 * sizeof(double)));
  auto shape = std::make_unique<btGImpactMeshShape>(peer->mesh.get());
  shape->setMargin(margin);
  shape->updateBound();
  peer->shape = std::move(shape);
  return peer;
}

std::unique_ptr<PeerShape> make_hull_shape(const Part& part, double margin) {
  btConvexHullShape all;
  for (const Eigen::Vector3d& v : part.vertices_in_body())
    all.addPoint(ist::bullet::to_bullet(v), false);
  all.recalcLocalAabb();
  all.setMargin(0);
  btShapeHull hull(&all);
  hull.buildHull(0);
  auto peer = std::make_unique<PeerShape>();
  auto shape = std::make_unique<btConvexHullShape>(
      reinterpret_cast<const btScalar*>(hull.getVertexPointer()), hull.numVertices());
  shape->setMargin(margin);
  peer->shape = std::move(shape);
  return peer;
}

std::unique_ptr<PeerShape> make_own_shape(const Part& part, double margin) {
  const std::vector<Eigen::Vector3d> corners = part.vertices_in_body();
  const Eigen::Vector3d half = corners[0].cwiseAbs();
  const bool is_box =
      std::abs(8 * half.prod() - part.volume()) < 1e-9 * part.volume() &&
      std::all_of(corners.begin(), corners.end(), [&](const Eigen::Vector3d& corner) {
        return (corner.cwiseAbs() - half).norm() < 1e-9 * half.norm();
      });
  if (!is_box) return make_hull_shape(part, margin);
  auto peer = std::make_unique<PeerShape>();
  peer->shape = std::make_unique<btBoxShape>(ist::bullet::to_bullet(half));
  return peer;
}

#ifdef IST_HAVE_HACD

bool have_hulls() { return true; }

std::unique_ptr<PeerShape> make_hulls_shape(const Part& part, std::size_t hulls, double margin) {
  std::vector<HACD::Vec3<HACD::Real>> points;
  std::vector<HACD::Vec3<long>> triangles;
  for (const Eigen::Vector3d& v : part.vertices_in_body()) {
    points.emplace_back(v.x(), v.y(), v.z());
  }
  for (const auto& t : part.mesh().triangles) triangles.emplace_back(t[0], t[1], t[2]);
  HACD::HACD hacd;
  hacd.SetPoints(points.data());
  hacd.SetNPoints(points.size());
  hacd.SetTriangles(triangles.data());
  hacd.SetNTriangles(triangles.size());
  hacd.SetCompacityWeight(0.1);
  hacd.SetVolumeWeight(0);
  hacd.SetNClusters(hulls);
  hacd.SetNVerticesPerCH(100);
  hacd.SetConcavity(1);  // of a size of 1,000: a tenth of a per cent
  hacd.SetAddExtraDistPoints(false);
  hacd.SetAddNeighboursDistPoints(false);
  hacd.SetAddFacesPoints(false);
  hacd.Compute();

  auto peer = std::make_unique<PeerShape>();
  auto compound = std::make_unique<btCompoundShape>();
  for (std::size_t c = 0; c < hacd.GetNClusters(); ++c) {
    std::vector<HACD::Vec3<HACD::Real>> corners(hacd.GetNPointsCH(c));
    std::vector<HACD::Vec3<long>> faces(hacd.GetNTrianglesCH(c));
    hacd.GetCH(c, corners.data(), faces.data());
    auto hull = std::make_unique<btConvexHullShape>();
    for (auto& p : corners) hull->addPoint(btVector3(p.X(), p.Y(), p.Z()), false);
    hull->recalcLocalAabb();
    hull->setMargin(margin);
    compound->addChildShape(btTransform::getIdentity(), hull.get());
    peer->children.push_back(std::move(hull));
  }
  peer->shape = std::move(compound);
  return peer;
}

#else

bool have_hulls() { return false; }
std::unique_ptr<PeerShape> make_hulls_shape(const Part&, std::size_t, double) { return nullptr; }

#endif
