#pragma once

#include <initializer_list>
#include <utility>

#include "rows.h"

// Queries of two placed solids, on the CPU and on a device.

namespace ist::python {

/// The arguments common to all such queries, as given.
struct GivenPair {
  const py::object &a, &b, &poses, &scales, &poses_a, &scales_a;

  Rows rows() const { return Rows::of_pair(a, b, poses, scales, poses_a, scales_a); }
};

/// The destination of a device's answers.
struct GivenOutput {
  const py::object &wanted, &out, &stream;
};

/// Adds query(pair, more…). `more`: py::arg of each, and the doc.
template <class Answer, class... Given, class... More>
void add_pair_query(py::module_& module, const char* name,
                    Answer (*query)(const GivenPair&, Given...), const More&... more) {
  module.def(
      name,
      [query](const py::object& a, const py::object& b, const py::object& poses,
              const py::object& scales, const py::object& poses_a, const py::object& scales_a,
              Given... given) {
        return query({a, b, poses, scales, poses_a, scales_a}, given...);
      },
      py::arg("a"), py::arg("b"), py::arg("poses").none(), py::kw_only(),
      py::arg("scales") = py::none(), py::arg("poses_a") = py::none(),
      py::arg("scales_a") = py::none(), more...);
}

/// Refuses the first argument that is given without effect.
void refuse_given(const char* where, std::initializer_list<std::pair<const char*, bool>> given);

/// Refuses arguments that only a device supports.
inline void refuse_output(const GivenOutput& given) {
  refuse_given("for solids on a GPU only", {{"wanted", !given.wanted.is_none()},
                                            {"out", !given.out.is_none()},
                                            {"stream", !given.stream.is_none()}});
}

}  // namespace ist::python
