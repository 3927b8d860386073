#pragma once

#include "arrays.h"

namespace ist::python {

/// Separations as columns.
struct Separations {
  Shape rows;
  Column<double> distance{rows}, distance_min{rows}, distance_max{rows};
  Column<double, 3> point_a{rows}, point_b{rows}, normal{rows};
  Column<std::uint32_t> status{rows}, node_visits{rows}, sphere_pairs{rows};
};

}  // namespace ist::python
