#include "gpu_batch.h"
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
       "(n,) uint32, a QueryStatus: ok, invalid_input or not_held.", true},
      {"node_visits", kUInt32, 0, set_column<&To::node_visits>, "(n,) uint32, node pairs opened.",
       false},
      {"sphere_pairs", kUInt32, 0, set_column<&To::sphere_pairs>, "(n,) uint32, lenses summed.",
       false},
  };
  return kColumns;
}

namespace {

DeviceAnswers<GpuPenetrations> penetrations(DeviceSolids& solids, const py::object& solid_a,
                                            const py::object& solid_b, const py::object& pose_a,
                                            const py::object& pose_b, const py::object& scale_a,
                                            const py::object& scale_b, const std::string& measure,
                                            std::uint32_t pair_budget, const py::object& wanted,
                                            const py::object& out, const py::object& stream) {
  const Measure which = named(measure, "measure", kGpuMeasures);
  return ask<GpuPenetrations>(
      solids, {solid_a, solid_b, pose_a, pose_b, scale_a, scale_b}, {}, wanted, out, stream,
      [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const GpuPenetrations& to, cuda::Stream on) {
        penetration_batch(all, pairs, {which, pair_budget}, workspace, to, on);
      });
}

constexpr const char* kPenetrationDoc = R"(Penetrations of a batch of pairs, on the device.

solids: Solids. solid_a, solid_b: (n,) uint32 or int32 indices of them, or one index for all. A row
    takes two assets, or an asset and a field in either order.
pose_a, pose_b: (n, 7) float64: qw, qx, qy, qz, tx [u], ty, tz; None: the identity.
scale_a, scale_b: (n,) float64 > 0; None: 1.
measure: 'matched' (the accurate one) or 'inner' (certified lower bound of the true volume). 'exact'
    is for the CPU: ist.penetration.
pair_budget: approximate number of sphere pairs per pair of assets, as in ist.penetration; matched
    measure only; 0: no limit. With a field it has no effect.
wanted: names of the answers to compute; None: all but node_visits and sphere_pairs.
out: a dict of arrays by name, or the result of an earlier call. Answers are written there, and
    nothing is allocated. uint32 answers fit int32 arrays.
stream: a handle, or an object with __cuda_stream__, cuda_stream (PyTorch) or ptr (CuPy); None: the
    legacy default stream. Answers are written in its order.

Arrays can be of any framework, on the solids' device and in C order. They are read through
__dlpack__ or __cuda_array_interface__, never copied, and kept alive until the batch is done. An
unsuitable one raises a TypeError or ValueError that names it.

Two assets are summed by lenses, as in ist.penetration(…, field='never'); volumes are within 1e-6 of
the sum in double. With a field, volumes and gradients agree with the CPU's to 1e-9. The bits are the
same in every run, whatever else is in the batch. A row with an invalid pose, scale, field or index is
NaN with the status invalid_input; a row of two fields is NaN with not_held.
The host waits only in a batch that is larger than all before. A captured stream needs `out`. Graphs
and other batches of the same Solids must run one after another.

Returns a Penetration.)";

}  // namespace

void add_gpu_penetration(py::module_& module) {
  add_answers<GpuPenetrations>(module, "Penetration",
                               "Overlaps of a batch: arrays on the device, None if not requested. "
                               "Arrays passed as `out` are the same objects.");
  module.def("penetration", &penetrations, py::arg("solids"), py::arg("solid_a"),
             py::arg("solid_b"), py::arg("pose_a").none(), py::arg("pose_b").none(),
             py::arg("scale_a") = py::none(), py::arg("scale_b") = py::none(), py::kw_only(),
             py::arg("measure") = "matched", py::arg("pair_budget") = 0,
             py::arg("wanted") = py::none(), py::arg("out") = py::none(),
             py::arg("stream") = py::none(), kPenetrationDoc);
}

}  // namespace ist::python
