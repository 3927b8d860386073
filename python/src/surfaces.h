#pragma once

#include <string>

#include "arrays.h"

namespace ist::python {

struct RayHits {
  Shape rows;
  Column<double> distance{rows};
  Column<double, 3> point{rows}, normal{rows};
  Column<std::uint32_t> triangle{rows}, status{rows};
};

struct SurfacePoints {
  Shape rows;
  Column<double> distance{rows}, error{rows};
  Column<double, 3> point{rows}, gradient{rows};
  Column<std::uint32_t> triangle{rows}, status{rows};
};

/// (3,) or (n, 3).
struct Places {
  Places(const py::object& value, const char* name)
      : held(take_doubles(value, name, "(3,) or (n, 3)")) {
    if (held.ndim() < 1 || held.ndim() > 2 || held.shape(held.ndim() - 1) != 3)
      refuse_shape(held, name, "(3,) or (n, 3)");
    if (held.ndim() == 2) rows = {held.shape(0)};
    count = held.ndim() == 2 ? held.shape(0) : 1;
  }
  Eigen::Vector3d at(std::size_t i) const {
    const double* const x = held.data() + (held.ndim() == 2 ? 3 * i : 0);
    return {x[0], x[1], x[2]};
  }

  Doubles held;
  Shape rows;
  std::size_t count = 0;
};

/// The shape of ray answers: one origin or direction applies to all of the other.
inline const Shape& rows_of(const Places& origins, const Places& directions) {
  if (!origins.rows.empty() && !directions.rows.empty() && origins.count != directions.count)
    throw value_error("directions: " + std::to_string(directions.count) + " rows; origins have " +
                      std::to_string(origins.count));
  return origins.rows.empty() ? directions.rows : origins.rows;
}

}  // namespace ist::python
