#include <ist/gpu.h>

#include "gpu_batch.h"
#include "module.h"

namespace ist::python {
namespace {

void add_assets_class(py::module_& module) {
  py::class_<DeviceAssets>(
      module, "Assets",
      "Assets in the memory of a device, for batches: pairs name them by their place.\n\n"
      "Batches of one Assets follow one another, whatever their streams: they share memory to work "
      "in. Graphs that were captured need it as long as they are used.")
      .def(py::init<const py::sequence&, int>(), py::arg("assets"), py::kw_only(),
           py::arg("device") = 0,
           "assets: ist.Asset each. Raises ist.Error where the device cannot be used or has no "
           "memory left.")
      .def("__len__", [](const DeviceAssets& self) { return self.assets().size(); })
      .def_prop_ro(
          "device", [](const DeviceAssets& self) { return self.assets().device(); },
          "CUDA's number.")
      .def_prop_ro(
          "bytes", [](const DeviceAssets& self) { return self.assets().bytes(); },
          "Of device memory that the assets take.");
}

void add_fields_class(py::module_& module) {
  py::class_<DeviceFields>(
      module, "Fields",
      "Fields in the memory of a device, for batches: pairs name them by their place.\n\n"
      "All that they point to is copied. Graphs that were captured need it as long as they are "
      "used.")
      .def(py::init<const py::sequence&, int>(), py::arg("fields"), py::kw_only(),
           py::arg("device") = 0,
           "fields: ist.Field each; of an asset's surface, ist.MeshField(asset). Raises ist.Error "
           "where the device cannot be used or has no memory left.")
      .def("__len__", [](const DeviceFields& self) { return self.fields().size(); })
      .def_prop_ro(
          "device", [](const DeviceFields& self) { return self.fields().device(); },
          "CUDA's number.")
      .def_prop_ro(
          "bytes", [](const DeviceFields& self) { return self.fields().bytes(); },
          "Of device memory that the fields take.");
}

}  // namespace

void add_gpu(py::module_& package) {
  // ist.gpu, since the package has its users' name meanwhile.
  py::module_ module = package.def_submodule(
      "gpu",
      "Batches on a GPU: arrays of any framework, in and out, without a copy.\n\n"
      "available() says whether there is one. docs/batch.md, docs/python.md.");
  add_device_array(module);
  add_assets_class(module);
  add_fields_class(module);
  module.def(
      "available", [](int device) { return gpu_available(device); }, py::arg("device") = 0,
      "Whether this build can use the device here; why_not() says what is missing.");
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
