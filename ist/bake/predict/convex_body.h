#pragma once

#include <Eigen/Core>
#include <optional>

namespace ist {

/// A part of a line.
struct LinePart {
  double from = 0, to = 0;  ///< in lengths of the line's direction, from < to
};

/// A ball or a box somewhere, cut by lines exactly.
class ConvexBody {
 public:
  /// `radius` > 0, [u].
  static ConvexBody ball(const Eigen::Vector3d& centre, double radius);
  /// Half extents > 0, [u], along the columns of `axes`, a rotation.
  static ConvexBody box(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes,
                        const Eigen::Vector3d& half_extents);

  /// The part of the line {origin + t · direction} that lies inside, if any.
  std::optional<LinePart> part_of(const Eigen::Vector3d& origin,
                                  const Eigen::Vector3d& direction) const;
  double volume() const;

  ConvexBody moved(const Eigen::Vector3d& by) const;  ///< [u]

 private:
  ConvexBody() = default;

  Eigen::Vector3d centre_;
  Eigen::Matrix3d axes_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d half_extents_;  ///< of a ball: its radius, three times
  bool round_ = false;
};

}  // namespace ist
