#include <ist/gpu.h>

#include "gpu_batch.h"
#include "module.h"

namespace ist::python {
namespace {

void add_solids_class(py::module_& module) {
  py::class_<DeviceSolids>(
      module, "Solids",
      "Assets and fields in the memory of a device, for batches. Pairs refer to them by index.\n\n"
      "Their data is copied. Batches of one Solids run one after another, even on different "
      "streams, "
      "because they share working memory. Keep it alive as long as captured graphs use it.")
      .def(py::init<const py::sequence&, int>(), py::arg("solids"), py::kw_only(),
           py::arg("device") = 0,
           "solids: ist.Asset or ist.Field each; for an asset's surface ist.MeshField(asset). "
           "Raises ist.Error if the device cannot be used or is out of memory.")
      .def("__len__", [](const DeviceSolids& self) { return self.solids().size(); })
      .def_prop_ro(
          "device", [](const DeviceSolids& self) { return self.solids().device(); },
          "CUDA device index.")
      .def_prop_ro(
          "bytes", [](const DeviceSolids& self) { return self.solids().bytes(); },
          "Device memory of the solids.");
}

}  // namespace

void add_gpu(py::module_& package) {
  // ist.gpu, since the package has its users' name meanwhile.
  py::module_ module = package.def_submodule(
      "gpu",
      "Batches on a GPU: arrays of any framework, in and out, without a copy.\n\n"
      "available() reports whether there is one. docs/batch.md, docs/python.md.");
  add_device_array(module);
  add_solids_class(module);
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
  add_gpu_patches(module);
  // So that arguments can be tried where there is no device.
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
