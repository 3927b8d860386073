#pragma once

#include <cstdint>
#include <optional>

#include <ist/query.h>
#include <ist/time_of_impact.h>

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

/// By how much boxes are wider than solids.
struct BoxWidths {
  double margin = 0;        ///< [u]
  double duration = 0;      ///< [T] of motions that they hold
  bool by_spheres = false;  ///< by what matched spheres stick out
  bool by_size = false;     ///< by the tolerance of impacts for which none is asked
};

SceneBox box_around(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) noexcept;

/// What of a solid's box does not change with its pose.
class BodyBox {
 public:
  BodyBox() = default;
  explicit BodyBox(const PlacedSolid& solid) noexcept;

  /// In the world.
  PlacedBox placed(const Pose& pose, const BoxWidths& widths, const Motion& motion) const noexcept;

 private:
  struct Turned {
    Eigen::Vector3d middle, half;
  };
  static std::optional<Turned> of(const Shape& field) noexcept;

  std::optional<Turned> box_;  ///< in the solid's own frame, scaled; none: it has no end
  double scale_ = 1;
  double sticks_out_ = 0;  ///< [u]
  double tolerance_ = 0;   ///< [u] at least this body's share of an impact's
  bool empty_ = false;
};

}  // namespace ist
