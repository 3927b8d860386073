#include "scene/body_box.h"

#include "query/base/relative_pose.h"

namespace ist {

BodyBox::BodyBox(const PlacedSolid& solid) noexcept {
  if (const auto* tree = std::get_if<PlacedAsset>(&solid.placed)) {
    box_ = solid_box(tree->asset);
    scale_ = tree->scale;
  } else {
    const auto& field = std::get<PlacedShape>(solid.placed);
    box_ = solid_box(field.shape);
    scale_ = field.scale;
  }
  box_.scale(scale_);
  // As time_of_impact() has it: of the smaller solid, or of the errors of both.
  tolerance_ = std::max(1e-3 * vector(box_.half).norm(), 10 * box_.mesh_error);
}

bool BodyBox::sweep(WorldBox& box, double duration, const Motion& motion) const noexcept {
  if (!motion.velocity.allFinite() || !motion.angular_velocity.allFinite() ||
      !motion.about.allFinite())
    return false;
  // A point that turns about another goes no further than the arc, nor than twice its distance.
  const Eigen::Vector3d far =
      (vector(box_.middle) - scale_ * motion.about).cwiseAbs() + vector(box_.half);
  const double angle = motion.angular_velocity.norm() * duration;
  const double turned = (1 + 1e-12) * std::min(angle, 2.0) * far.norm();
  const Eigen::Vector3d way = motion.velocity * duration;
  for (int k = 0; k < 3; ++k) {
    box.low[k] += std::min(way[k], 0.0) - turned;
    box.high[k] += std::max(way[k], 0.0) + turned;
  }
  return true;
}

}  // namespace ist
