#include "scene/body_box.h"

#include <ist/mass_properties.h>

#include <cmath>

#include "query/base/relative_pose.h"

namespace ist {
namespace {

/// A float that is lower, by more than what doubles round.
float float_below(double x) noexcept {
  const auto nearest = static_cast<float>(x);
  return nearest - std::abs(nearest) * 1.2e-7f - 1e-37f;
}

}  // namespace

SceneBox box_around(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) noexcept {
  SceneBox out;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    out.low[i] = float_below(lower[k]);
    out.high[i] = -float_below(-upper[k]);
  }
  return out;
}

std::optional<BodyBox::Turned> BodyBox::of(const Field& field) noexcept {
  const auto around = [](double x, double y, double z) {
    return Turned{Eigen::Vector3d::Zero(), {x, y, z}};
  };
  if (const auto* box = std::get_if<BoxField>(&field)) return Turned{{0, 0, 0}, box->half_extents};
  if (const auto* ball = std::get_if<BallField>(&field))
    return around(ball->radius, ball->radius, ball->radius);
  if (const auto* capsule = std::get_if<CapsuleField>(&field))
    return around(capsule->radius, capsule->radius, capsule->radius + capsule->half_height);
  if (const auto* cylinder = std::get_if<CylinderField>(&field))
    return around(cylinder->radius, cylinder->radius, cylinder->half_height);
  if (const auto* grid = std::get_if<DistanceGridField>(&field)) {
    const Eigen::Vector3d half =
        grid->spacing / 2 *
        Eigen::Vector3d(grid->size[0] - 1.0, grid->size[1] - 1.0, grid->size[2] - 1.0);
    return Turned{grid->origin + half, half};
  }
  if (const auto* mesh = std::get_if<MeshField>(&field)) {
    const Bounds own = bounds(mesh->tree);
    return Turned{(own.lower + own.upper) / 2, (own.upper - own.lower) / 2};
  }
  return std::nullopt;
}

BodyBox::BodyBox(const PlacedSolid& solid) noexcept {
  if (const auto* tree = std::get_if<PlacedTree>(&solid.placed)) {
    const Bounds own = bounds(tree->tree);
    box_ = Turned{(own.lower + own.upper) / 2, (own.upper - own.lower) / 2};
    scale_ = tree->scale;
    sticks_out_ = tree->scale * tree->tree.protrusion();
    empty_ = tree->tree.empty();
  } else {
    const auto& field = std::get<PlacedField>(solid.placed);
    box_ = of(field.field);
    scale_ = field.scale;
  }
  if (!box_) return;
  box_->middle *= scale_;
  box_->half *= scale_;
}

PlacedBox BodyBox::placed(const Pose& pose, double margin, bool by_spheres) const noexcept {
  const auto rotation = usable_rotation(pose, scale_);
  if (!rotation || empty_) return {};
  if (!box_) return {Place::endless};
  const Eigen::Matrix3d turn = rotation->toRotationMatrix();
  const Eigen::Vector3d middle = turn * box_->middle + vector(pose.t);
  const double wider = margin + (by_spheres ? sticks_out_ : 0);
  const Eigen::Vector3d half = turn.cwiseAbs() * box_->half + Eigen::Vector3d::Constant(wider);
  const double farthest = (middle.cwiseAbs() + half).maxCoeff();
  constexpr double kMost = 1e37;  // boxes are of floats
  if (!std::isfinite(farthest) || farthest > kMost) return {};
  return {Place::tree, box_around(middle - half, middle + half)};
}

}  // namespace ist
