#pragma once

#include <btBulletDynamicsCommon.h>
#include <ist/bake.h>
#include <ist/mesh.h>

#include <ist/bullet/shape.h>
#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

/// A solid as every way of collision wants it.
class Part {
 public:
  /// Bakes on the CPU. Throws ist::Error.
  Part(const std::string& name, ist::TriangleMesh mesh, std::size_t spheres);

  const std::string& name() const { return name_; }
  const ist::TriangleMesh& mesh() const { return mesh_; }
  const ist::AssetView& tree() const { return asset_->view(); }
  double volume() const { return tree().volume(); }  ///< [u³]
  const ist::bullet::BodyFrame& frame() const { return frame_; }

  /// The mesh's vertices in the body's frame.
  std::vector<Eigen::Vector3d> vertices_in_body() const;

 private:
  std::string name_;
  ist::TriangleMesh mesh_;
  std::unique_ptr<ist::Asset> asset_;
  ist::bullet::BodyFrame frame_;
};
