#pragma once

#include <cstdint>
#include <optional>

#include <ist/query.h>

#include "scene/box_tree.h"

namespace ist {

/// Where a body stands among the others.
enum class Place : std::uint8_t {
  free,     ///< it is none
  tree,     ///< its box is in a hierarchy
  endless,  ///< it has no box
  refused,  ///< its pose or scale is not usable
};
struct PlacedBox {
  Place place = Place::refused;
  SceneBox box = {};
};

SceneBox box_around(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) noexcept;

/// What of a solid's box does not change with its pose.
class BodyBox {
 public:
  BodyBox() = default;
  explicit BodyBox(const PlacedSolid& solid) noexcept;

  /// In the world, `margin` wider; and by what matched spheres stick out.
  PlacedBox placed(const Pose& pose, double margin, bool by_spheres) const noexcept;

 private:
  struct Turned {
    Eigen::Vector3d middle, half;
  };
  static std::optional<Turned> of(const Field& field) noexcept;

  std::optional<Turned> box_;  ///< in the solid's own frame, scaled; none: it has no end
  double scale_ = 1;
  double sticks_out_ = 0;  ///< [u]
  bool empty_ = false;
};

}  // namespace ist
