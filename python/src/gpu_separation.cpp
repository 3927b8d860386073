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

py::object device_separations(const DeviceSides& sides, const GivenRows& given,
                              std::uint32_t max_visits) {
  return ask<GpuSeparations>(
      sides, given, {},
      [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const GpuSeparations& to,
          cuda::Stream on) { separation_batch(all, pairs, max_visits, workspace, to, on); });
}

void add_gpu_separation(py::module_& module) {
  add_answers<GpuSeparations>(module, "Separation",
                              "Gaps of a batch: arrays on the device, None if not requested. "
                              "Arrays passed as `out` are the same objects.");
}

}  // namespace ist::python
