#include <ist/gpu.h>

#include "gpu_batch.h"
#include "module.h"

namespace ist::python {

void refuse_given(const char* where, std::initializer_list<std::pair<const char*, bool>> given) {
  for (const auto& [name, is_given] : given)
    if (is_given) throw value_error(std::string(name) + ": " + where);
}

void add_gpu(py::module_& package) {
  // The module is ist.gpu, since the package already has its final name.
  py::module_ module = package.def_submodule(
      "gpu",
      "Whether there is a GPU, and the answers of queries of ist.Solids on one: arrays that any "
      "framework takes without a copy. docs/batch.md, docs/python.md.");
  add_device_array(module);
  module.def(
      "available", [](int device) { return gpu_available(device); }, py::arg("device") = 0,
      "Whether this build can use the device; why_not() returns the reason if not.");
  module.def(
      "why_not",
      [](int device) -> py::object {
        std::string why;
        if (gpu_available(device, &why)) return py::none();
        return py::str(why.c_str());
      },
      py::arg("device") = 0, "What is missing where available() is False; None where it is True.");
  add_gpu_penetration(module);
  add_gpu_separation(module);
  add_gpu_scene(module);
  // For testing arguments without a device.
  module.def(
      "_lend",
      [](const py::object& value, const std::string& name, int width, bool written, int device) {
        return lend(value, {name, {kFloat64}, {width}, written}, device, cuda::legacy_stream())
            .rows;
      },
      py::arg("value"), py::arg("name"), py::arg("width"), py::arg("written") = false,
      py::arg("device") = 0);
}

}  // namespace ist::python
