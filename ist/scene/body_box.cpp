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

std::optional<BodyBox::Turned> BodyBox::of(const Shape& field) noexcept {
  const auto around = [](double x, double y, double z) {
    return Turned{Eigen::Vector3d::Zero(), {x, y, z}};
  };
  if (const auto* box = std::get_if<BoxShape>(&field)) return Turned{{0, 0, 0}, box->half_extents};
  if (const auto* ball = std::get_if<BallShape>(&field))
    return around(ball->radius, ball->radius, ball->radius);
  if (const auto* capsule = std::get_if<CapsuleShape>(&field))
    return around(capsule->radius, capsule->radius, capsule->radius + capsule->half_height);
  if (const auto* cylinder = std::get_if<CylinderShape>(&field))
    return around(cylinder->radius, cylinder->radius, cylinder->half_height);
  if (const auto* grid = std::get_if<DistanceGridShape>(&field)) {
    const Eigen::Vector3d half =
        grid->spacing / 2 *
        Eigen::Vector3d(grid->size[0] - 1.0, grid->size[1] - 1.0, grid->size[2] - 1.0);
    return Turned{grid->origin + half, half};
  }
  return std::nullopt;
}

BodyBox::BodyBox(const PlacedSolid& solid) noexcept {
  double error = 0;  // of the mesh
  if (const auto* tree = std::get_if<PlacedAsset>(&solid.placed)) {
    const Bounds own = bounds(tree->asset);
    box_ = Turned{(own.lower + own.upper) / 2, (own.upper - own.lower) / 2};
    scale_ = tree->scale;
    sticks_out_ = tree->scale * tree->asset.protrusion();
    error = tree->scale * tree->asset.mesh_error();
    empty_ = tree->asset.empty();
  } else {
    const auto& field = std::get<PlacedShape>(solid.placed);
    box_ = of(field.shape);
    scale_ = field.scale;
  }
  if (!box_) return;
  box_->middle *= scale_;
  box_->half *= scale_;
  // As time_of_impact() has it: of the smaller solid, or of the errors of both.
  tolerance_ = std::max(1e-3 * box_->half.norm(), 10 * error);
}

PlacedBox BodyBox::placed(const Pose& pose, const BoxWidths& widths,
                          const Motion& motion) const noexcept {
  const auto rotation = usable_rotation(pose, scale_);
  if (!rotation || empty_) return {};
  if (!box_) return {Place::endless};
  const Eigen::Matrix3d turn = rotation->toRotationMatrix();
  const Eigen::Vector3d middle = turn * box_->middle + vector(pose.t);
  const double wider =
      widths.margin + (widths.by_spheres ? sticks_out_ : 0) + (widths.by_size ? tolerance_ : 0);
  const Eigen::Vector3d half = turn.cwiseAbs() * box_->half + Eigen::Vector3d::Constant(wider);
  Eigen::Vector3d low = middle - half, high = middle + half;
  if (widths.duration > 0) {
    if (!motion.velocity.allFinite() || !motion.angular_velocity.allFinite() ||
        !motion.about.allFinite() || !low.allFinite())
      return {};
    // A point that turns about another goes no further than the arc, nor than twice its distance.
    const Eigen::Vector3d far = (box_->middle - scale_ * motion.about).cwiseAbs() + box_->half;
    const double angle = motion.angular_velocity.norm() * widths.duration;
    const double turned = (1 + 1e-12) * std::min(angle, 2.0) * far.norm();
    const Eigen::Vector3d way = motion.velocity * widths.duration;
    for (int k = 0; k < 3; ++k) {
      low[k] += std::min(way[k], 0.0) - turned;
      high[k] += std::max(way[k], 0.0) + turned;
    }
  }
  constexpr double kMost = 1e37;  // boxes are of floats
  if (!low.allFinite() || !high.allFinite() ||
      std::max(low.cwiseAbs().maxCoeff(), high.cwiseAbs().maxCoeff()) > kMost)
    return {};
  return {Place::tree, box_around(low, high)};
}

}  // namespace ist
