#pragma once

#include "penetration.h"

namespace ist::python {

/// Columns that answers about solids apart share.
struct Gaps {
  explicit Gaps(const Shape& rows)
      : distance_min(rows, {}),
        distance_max(rows, {}),
        point_a(rows, {3}),
        point_b(rows, {3}),
        normal(rows, {3}),
        status(rows, {}),
        node_visits(rows, {}) {}

  /// `answer`: a Separation or a TimeOfImpact.
  template <class Answer>
  void write_gap(std::size_t i, const Answer& answer) const {
    *distance_min.row(i) = answer.distance_min;
    *distance_max.row(i) = answer.distance_max;
    Vector(point_a.row(i)) = answer.point_a;
    Vector(point_b.row(i)) = answer.point_b;
    Vector(normal.row(i)) = answer.normal;
    *status.row(i) = static_cast<std::uint32_t>(answer.status);
    *node_visits.row(i) = answer.node_visits;
  }

  Column<double> distance_min, distance_max, point_a, point_b, normal;
  Column<std::uint32_t> status, node_visits;
};

}  // namespace ist::python
