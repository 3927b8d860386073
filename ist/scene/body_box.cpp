#include "scene/body_box.h"

#include <cmath>

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

PlacedBox BodyBox::placed(const Pose& pose, const BoxWidths& widths,
                          const Motion& motion) const noexcept {
  const Rotation rotation = Rotation::of(pose.q);
  if (!usable(rotation, pose.t, scale_) || box_.empty) return {};
  if (box_.endless) return {Place::endless};
  const double wider =
      widths.margin + (widths.by_spheres ? box_.protrusion : 0) + (widths.by_size ? tolerance_ : 0);
  WorldBox box = box_.placed(rotation, pose.t, wider);
  if (widths.duration > 0) {
    if (!motion.velocity.allFinite() || !motion.angular_velocity.allFinite() ||
        !motion.about.allFinite())
      return {};
    // A point that turns about another goes no further than the arc, nor than twice its distance.
    const Eigen::Vector3d far =
        (vector(box_.middle) - scale_ * motion.about).cwiseAbs() + vector(box_.half);
    const double angle = motion.angular_velocity.norm() * widths.duration;
    const double turned = (1 + 1e-12) * std::min(angle, 2.0) * far.norm();
    const Eigen::Vector3d way = motion.velocity * widths.duration;
    for (int k = 0; k < 3; ++k) {
      box.low[k] += std::min(way[k], 0.0) - turned;
      box.high[k] += std::max(way[k], 0.0) + turned;
    }
  }
  if (!box.fits()) return {};
  PlacedBox out{Place::tree};
  box.write(out.box.low, out.box.high);
  return out;
}

}  // namespace ist
