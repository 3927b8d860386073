#pragma once

#include <ist/query.h>
#include <ist/time_of_impact.h>

#include "query/find_solid_box.h"
#include "scene/box_tree.h"

namespace ist {

/// Where a body stands among the others.
enum class Place : std::uint8_t {
  free,     ///< it is none
  tree,     ///< its box is in a hierarchy
  endless,  ///< it has no box
  refused,  ///< its pose or scale is not usable
};

/// By how much boxes are wider than solids.
struct BoxWidths {
  double margin = 0;        ///< [u]
  double duration = 0;      ///< [T] of motions that they hold
  bool by_spheres = false;  ///< by what matched spheres stick out
  bool by_size = false;     ///< by the tolerance of impacts for which none is asked
};

struct BodyBlock {
  static constexpr std::size_t kCount = 8;

  // What of a body does not change [u], and its pose.
  double middle[3][kCount], half[3][kCount], wider[kCount];
  double q[4][kCount], t[3][kCount];
  // What place_boxes() writes: the same bits as SolidBox::placed() and WorldBox::write().
  float low[3][kCount], high[3][kCount];
  std::uint32_t placed;  ///< bit k: the k-th pose is usable and floats hold its box
};

void place_boxes(BodyBlock& block) noexcept;

/// What of a body's box does not change with its pose.
class BodyBox {
 public:
  BodyBox() = default;
  explicit BodyBox(const PlacedSolid& solid) noexcept;

  /// In the world: `to`, if it has one.
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

  /// Puts this body in a block; false if it cannot be in one.
  bool put(BodyBlock& block, std::size_t k, const Pose& pose,
           const BoxWidths& widths) const noexcept {
    if (box_.empty || box_.endless || widths.duration > 0 || !(scale_ > 0) ||
        !std::isfinite(scale_))
      return false;
    for (int c = 0; c < 3; ++c) {
      block.middle[c][k] = box_.middle[c];
      block.half[c][k] = box_.half[c];
      block.t[c][k] = pose.t[c];
    }
    for (int c = 0; c < 4; ++c) block.q[c][k] = pose.q[c];
    block.wider[k] = wider(widths);
    return true;
  }

 private:
  double wider(const BoxWidths& widths) const noexcept {
    return widths.margin + (widths.by_spheres ? box_.protrusion : 0) +
           (widths.by_size ? tolerance_ : 0);
  }
  /// Widens a box by a motion; false if that is none.
  bool sweep(WorldBox& box, double duration, const Motion& motion) const noexcept;

  SolidBox box_;  ///< scaled
  double scale_ = 1;
  double tolerance_ = 0;  ///< [u] at least this body's share of an impact's
};

}  // namespace ist
