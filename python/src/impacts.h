#pragma once

#include "arrays.h"

namespace ist::python {

/// Times of impact as columns.
struct Impacts {
  Shape rows;
  Column<double> time{rows}, distance_min{rows}, distance_max{rows};
  Column<double, 3> point_a{rows}, point_b{rows}, normal{rows};
  Column<std::uint32_t> kind{rows}, status{rows}, node_visits{rows}, surface_pairs{rows};
};

}  // namespace ist::python
