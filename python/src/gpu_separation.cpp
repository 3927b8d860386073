#include "gpu_batch.h"

namespace ist::python {

template <>
std::span<const Answer<GpuSeparations>> columns_of() {
  using To = GpuSeparations;
  static constexpr Answer<To> kColumns[] = {
      {"distance", kFloat64, 0, set_column<&To::distance>,
       "(n,) float64 [u] between the inner spheres; 0 where they overlap.", true},
      {"distance_min", kFloat64, 0, set_column<&To::distance_min>,
       "(n,) float64 [u] the true distance of the solids is at least this, certified.", true},
      {"distance_max", kFloat64, 0, set_column<&To::distance_max>,
       "(n,) float64 [u] and at most this, certified.", true},
      {"point_a", kFloat64, 3, set_column<&To::point_a>,
       "(n, 3) float64 [u] on A's inner spheres, world.", true},
      {"point_b", kFloat64, 3, set_column<&To::point_b>,
       "(n, 3) float64 [u] on B's inner spheres, world.", true},
      {"normal", kFloat64, 3, set_column<&To::normal>, "(n, 3) float64 unit, from A to B, world.",
       true},
      {"status", kUInt32, 0, set_column<&To::status>, "(n,) uint32, a QueryStatus.", true},
      {"node_visits", kUInt32, 0, set_column<&To::node_visits>, "(n,) uint32, node pairs opened.",
       false},
      {"sphere_pairs", kUInt32, 0, set_column<&To::sphere_pairs>,
       "(n,) uint32, sphere pairs measured.", false},
  };
  return kColumns;
}

namespace {

DeviceAnswers<GpuSeparations> separations(DeviceSolids& solids, const py::object& solid_a,
                                          const py::object& solid_b, const py::object& pose_a,
                                          const py::object& pose_b, const py::object& scale_a,
                                          const py::object& scale_b, std::uint32_t max_visits,
                                          const py::object& wanted, const py::object& out,
                                          const py::object& stream) {
  return ask<GpuSeparations>(
      solids, {solid_a, solid_b, pose_a, pose_b, scale_a, scale_b}, {}, wanted, out, stream,
      [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const GpuSeparations& to,
          cuda::Stream on) { separation_batch(all, pairs, max_visits, workspace, to, on); });
}

constexpr const char* kSeparationDoc =
    R"(Distances of the inner spheres of a batch of pairs, with certified intervals, on the device.

solids … scale_b, wanted, out, stream: as for penetration().
max_visits: limit of node pairs for each pair; 0: no limit.

A row takes two assets; with a field it is not_held. The distance is the minimum over all pairs of
inner spheres in double. That of ist.separation(…, inner_spheres=True) may be larger by 1e-6 of the
solids' size, and may select another of several equally near pairs. If a limit stops the query, the
status is budget_exhausted and the certified interval may differ from the CPU's.

Returns a Separation.)";

}  // namespace

void add_gpu_separation(py::module_& module) {
  add_answers<GpuSeparations>(module, "Separation",
                              "Gaps of a batch: arrays on the device, None if not requested. "
                              "Arrays passed as `out` are the same objects.");
  module.def("separation", &separations, py::arg("solids"), py::arg("solid_a"), py::arg("solid_b"),
             py::arg("pose_a").none(), py::arg("pose_b").none(), py::arg("scale_a") = py::none(),
             py::arg("scale_b") = py::none(), py::kw_only(), py::arg("max_visits") = 0,
             py::arg("wanted") = py::none(), py::arg("out") = py::none(),
             py::arg("stream") = py::none(), kSeparationDoc);
}

}  // namespace ist::python
