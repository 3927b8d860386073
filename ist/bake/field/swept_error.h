#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bake/field/field_hierarchy.h"
#include "bake/field/field_mesh.h"
#include "mesh/mesh_view.h"
#include "mesh/triangle_frame.h"

namespace ist {

/// How far from a field's surface the triangles of a mesh come while their vertices move straight
/// to their places in the field. Distances in the unit frame, before rounding.
class SweptError {
 public:
  /// All must outlive this. `vertex_of`: a mesh vertex's place in the field.
  SweptError(const MeshView& mesh, const FieldMesh& field, const FieldHierarchy& hierarchy,
             const std::vector<std::uint32_t>& vertex_of);

  /// Of a used vertex of the mesh where it starts from; exact where above `enough`, else no less.
  double at_vertex(std::uint32_t vertex, double enough) const;

  /// A bound for all points that a triangle of the mesh sweeps, at most `target` where that can be
  /// shown.
  double bound(std::uint32_t triangle, double target) const;

 private:
  using Point = std::array<double, 3>;

  /// What a part of a triangle sweeps in a part of the time: it lies in the hull of six points.
  struct Prism {
    Point corner[6];  ///< at the start, at the end
    Point centre() const;
    double radius(const Point& centre) const;
    /// Halved across its longest side, or in time.
    std::array<Prism, 2> halves() const;
  };

  double distance2(std::uint32_t field_triangle, const Point& p) const {
    return closest_in_frame(frames_[field_triangle], p.data()).distance2;
  }
  /// Farthest corner from a triangle, squared; any value > limit2 once one is further. The distance
  /// to a triangle is convex, so that no point of the hull is further.
  double farthest2(std::uint32_t field_triangle, const Prism& prism, double limit2) const;
  double bound(const Prism& prism, std::span<const std::uint32_t> candidates, double target) const;
  std::span<const std::uint32_t> star(std::uint32_t field_vertex) const;

  const MeshView& mesh_;
  const FieldMesh& field_;
  const FieldHierarchy& hierarchy_;
  const std::vector<std::uint32_t>& vertex_of_;
  std::vector<TriangleFrame<double>> frames_;  ///< [field triangle]
  std::vector<std::uint32_t> first_, around_;  ///< the triangles around each field vertex
};

}  // namespace ist
