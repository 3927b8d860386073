#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <utility>

#include "solid_rows.h"

// Queries of rows on a device.

namespace ist::python {

/// Arguments of a query beside the solids, as they were given.
struct GivenRows {
  const py::object &poses, &scales, &poses_a, &scales_a;
  const py::object &wanted, &out, &stream;
};

py::object device_penetrations(const DeviceSides& sides, const GivenRows& given,
                               const std::string& measure, std::uint32_t pair_budget);
py::object device_separations(const DeviceSides& sides, const GivenRows& given,
                              std::uint32_t max_visits);
py::object device_patches(const DeviceSides& sides, const GivenRows& given, std::size_t max_patches,
                          const std::string& measure);

/// Refuses the first argument that is given where it has no effect.
void refuse_given(const char* where, std::initializer_list<std::pair<const char*, bool>> given);

/// Refuses what only a device takes.
inline void refuse_device_arguments(const GivenRows& given) {
  refuse_given("for solids on a GPU only", {{"wanted", !given.wanted.is_none()},
                                            {"out", !given.out.is_none()},
                                            {"stream", !given.stream.is_none()}});
}

/// The same call gives the same answer on the CPU and on a device, which sums lenses alone.
void refuse_surfaces(const std::string& field);

}  // namespace ist::python
