#pragma once

#include <ist/query.h>
#include <ist/time_of_impact.h>

#include "query/find_solid_box.h"
#include "scene/box_tree.h"

namespace ist {

/// The place of a body among the others.
enum class Place : std::uint8_t {
  free,     ///< there is no body
  tree,     ///< its box is in a hierarchy
  endless,  ///< it has no box
  refused,  ///< its pose or scale is not usable
};

/// The margins of boxes around solids.
struct BoxWidths {
  double margin = 0;        ///< [u]
  double duration = 0;      ///< [T] of motions that boxes contain
  bool by_spheres = false;  ///< by the protrusion of matched spheres
  bool by_size = false;     ///< by the default tolerance of impacts
};

/// Eight bodies, one per lane: the constant part of their boxes [u], and their poses.
struct alignas(64) BodyBlock {
  static constexpr std::size_t kCount = 8;

  double middle[3][kCount] = {}, half[3][kCount] = {}, wider[kCount] = {};
  double q[4][kCount] = {}, t[3][kCount] = {};

  void set_pose(std::size_t k, const Pose& pose) noexcept {
    for (std::size_t c = 0; c < 4; ++c) q[c][k] = pose.q[c];
    for (std::size_t c = 0; c < 3; ++c) t[c][k] = pose.t[c];
  }
  Pose pose(std::size_t k) const noexcept {
    return {{q[0][k], q[1][k], q[2][k], q[3][k]}, {t[0][k], t[1][k], t[2][k]}};
  }
};

/// Their boxes: the same bits as SolidBox::placed() and WorldBox::write().
struct alignas(64) BlockBoxes {
  float low[3][BodyBlock::kCount], high[3][BodyBlock::kCount];
  std::uint32_t placed = 0;  ///< bit k: the k-th pose is usable and its box fits floats

  SceneBox box(std::size_t k) const noexcept {
    return {{low[0][k], low[1][k], low[2][k]}, {high[0][k], high[1][k], high[2][k]}};
  }
};

/// Writes the boxes of these lanes, and may write others.
void place_boxes(const BodyBlock& block, std::uint32_t lanes, BlockBoxes& boxes) noexcept;

/// The part of a body's box that does not depend on its pose.
class BodyBox {
 public:
  BodyBox() = default;
  explicit BodyBox(const PlacedSolid& solid) noexcept;

  /// Writes the box in the world to `to`, if there is one.
  Place place(const Pose& pose, const BoxWidths& widths, const Motion& motion,
              SceneBox& to) const noexcept {
    const Rotation rotation = Rotation::of(pose.q);
    if (!usable(rotation, pose.t, scale_) || box_.empty) return Place::refused;
    if (box_.endless) return Place::endless;
    WorldBox box = box_.placed(rotation, pose.t, wider(widths));
    if (widths.duration > 0 && !sweep(box, widths.duration, motion)) return Place::refused;
    if (!box.fits()) return Place::refused;
    box.write(to.low, to.high);
    return Place::tree;
  }

  /// Writes the input of place_boxes() except the pose; false if that cannot compute its box.
  bool put(BodyBlock& block, std::size_t k, const BoxWidths& widths) const noexcept {
    for (int c = 0; c < 3; ++c) {
      block.middle[c][k] = box_.middle[c];
      block.half[c][k] = box_.half[c];
    }
    block.wider[k] = wider(widths);
    return !box_.empty && !box_.endless && !(widths.duration > 0) && scale_ > 0 &&
           std::isfinite(scale_);
  }

 private:
  double wider(const BoxWidths& widths) const noexcept {
    return widths.margin + (widths.by_spheres ? box_.protrusion : 0) +
           (widths.by_size ? tolerance_ : 0);
  }
  /// Widens a box by a motion; false if that is invalid.
  bool sweep(WorldBox& box, double duration, const Motion& motion) const noexcept;

  SolidBox box_;  ///< scaled
  double scale_ = 1;
  double tolerance_ = 0;  ///< [u] lower bound of this body's share of an impact's
};

}  // namespace ist
