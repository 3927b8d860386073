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
      {"force", kFloat64, 3, set_column<&To::force>,
       "(n, 3) float64 [u²] −dV/d(translation of B), world: the force on B of a pressure of 1.",
       true},
      {"torque", kFloat64, 3, set_column<&To::torque>,
       "(n, 3) float64 [u³] −dV/d(rotation vector of B) about B's origin, world.", true},
      {"status", kUInt32, 0, set_column<&To::status>,
       "(n,) uint32, a QueryStatus: ok, invalid_input or not_held.", true},
      {"node_visits", kUInt32, 0, set_column<&To::node_visits>, "(n,) uint32, node pairs opened.",
       false},
      {"sphere_pairs", kUInt32, 0, set_column<&To::sphere_pairs>, "(n,) uint32, lenses summed.",
       false},
  };
  return kColumns;
}

py::object device_penetrations(const DeviceSides& sides, const GivenRows& given,
                               const std::string& measure, std::uint32_t pair_budget) {
  const Measure which = named(measure, "measure", kGpuMeasures);
  return ask<GpuPenetrations>(
      sides, given, {},
      [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const GpuPenetrations& to, cuda::Stream on) {
        penetration_batch(all, pairs, {which, pair_budget}, workspace, to, on);
      });
}

void add_gpu_penetration(py::module_& module) {
  add_answers<GpuPenetrations>(module, "Penetration",
                               "Overlaps of a batch: arrays on the device, None if not requested. "
                               "Arrays passed as `out` are the same objects.");
}

}  // namespace ist::python
