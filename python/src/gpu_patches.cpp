#include "gpu_batch.h"
#include "penetration.h"

namespace ist::python {

/// Patches of a batch, and whether it was well asked.
struct PatchAnswers {
  GpuContactPatches patches;
  QueryStatus* status = nullptr;
};

namespace {

std::uint32_t most_of(const PatchAnswers& to) { return to.patches.most; }

template <auto kColumn>
void set_patches(PatchAnswers& to, void* data) {
  set_column<kColumn>(to.patches, data);
}

}  // namespace

template <>
std::span<const Answer<PatchAnswers>> columns_of() {
  using To = GpuContactPatches;
  static constexpr Answer<PatchAnswers> kColumns[] = {
      {"count", kUInt32, 0, set_patches<&To::count>, "(n,) uint32 patches of each pair.", true},
      {"id", kUInt64, 0, set_patches<&To::id>,
       "(n, m) uint64: identifies a region of a solid. Ascending.", true, most_of},
      {"centroid", kFloat64, 3, set_patches<&To::centroid>, "(n, m, 3) float64 [u] world.", true,
       most_of},
      {"normal", kFloat64, 3, set_patches<&To::normal>,
       "(n, m, 3) float64 unit, from A to B, world; zero where the area is.", true, most_of},
      {"area", kFloat64, 0, set_patches<&To::area>, "(n, m) float64 [u²] |force|.", true, most_of},
      {"depth", kFloat64, 0, set_patches<&To::depth>, "(n, m) float64 [u] volume/area; 0 if none.",
       true, most_of},
      {"volume", kFloat64, 0, set_patches<&To::volume>,
       "(n, m) float64 [u³], summing to the pair's.", true, most_of},
      {"force", kFloat64, 3, set_patches<&To::force>,
       "(n, m, 3) float64 [u²] on B, summing to the pair's.", true, most_of},
      {"torque", kFloat64, 3, set_patches<&To::torque>,
       "(n, m, 3) float64 [u³/rad] about B's origin, summing to the pair's.", true, most_of},
      {"status", kUInt32, 0, set_column<&PatchAnswers::status>,
       "(n,) uint32, a QueryStatus: ok, invalid_input or not_held.", true},
  };
  return kColumns;
}

namespace {

DeviceAnswers<PatchAnswers> patches_of(DeviceSolids& solids, const py::object& solid_a,
                                       const py::object& solid_b, const py::object& pose_a,
                                       const py::object& pose_b, const py::object& scale_a,
                                       const py::object& scale_b, std::uint32_t max_patches,
                                       const std::string& measure, const py::object& wanted,
                                       const py::object& out, const py::object& stream) {
  const Measure which = named(measure, "measure", kGpuMeasures);
  if (max_patches < 1 || max_patches > kMostGpuPatches)
    throw value_error("max_patches: " + std::to_string(max_patches) + "; wanted 1 to " +
                      std::to_string(kMostGpuPatches));
  PatchAnswers blank;
  blank.patches.most = max_patches;
  return ask<PatchAnswers>(
      solids, {solid_a, solid_b, pose_a, pose_b, scale_a, scale_b}, blank, wanted, out, stream,
      [&](const GpuSolids& all, const GpuPairs& pairs, GpuWorkspace& workspace,
          const PatchAnswers& to, cuda::Stream on) {
        GpuPenetrations whole;
        whole.status = to.status;
        contact_patches_batch(all, pairs, which, workspace, whole, to.patches, on);
      });
}

constexpr const char* kPatchesDoc =
    R"(Contacts of a batch of pairs, each condensed into a few patches, on the device.

solids … scale_b, measure, out, stream: as for penetration().
max_patches: count for each pair, 1 to 32: m, the second dimension. A pair's rows beyond count[i] are
    zero, or unchanged with `out`.
wanted: names of the answers to compute; None: all.

A row takes two assets; with a field it is not_held. Regions and ids are those of
ist.contact_patches(…, field='never'). Volumes, forces and torques sum to the pair's, within 1e-6 of
the sum in double.

Returns a ContactPatches.)";

}  // namespace

void add_gpu_patches(py::module_& module) {
  add_answers<PatchAnswers>(module, "ContactPatches",
                            "Patches of a batch: arrays on the device, None if not requested. "
                            "Arrays passed as `out` are the same objects.");
  module.def("contact_patches", &patches_of, py::arg("solids"), py::arg("solid_a"),
             py::arg("solid_b"), py::arg("pose_a").none(), py::arg("pose_b").none(),
             py::arg("scale_a") = py::none(), py::arg("scale_b") = py::none(), py::kw_only(),
             py::arg("max_patches") = 8, py::arg("measure") = "matched",
             py::arg("wanted") = py::none(), py::arg("out") = py::none(),
             py::arg("stream") = py::none(), kPatchesDoc);
}

}  // namespace ist::python
