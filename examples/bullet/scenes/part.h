#pragma once

#include <btBulletDynamicsCommon.h>
#include <ist/bake.h>
#include <ist/mesh.h>

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "ist_shape.h"

/// A solid as every way of collision wants it: mesh, asset, and its mass at density 1.
class Part {
 public:
  /// Bakes on the CPU. Throws ist::Error.
  Part(const std::string& name, ist::TriangleMesh mesh, std::size_t spheres);

  const std::string& name() const { return name_; }
  const ist::TriangleMesh& mesh() const { return mesh_; }
  const ist::TreeView& tree() const { return asset_->view(); }
  double volume() const { return volume_; }  ///< [u³]

  /// Bullet's body frame in the mesh's: at the centre of mass, along principal axes. One axis each
  /// where the inertia is diagonal already.
  const Eigen::Isometry3d& body_frame() const { return body_frame_; }
  const Eigen::Vector3d& unit_inertia() const { return unit_inertia_; }  ///< [u²] of a mass of 1
  const Eigen::Vector3d& bounds_min() const { return bounds_.min(); }    ///< [u] mesh frame
  const Eigen::Vector3d& bounds_max() const { return bounds_.max(); }

  /// The mesh's vertices in the body's frame.
  std::vector<Eigen::Vector3d> vertices_in_body() const;

  std::unique_ptr<IstShape> make_ist_shape() const;

 private:
  std::string name_;
  ist::TriangleMesh mesh_;
  std::unique_ptr<ist::Asset> asset_;
  double volume_ = 0;
  Eigen::Isometry3d body_frame_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d unit_inertia_ = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d bounds_;
};
