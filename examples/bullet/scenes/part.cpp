#include "part.h"

#include <Eigen/Eigenvalues>

#include "to_bullet.h"

namespace {

struct Mass {
  double volume = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // of density 1, about the centre
};

Mass mass_of(const ist::TriangleMesh& mesh) {
  Mass mass;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]],
                          &c = mesh.vertices[t[2]];
    const double det = a.dot(b.cross(c));
    const Eigen::Vector3d sum = a + b + c;
    mass.volume += det / 6;
    first += det / 24 * sum;
    second += det / 120 *
              (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  mass.centre = first / mass.volume;
  second -= mass.volume * mass.centre * mass.centre.transpose();
  mass.inertia = second.trace() * Eigen::Matrix3d::Identity() - second;
  return mass;
}

}  // namespace

Part::Part(const std::string& name, ist::TriangleMesh mesh, std::size_t spheres)
    : name_(name), mesh_(std::move(mesh)) {
  ist::PackingSettings settings;
  settings.max_spheres = spheres;
  settings.device = ist::Device::cpu;
  asset_ = std::make_unique<ist::Asset>(ist::bake(ist::close_mesh(mesh_, name), settings));
  const Mass mass = mass_of(mesh_);
  volume_ = mass.volume;
  for (const Eigen::Vector3d& v : mesh_.vertices) bounds_.extend(v);

  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d diagonal = mass.inertia.diagonal().asDiagonal();
  unit_inertia_ = mass.inertia.diagonal() / volume_;
  if ((mass.inertia - diagonal).norm() > 1e-6 * mass.inertia.norm()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(mass.inertia);
    axes = solver.eigenvectors();
    if (axes.determinant() < 0) axes.col(2) *= -1;
    unit_inertia_ = solver.eigenvalues() / volume_;
  }
  body_frame_.linear() = axes;
  body_frame_.translation() = mass.centre;
}

std::vector<Eigen::Vector3d> Part::vertices_in_body() const {
  const Eigen::Isometry3d to_body = body_frame_.inverse();
  std::vector<Eigen::Vector3d> out;
  out.reserve(mesh_.vertices.size());
  for (const Eigen::Vector3d& v : mesh_.vertices) out.push_back(to_body * v);
  return out;
}

std::unique_ptr<IstShape> Part::make_ist_shape() const {
  return std::make_unique<IstShape>(tree(), bounds_, to_bullet(body_frame_.inverse()),
                                    to_bullet(unit_inertia_));
}
