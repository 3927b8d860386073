#include "gpu_batch.h"

#include <ist/gpu.h>

#include "module.h"
#include "penetration.h"

namespace ist::python {

template <>
std::span<const Answer<GpuPenetrations>> columns_of() {
  using To = GpuPenetrations;
  static constexpr Answer<To> kColumns[] = {
      {"volume", kFloat64, 0, set_column<&To::volume>, "(n,) float64 [u³] of the overlap.", true},
      {"centroid", kFloat64, 3, set_column<&To::centroid>,
       "(n, 3) float64 [u] of the overlap, world; zero if none.", true},
      {"translation_gradient", kFloat64, 3, set_column<&To::translation_gradient>,
       "(n, 3) float64 [u²] dV/d(translation of B), world: the force on B is opposite.", true},
      {"rotation_gradient", kFloat64, 3, set_column<&To::rotation_gradient>,
       "(n, 3) float64 [u³/rad] dV/d(rotation vector of B about its origin), world.", true},
      {"status", kUInt32, 0, set_column<&To::status>,
       "(n,) uint32, a QueryStatus: ok or invalid_input.", true},
      {"node_visits", kUInt32, 0, set_column<&To::node_visits>, "(n,) uint32, node pairs opened.",
       false},
      {"sphere_pairs", kUInt32, 0, set_column<&To::sphere_pairs>, "(n,) uint32, lenses summed.",
       false},
  };
  return kColumns;
}

namespace {

DeviceAnswers<GpuPenetrations> penetrations(DeviceAssets& assets, const py::object& asset_a,
                                            const py::object& asset_b, const py::object& pose_a,
                                            const py::object& pose_b, const py::object& scale_a,
                                            const py::object& scale_b, const std::string& measure,
                                            const py::object& wanted, const py::object& out,
                                            const py::object& stream) {
  const Measure which = named(measure, "measure", kMeasures);
  return ask<GpuPenetrations>(
      assets, asset_a, asset_b, pose_a, pose_b, scale_a, scale_b, wanted, out, stream,
      [&](const GpuAssets& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const GpuPenetrations& to,
          cuda::Stream on) { penetration_batch(all, pairs, which, workspace, to, on); });
}

constexpr const char* kPenetrationDoc = R"(Penetrations of a batch of pairs, on the device.

assets: Assets. asset_a, asset_b: (n,) uint32 or int32 numbers of them, or one number for all.
pose_a, pose_b: (n, 7) float64: qw, qx, qy, qz, tx [u], ty, tz; None: at the origin, unturned.
scale_a, scale_b: (n,) float64 > 0; None: 1.
measure: 'matched' (the accurate one) or 'inner' (certified lower bound of the true volume).
wanted: names of answers; None: all but node_visits and sphere_pairs.
out: a dict of arrays by the answers' names, or what an earlier call returned: answers go there, and
    nothing is allocated. uint32 answers fit int32 arrays.
stream: a handle, or an object with __cuda_stream__, cuda_stream (PyTorch) or ptr (CuPy); None: the
    legacy default stream. Answers are written in its order.

Arrays are those of any framework, in the memory of the assets' device, in C order: they are taken by
__dlpack__ or __cuda_array_interface__, never copied, and held until the batch is done. One that
does not fit is a TypeError or a ValueError that names it.

By lenses, as ist.penetration(…, field='never'): volumes are within 1e-6 of the sum in double. The
same bits in every run, whatever else is in the batch. Rows that are invalid are all zero, with the
status invalid_input.
Nothing waits on the host, but in the first batch that is larger than all before. A stream that is
captured needs `out`; graphs and other batches of the same Assets must follow one another.

Returns a Penetration.)";

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
      .def_property_readonly(
          "device", [](const DeviceAssets& self) { return self.assets().device(); },
          "CUDA's number.")
      .def_property_readonly(
          "bytes", [](const DeviceAssets& self) { return self.assets().bytes(); },
          "Of device memory that the assets take.");
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
  add_answers<GpuPenetrations>(
      module, "Penetration",
      "Overlaps of a batch: arrays on the device, None where not wanted; those that were given as "
      "`out` are the same objects.");
  module.def(
      "available", [](int device) { return gpu_available(device); }, py::arg("device") = 0,
      "Whether this build can use the device here; why_not() says what is missing.");
  module.def(
      "why_not",
      [](int device) -> py::object {
        std::string why;
        if (gpu_available(device, &why)) return py::none();
        return py::str(why);
      },
      py::arg("device") = 0, "What is missing where available() is False; None where it is True.");
  module.def("penetration", &penetrations, py::arg("assets"), py::arg("asset_a"),
             py::arg("asset_b"), py::arg("pose_a"), py::arg("pose_b"),
             py::arg("scale_a") = py::none(), py::arg("scale_b") = py::none(), py::kw_only(),
             py::arg("measure") = "matched", py::arg("wanted") = py::none(),
             py::arg("out") = py::none(), py::arg("stream") = py::none(), kPenetrationDoc);
  // So that arguments can be tried where there is no device.
  module.def(
      "_lend",
      [](const py::object& value, const std::string& name, int width, bool written, int device) {
        return lend(value, {name, {kFloat64}, width, written}, device, cuda::legacy_stream()).rows;
      },
      py::arg("value"), py::arg("name"), py::arg("width"), py::arg("written") = false,
      py::arg("device") = 0);
}

}  // namespace ist::python
