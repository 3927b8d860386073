#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bake/surface/hull.h"
#include "mesh/mesh_view.h"
#include "mesh/triangle_frame.h"

namespace ist {

/// Shows that all points of a convex hull lie within a distance of a surface. The distance to a
/// triangle is convex: what has its corners within the distance of one triangle lies within it;
/// what has not is cut where the triangle ends. Unit frame, before rounding.
class HullCuts {
 public:
  using Frame = TriangleFrame<double>;

  /// A point that is no further than this from the surface.
  struct Known {
    Hull::Point at;
    double distance;
  };

  /// `surface` has a hierarchy and must outlive this. `frames`: of all its triangles, or none where
  /// they are to be made as they are needed.
  explicit HullCuts(const MeshView& surface, std::vector<Frame> frames = {})
      : surface_(surface), frames_(std::move(frames)) {}

  /// `candidates`: triangles that are looked at first. False: it may be so or not.
  bool is_within(const Hull& hull, std::span<const std::uint32_t> candidates, double distance,
                 const Known& known) const;

  Frame frame(std::uint32_t triangle) const;

 private:
  struct Task;
  bool is_within(const Hull& hull, const Known& known, Task& task) const;
  /// Whether what lies over the triangle is, and so is what is cut off.
  bool is_within(const Hull& hull, const Frame& triangle, const Known& known, Task& task) const;

  const MeshView& surface_;
  std::vector<Frame> frames_;
};

}  // namespace ist
