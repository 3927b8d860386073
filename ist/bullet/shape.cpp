#include <ist/bullet/shape.h>

#include <BulletCollision/NarrowPhaseCollision/btRaycastCallback.h>
#include <LinearMath/btAabbUtil2.h>
#include <ist/asset_layout.h>
#include <ist/bullet/contacts.h>
#include <ist/bullet/convert.h>
#include <ist/mass_properties.h>
#include <ist/raycast.h>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <mutex>
#include <set>
#include <string>
#include <utility>

namespace ist::bullet {
namespace {

void print(const char* sentence) { std::fprintf(stderr, "ist::bullet: %s\n", sentence); }

struct Warnings {
  std::mutex mutex;
  WarningHandler handler = print;
  std::set<std::pair<const Contacts*, std::string>> given;
};
Warnings& warnings() {
  static Warnings all;
  return all;
}

}  // namespace

BodyFrame body_frame(const AssetView& tree) {
  const MassProperties mass = mass_properties(tree);
  BodyFrame frame{Eigen::Isometry3d::Identity(), mass.inertia.diagonal() / mass.volume};
  const Eigen::Matrix3d diagonal = mass.inertia.diagonal().asDiagonal();
  if ((mass.inertia - diagonal).norm() > 1e-6 * mass.inertia.norm()) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(mass.inertia);
    Eigen::Matrix3d axes = solver.eigenvectors();
    if (axes.determinant() < 0) axes.col(2) *= -1;
    frame.in_mesh.linear() = axes;
    frame.unit_inertia = solver.eigenvalues() / mass.volume;
  }
  frame.in_mesh.translation() = mass.centre_of_mass;
  return frame;
}

Shape::Shape(const AssetView& tree) : tree_(tree), frame_(body_frame(tree)) {
  m_shapeType = CUSTOM_CONCAVE_SHAPE_TYPE;
  if (tree.sphere_count() == 0) {
    warn("An asset without spheres collides with nothing: bake it with spheres.");
  }
  mesh_in_body_ = to_bullet(Eigen::Isometry3d(frame_.in_mesh.inverse()));
  // Matched spheres protrude from the solid by this much: anything that they meet there is a
  // contact.
  const Bounds box = bounds(tree);
  btTransformAabb(to_bullet(box.lower), to_bullet(box.upper),
                  static_cast<btScalar>(tree.protrusion()), mesh_in_body_, lower_, upper_);
  reach_ = (frame_.in_mesh.inverse() * box.centre).norm() + box.radius + tree.protrusion();
}

void Shape::getAabb(const btTransform& t, btVector3& lower, btVector3& upper) const {
  btTransformAabb(scaling_ * lower_, scaling_ * upper_, 0, t, lower, upper);
}

void Shape::calculateLocalInertia(btScalar mass, btVector3& inertia) const {
  inertia = to_bullet(Eigen::Vector3d(mass * scale_ * scale_ * frame_.unit_inertia));
}

void Shape::setLocalScaling(const btVector3& scaling) {
  const btScalar s = scaling.x();
  const btScalar off = std::max(std::abs(scaling.y() - s), std::abs(scaling.z() - s));
  if (!(s > 0) || !(off <= btScalar(1e-6) * s)) {
    warn(
        "ist::bullet::Shape takes one positive scale for all axes: this scaling is ignored. Bake "
        "the mesh at its size.");
    return;
  }
  mesh_in_body_.setOrigin(to_bullet(Eigen::Vector3d(s * frame_.in_mesh.inverse().translation())));
  scale_ = s;
  scaling_.setValue(s, s, s);
}

void Shape::processAllTriangles(btTriangleCallback* callback, const btVector3& lower,
                                const btVector3& upper) const {
  if (!tree_.has_mesh()) {
    warn("Bullet's rays and sweeps pass through an asset without a mesh: bake it with a mesh.");
    return;
  }
  const AssetHeader& asset = tree_.header();
  const MeshHeader& mesh = *at<MeshHeader>(asset, asset.mesh);
  const double* const vertices = at<double>(asset, mesh.vertices);
  const MeshBlock* const blocks = at<MeshBlock>(asset, mesh.level[0].blocks);
  const Eigen::Vector3d centre(asset.centre);
  const auto placed = [&](std::uint32_t vertex) {
    const Eigen::Vector3d unit(vertices + 3 * std::size_t{vertex});
    return mesh_in_body_ *
           to_bullet(Eigen::Vector3d(scale_ * (std::ldexp(1.0, asset.exponent) * unit + centre)));
  };
  const auto process = [&](std::uint32_t triangle) {
    const MeshBlock& block = blocks[triangle / kWidth];
    btVector3 corners[3];
    for (int k = 0; k < 3; ++k)
      corners[k] = placed(block.vertex[block.corner[k][triangle % kWidth]]);
    if (TestTriangleAgainstAabb2(corners, lower, upper))
      callback->processTriangle(corners, 0, static_cast<int>(triangle));
  };
  // A ray's triangles are found one after another, until a hit is the last relevant one.
  if (auto* const ray = dynamic_cast<btTriangleRaycastCallback*>(callback)) {
    const PlacedAsset mesh_placed{tree_, to_pose(mesh_in_body_), scale_};
    const Eigen::Vector3d from = to_eigen(ray->m_from), along = to_eigen(ray->m_to) - from;
    const double length = along.norm(), past = 1e-9 * (length + reach());
    for (double begin = 0; begin < ray->m_hitFraction * length;) {
      const RayHit hit = raycast(
          mesh_placed, Ray{from + begin / length * along, along, length * (1 + 1e-9) - begin});
      if (!hit.hit()) return;
      process(hit.triangle);
      begin += hit.distance + past;
    }
    return;
  }
  for (std::uint32_t b = 0; b < mesh.level[0].count; ++b) {
    for (int t = 0; t < blocks[b].triangles; ++t)
      process(b * static_cast<std::uint32_t>(kWidth) + static_cast<std::uint32_t>(t));
  }
}

WarningHandler set_warning_handler(WarningHandler handler) {
  const std::lock_guard lock(warnings().mutex);
  const WarningHandler before = warnings().handler;
  warnings().handler = handler != nullptr ? handler : print;
  return before;
}

void warn(const char* sentence, const Contacts* world) {
  WarningHandler handler = nullptr;
  {
    const std::lock_guard lock(warnings().mutex);
    if (!warnings().given.emplace(world, sentence).second) return;
    handler = warnings().handler;
  }
  handler(sentence);
}

Contacts::~Contacts() {
  const std::lock_guard lock(warnings().mutex);
  std::erase_if(warnings().given, [this](const auto& one) { return one.first == this; });
}

}  // namespace ist::bullet
