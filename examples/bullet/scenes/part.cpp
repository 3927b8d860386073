#include "part.h"

Part::Part(const std::string& name, ist::TriangleMesh mesh, std::size_t spheres)
    : name_(name), mesh_(std::move(mesh)) {
  ist::PackingSettings settings;
  settings.max_spheres = spheres;
  settings.device = ist::Device::cpu;
  asset_ = std::make_unique<ist::Asset>(ist::bake(ist::close_mesh(mesh_, name), settings));
  frame_ = ist::bullet::body_frame(tree());
}

std::vector<Eigen::Vector3d> Part::vertices_in_body() const {
  const Eigen::Isometry3d to_body = frame_.in_mesh.inverse();
  std::vector<Eigen::Vector3d> out;
  out.reserve(mesh_.vertices.size());
  for (const Eigen::Vector3d& v : mesh_.vertices) out.push_back(to_body * v);
  return out;
}
